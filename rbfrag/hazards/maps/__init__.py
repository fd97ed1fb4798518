"""Failures of the blocks of a map of shaking in its earthquake."""
