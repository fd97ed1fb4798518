"""Figures, one a file; the only package that imports matplotlib."""
