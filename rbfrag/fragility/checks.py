"""What can be wrong or doubtful about the input of a prediction.

Every check is written once and looks at single numbers or at arrays. No sentence holds a
semicolon, which separates the reasons of an array's element.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Generic

from rbfrag.fragility.formulas import ABOVE_SPECTRUM, ABOVE_TWICE_PGV, LINE, NOT_LIFTED
from rbfrag.fragility.functions import Functions, N
from rbfrag.fragility.methods import wls as straight_line
from rbfrag.fragility.model import FragilityModel

NEGATIVE_SHARE_LIMIT = 0.025
"""Probability of a negative critical velocity above which a straight line is doubted."""

_WORDS = {
    "p2": ("1/s²", "p² = m g r/I of the block, 0.1 to 30 1/s² for blocks of 74 m to 0.25 m"),
    "kr": (
        "",
        "the block's yield acceleration coefficient at rest, tan(critical angle) (a block "
        "with k_r <= 0 falls without an earthquake)",
    ),
    "pgv_m_s": ("m/s", "the peak ground velocity in m/s, 0 or more"),
    "pga_g": ("g", "the peak ground acceleration in g, 0 or more"),
    "pgd_m": ("m", "the peak ground displacement in m, 0 or more"),
    "tm_s": ("s", "the mean period in s, above 0"),
    "xp_m_s": ("m/s", "the toppling spectrum X(p) in m/s, 0 or more"),
    "intensity_m_s": ("m/s", ""),
    "y_m_s": ("m/s", ""),
    "pgv_over_pga_s": ("s", ""),
}

# Beyond these no rock block and no earthquake exists, and arithmetic might overflow.
_LOWEST_P2, _HIGHEST = 1e-9, 1e9

_SUSPECTS = (
    ("pgv_m_s", 0.0, 5.0, "larger than ever recorded (it is in m/s): did you mean cm/s?"),
    ("pga_g", 0.0, 5.0, "larger than ever recorded (it is in g): did you mean cm/s² or m/s²?"),
    ("pgd_m", 0.0, 20.0, "larger than ever recorded (it is in m): did you mean cm?"),
    (
        "pgv_over_pga_s",
        0.005,
        2.0,
        "not that of an earthquake (PGV in m/s over 9.81 times PGA in g lies between 0.005 and 2 "
        "s): is PGV in m/s and PGA in g?",
    ),
    ("tm_s", 0.02, 10.0, "not the mean period of an earthquake (it is in s): is it a frequency?"),
    ("kr", 0.0, 5.0, "steeper than 78°: it is the tangent of the critical angle, not degrees"),
)


@dataclass(frozen=True)
class Finding(Generic[N]):
    """One thing found about the input.

    Args:
        holds: whether (where) it is so.
        name: the input concerned.
        value: its value.
        text: what is wrong and what to do.
    """

    holds: Any
    name: str
    value: N
    text: str

    def about(self, value: float) -> str:
        """Return the sentence for one value."""
        unit = _WORDS[self.name][0]
        return f"{self.name} = {value:.6g}{' ' if unit else ''}{unit} {self.text}"

    def in_general(self) -> str:
        """Return the sentence for many values."""
        return f"{self.name} {self.text}"


def refusals(values: Mapping[str, N], needed: Collection[str]) -> Iterator[Finding[N]]:
    """Yield what makes an answer impossible; k_r <= 0 is left to the caller."""
    for name in needed:
        value = values[name]
        wanted = _WORDS[name][1]
        yield Finding(value != value, name, value, f"is not a number: give {wanted}")
        if name == "p2":
            yield Finding(value <= 0.0, name, value, f"is not above zero: give {wanted}")
            low = (value > 0.0) & (value < _LOWEST_P2)
            yield Finding(low, name, value, f"is too small for any block: give {wanted}")
        elif name == "tm_s":
            yield Finding(value <= 0.0, name, value, f"is not above zero: give {wanted}")
            low = (value > 0.0) & (value < 1.0 / _HIGHEST)
            yield Finding(low, name, value, f"is too small for any earthquake: give {wanted}")
        elif name != "kr":
            yield Finding(value < 0.0, name, value, f"is negative: give {wanted}")
        large = (value > _HIGHEST) | (value == -math.inf)
        yield Finding(large, name, value, f"is beyond any block or earthquake: give {wanted}")


def unstable(values: Mapping[str, N]) -> Finding[N]:
    """Return whether the block falls at rest."""
    kr = values["kr"]
    return Finding(kr <= 0.0, "kr", kr, f"is not above zero: give {_WORDS['kr'][1]}")


def outside_domain(model: FragilityModel, values: Mapping[str, N]) -> Iterator[Finding[N]]:
    """Yield the variables that lie outside their fitted range."""
    for name, (low, high) in model.row.domain.items():
        if name not in values:
            continue
        value = values[name]
        unit = _WORDS[name][0]
        # A p² computed from a shape may miss the edge by rounding.
        below, above = value < low * (1.0 - 1e-9), value > high * (1.0 + 1e-9)
        for holds, edge in ((below, low), (above, high)):
            yield Finding(
                holds,
                name,
                value,
                f"is outside the fitted range {low:.4g} to {high:.4g} {unit} (nearest edge "
                f"{edge:.4g}): the answer is an extrapolation",
            )


def doubts(
    model: FragilityModel, values: Mapping[str, N], functions: Functions[N]
) -> Iterator[Finding[N]]:
    """Yield where the model stops making sense, and suspicious values."""
    x, y = values["intensity_m_s"], values["y_m_s"]
    if model.shape == LINE:
        outside = "outside the range where the straight-line normal model makes sense"
        share = straight_line.negative_share(model.parameters, x, functions)
        yield Finding(
            share > NEGATIVE_SHARE_LIMIT,
            "intensity_m_s",
            x,
            f"is {outside}: there it gives more than {100 * NEGATIVE_SHARE_LIMIT:g} % probability "
            "to negative critical velocities",
        )
        yield Finding(
            straight_line.rise(model.parameters, x, y) < 0.0,
            "y_m_s",
            y,
            f"is {outside}: there the probability falls with growing intensity",
        )
    for name, low, high, text in _SUSPECTS:
        if name in values:
            value = values[name]
            yield Finding((value < low) | (value > high), name, value, f"is {text}")


def not_lifted(model: FragilityModel, values: Mapping[str, N]) -> Finding[N] | None:
    """Return where PGA is known and does not lift the block: P is 0, whatever the model."""
    if "pga_g" not in values or model.vertical:
        return None
    kr = values["kr"]
    return Finding(
        kr >= values["pga_g"],
        "kr",
        kr,
        "is not below PGA: without vertical motion the ground cannot lift this block, P = 0 by "
        "mechanics, not by the model",
    )


BOUNDS = {
    NOT_LIFTED: (
        "kr",
        "is not below PGA: without vertical motion the ground cannot lift this block, P = 0 by "
        "mechanics, not by the model",
    ),
    ABOVE_TWICE_PGV: (
        "y_m_s",
        "is not below 2 PGV, which no fresh excursion exceeds: P = 0 by mechanics, not by the "
        "model",
    ),
    ABOVE_SPECTRUM: (
        "y_m_s",
        "is not below the toppling spectrum X(p) of the motion, which no fresh excursion exceeds: "
        "P = 0 by mechanics, not by the model",
    ),
}
"""What is said where :func:`rbfrag.fragility.formulas.bound` says that P is 0."""
