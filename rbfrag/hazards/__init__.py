"""Hazard curves, annual rates of failure."""
