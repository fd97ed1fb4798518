"""What a horizontal intensity measure means: one component, or two made into one.

The models are fitted on single components. Ratios are medians of Beyer, K. & Bommer, J. J.
(2006): Relationships between median values and between aleatory variabilities for different
definitions of the horizontal component of motion. Bulletin of the Seismological Society of
America 96(4A), 1512-1522, table 2 (PGA and PGV).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rbfrag.errors import InputError


@dataclass(frozen=True)
class Component:
    """How a definition relates to a single component of unknown direction.

    Args:
        name: name in options.
        title: name for people.
        ratio: median of the definition over the median of a single component.
        scatter: standard deviation of ln(single component/definition).
    """

    name: str
    title: str
    ratio: float
    scatter: float


COMPONENTS: Mapping[str, Component] = {
    item.name: item
    for item in (
        Component("single", "a single component of any direction", 1.0, 0.0),
        # log10 scatters of a random component about the geometric mean, 0.07, and of the larger
        # one, 0.05, are taken as independent for the larger one
        Component("geometric_mean", "the geometric mean of two", 1.0, 0.07 * math.log(10.0)),
        Component("rotd50", "the median over all directions", 1.0, 0.07 * math.log(10.0)),
        Component("larger", "the larger of two", 1.1, math.hypot(0.07, 0.05) * math.log(10.0)),
    )
}
"""Definitions of the horizontal component by name."""


def component(name: str) -> Component:
    """Return the definition of that name.

    Raises:
        InputError: there is none.
    """
    try:
        return COMPONENTS[name]
    except KeyError:
        raise InputError(
            f"component {name!r} is not known: use one of {', '.join(COMPONENTS)}"
        ) from None
