"""Answers: headline, labelled lines, tables, JSON document and warnings of each result, in every
interface.

The class of an answer stays with its capability and derives from `Result`. Rounding, percentages
and warning codes are defined here; physics and statistics are not.
"""
