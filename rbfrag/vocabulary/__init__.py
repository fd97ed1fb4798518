"""Quantities, each declared once: name, label, unit, range, symbol, aliases, credible values,
storage.

Options, keywords, columns, JSON keys, axes and labels derive from these declarations. The package
holds no values and no formulas, and loads in milliseconds without numpy.
"""
