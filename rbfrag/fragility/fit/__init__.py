"""Fitting: data, estimators, errors clustered by earthquake, scores."""
