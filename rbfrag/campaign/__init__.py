"""Campaigns: which runs to make, the workers that make them, their rows."""
