"""The method ``confined``: outcomes of blocks that topple under their back plane; like
``capacity``.
"""

from __future__ import annotations

from rbfrag.fragility.methods.capacity import capacity_method

METHOD = capacity_method(
    "confined", "confined_toppling", ("kct", "pct2"), "topples past recovery under its back plane"
)
