"""Failures of the blocks on a map of shaking in one earthquake."""
