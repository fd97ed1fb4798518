"""Campaigns: which runs to make, and the workers that make them."""
