"""Accelerograms: readers by format, intensity measures, quality signs."""
