"""Figures, one subject a file; the only package that imports matplotlib.

A figure draws an answer that another package has computed. Numbers and words in it come from
`results` and `vocabulary`.
"""
