"""Hazard curves in the files of other tools."""
