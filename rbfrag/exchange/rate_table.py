"""Annual rates as a table: one row a site and block."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.hazards.answer import HazardAnswer
from rbfrag.hazards.curve import HazardCurve


def rate_columns(
    curves: Sequence[HazardCurve], blocks: Mapping[str, Any], found: Sequence[HazardAnswer]
) -> dict[str, NDArray[Any]]:
    """Return the columns of the table.

    Args:
        curves: the hazard curves, one a site.
        blocks: ``block_id``, ``p2_1_s2`` and ``kr`` of the blocks.
        found: the answers, one a site.
    """
    size = len(blocks["block_id"])
    alone = len(blocks["kr"]) == size  # a class of blocks has no single p² and k_r
    nothing = float("nan")

    def by_site(values: list[Any], kind: Any) -> NDArray[Any]:
        return np.repeat(np.array(values, dtype=kind), size)

    def sizes(name: str) -> NDArray[np.float64]:
        values = np.asarray(blocks[name], dtype=np.float64)
        return np.tile(values if alone else np.full(size, nothing), len(curves))

    names = ["" if name is None else str(name) for name in blocks["block_id"]]
    return {
        "site": by_site([curve.place for curve in curves], object),
        "lon": by_site([nothing if c.lon is None else c.lon for c in curves], np.float64),
        "lat": by_site([nothing if c.lat is None else c.lat for c in curves], np.float64),
        "block_id": np.tile(np.array(names, dtype=object), len(curves)),
        "p2_1_s2": sizes("p2_1_s2"),
        "kr": sizes("kr"),
        "annual_rate": np.concatenate([one.annual_rate for one in found]),
        "ci_low": np.concatenate([one.ci_low for one in found]),
        "ci_high": np.concatenate([one.ci_high for one in found]),
        "probability": np.concatenate([one.probability for one in found]),
        "years": np.full(size * len(curves), found[0].years),
    }
