"""Merge of two databases."""
