"""Hazard curves and annual rates of failure."""
