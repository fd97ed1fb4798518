"""Fragility models: intensity terms, fits, prediction."""
