"""How many outcomes of the blocks that a model was fitted to are not known. No library is loaded.

The run of a slumping block ends where strong shaking takes it off its back plane: whether it would
have failed is not known. The fit stores the share of such outcomes over strength and shaking, and
every answer tells that of like blocks and shaking.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rbfrag.errors import ModelError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

NOTABLE_SHARE = 0.05
"""From this share on an answer says it in words."""

_SENTENCE = (
    "of the outcomes that the model was fitted to, of like strength and shaking, are not known: "
    "those blocks leave the model before they fail"
)

IN_GENERAL = f"a share (unknown_share) {_SENTENCE}"
"""The sentence about many elements, whose shares stand in their own array."""


@dataclass(frozen=True)
class UnknownOutcomes:
    """Shares of outcomes that are not known, on straight lines between nodes.

    Args:
        variable: what the curves run over: ``k_over_pga`` or ``y_over_intensity``.
        strength: name of the block's strength.
        edges: strengths that part the classes, each with its curve.
        first: logarithm of the variable at the first node.
        step: from one node to the next.
        shares: by class and node.
    """

    variable: str
    strength: str
    edges: tuple[float, ...]
    first: float
    step: float
    shares: tuple[tuple[float, ...], ...]

    @classmethod
    def stored(
        cls, diagnostics: Mapping[str, Any], strength: str, name: str
    ) -> UnknownOutcomes | None:
        """Return what a model's diagnostics hold, None where all outcomes are known.

        Args:
            strength: name of its block's strength.

        Raises:
            ModelError: the curves are torn.
        """
        curves = diagnostics.get("unknown_outcomes")
        if curves is None:
            return None
        try:
            edges = tuple(float(edge) for edge in curves["edges"])
            shares = tuple(tuple(float(v) for v in line) for line in curves["shares"])
            unknown = cls(
                str(curves["variable"]), strength, edges, float(curves["first"]),
                float(curves["step"]), shares,
            )  # fmt: skip
        except (KeyError, TypeError, ValueError):
            shares, edges = (), ()
        sizes = {len(line) for line in shares}
        if len(shares) != len(edges) + 1 or len(sizes) != 1 or sizes == {0}:
            raise ModelError(
                f"model {name!r} holds curves of unknown outcomes that are not whole: fit it again"
            )
        return unknown

    def share(self, values: Mapping[str, float]) -> float:
        """Return the share at the completed values of one question."""
        line = self.shares[sum(values[self.strength] >= edge for edge in self.edges)]
        ratio = self._ratio(values)
        last = len(line) - 1
        at = (math.log(ratio) - self.first) / self.step if ratio > 0.0 else 0.0
        if not 0.0 < at < last:
            return line[0 if at <= 0.0 else last]
        node = int(at)
        return line[node] + (at - node) * (line[node + 1] - line[node])

    def array(self, values: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return the share at each of many completed values; NaN where one of them is."""
        import numpy as np

        strength, ratio = values[self.strength], self._ratio(values)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = np.clip((np.log(ratio) - self.first) / self.step, 0.0, len(self.shares[0]) - 1.0)
        number = np.broadcast_to(np.searchsorted(self.edges, strength, side="right"), at.shape)
        nodes = np.arange(len(self.shares[0]))
        result = np.full(at.shape, np.nan)
        for k, line in enumerate(self.shares):
            own = number == k
            result[own] = np.interp(at[own], nodes, line)
        return result

    def _ratio(self, values: Mapping[str, Any]) -> Any:
        over: Sequence[str] = (
            (self.strength, "pga_g")
            if self.variable == "k_over_pga"
            else ("y_m_s", "intensity_m_s")
        )
        return values[over[0]] / values[over[1]]


def in_words(share: float) -> str:
    """Return the sentence about a share."""
    return f"{100.0 * share:.0f} % {_SENTENCE}"
