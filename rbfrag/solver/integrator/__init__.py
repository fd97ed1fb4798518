"""Integration of the equations of motion by one Taylor step per sample interval. Events are located
on the polynomial of the step (docs/theory/toppling.md, Numerics).
"""
