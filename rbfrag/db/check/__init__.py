"""Checks of a database for altered, missing or contradictory rows."""
