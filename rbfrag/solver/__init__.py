"""Rigid-block models: response kernels and the critical search."""
