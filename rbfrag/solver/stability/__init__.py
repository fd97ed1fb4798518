"""Failure modes and yield accelerations, for single blocks and arrays."""
