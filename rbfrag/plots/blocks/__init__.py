"""Figures of blocks and of the planes that bound them."""
