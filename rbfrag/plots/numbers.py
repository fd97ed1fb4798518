"""Numbers beside a logarithmic axis as people write them: 0.05, 0.1, 20."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axis import Axis


def plain_numbers(axis: Axis, *digits: float) -> None:
    """Put plain numbers beside a logarithmic axis.

    Args:
        axis: the axis.
        digits: leading digits that are written out, such as 1, 2 and 5.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=digits))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
