"""Accelerograms: file formats, processing, intensity measures."""
