"""Fragility models: methods, fits, answers."""
