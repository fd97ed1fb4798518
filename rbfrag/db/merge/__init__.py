"""Bringing two databases together."""
