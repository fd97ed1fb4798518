"""Fragility models: methods, fits, stored models and their predictions.

A method declares parameters, predictors, link and fit in one file; a model is its coefficients with
their covariance. Predictors are numbers: the geometry of blocks is in `solver`, their
classification in `question`.
"""
