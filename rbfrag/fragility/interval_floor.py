"""Why knowing less never gives a narrower interval.

The interval of a model says how well its parameters are known. A model of few measures has
few parameters, so that its interval may come out narrower than that of a model which knows
more of the motion, though the answer is vaguer. To keep the order, every model carries a
table of least widths, and its own intervals are never narrower.

The least width is the less of two, each of which is enough: the widest interval that any model
which knows more gives, at level 0.95, for a block and a motion at which the model itself has that
eta; and the widest one for a block of that y/2x, with PGV the same for all models that know it.
Either alone would add up from model to model: the second does not, because what a model takes
over from a better one at some y/2x the next one compares at the same y/2x.

With few earthquakes the widest is noise: a richer model that is hardly determined may know
nothing at all of some block, which says little of the others. The tables then hold what nine in
ten of the intervals do not exceed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.fit.data import FitSource
from rbfrag.fragility.methods import arrays
from rbfrag.fragility.model import (
    FLOOR_FROM,
    FLOOR_NODES,
    FLOOR_SHARE_STEP,
    FLOOR_STEP,
    FragilityModel,
    student_half_width,
)
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]

LEVEL = 0.95
MARGIN = 1.05
"""For what lies between the sampled points."""

FEW_EARTHQUAKES = 30
SHARE_OF_FEW = 0.9
"""Share of blocks and motions with the same eta for which the interval is no narrower, if the fit
has fewer earthquakes than that; all of them otherwise."""

_ROUNDING = np.array([0.06, 0.24, 0.4, 0.24, 0.06])
"""Weights of a node and its neighbours, a bell of standard deviation one node."""

_BLOCKS = np.geomspace(0.02, 2.0, 60)


@dataclass(frozen=True, eq=False)
class Sample:
    """Blocks and motions at which intervals are compared, arrays of shape (n,).

    Args:
        y: toppling velocities of the blocks [m/s].
        p: their frequency parameters [1/s].
        pga_g: PGA [g].
        tm_s: Tm [s].
        intensity_m_s: intensity of each term [m/s] by its name.
    """

    y: FloatArray
    p: FloatArray
    pga_g: FloatArray
    tm_s: FloatArray
    intensity_m_s: dict[str, FloatArray]


def of_motions(source: FitSource) -> Sample:
    """Return 60 blocks for every fitted motion, polarity and p² that has a spectrum."""
    table = source.table
    usable = np.isfinite(source.xp_m_s) & np.isfinite(table.tm_s) & (table.pgv_m_s > 0.0)
    usable &= source.xp_m_s > 0.0

    def each(column: FloatArray) -> FloatArray:
        return np.repeat(column[usable], _BLOCKS.size)

    pgv, pga, tm = each(table.pgv_m_s), each(table.pga_g), each(table.tm_s)
    y = (table.pgv_m_s[usable][:, None] * _BLOCKS).ravel()
    intensity = _intensities(pgv, pga, tm)
    intensity["pgd_tm"] = each(table.pgd_m) * 2.0 * math.pi / tm
    intensity["xp"] = each(source.xp_m_s)
    return Sample(y, np.sqrt(each(table.p2)), pga, tm, intensity)


def of_sizes(source: FitSource, *, seed: int = 0) -> Sample:
    """Return blocks of any p² in the fitted range for every motion that has a mean period."""
    table = source.table
    random = np.random.default_rng(seed)
    usable = np.isfinite(table.tm_s) & (table.pgv_m_s > 0.0) & (table.pga_g > 0.0)
    each = _BLOCKS.size
    numbers = np.repeat(np.flatnonzero(usable), each)
    ends = 0.5 * np.log([table.p2.min(), table.p2.max()])
    p = np.exp(random.uniform(ends[0], ends[1], numbers.size))
    own = np.arange(numbers.size) % 2 == 0  # half the blocks at the sizes that were fitted
    p[own] = np.sqrt(table.p2[numbers[own]])
    pgv, pga, tm = table.pgv_m_s[numbers], table.pga_g[numbers], table.tm_s[numbers]
    y = pgv * np.exp(random.uniform(np.log(_BLOCKS[0]), np.log(_BLOCKS[-1]), numbers.size))
    return Sample(y, p, pga, tm, _intensities(pgv, pga, tm))


def _intensities(pgv: FloatArray, pga: FloatArray, tm: FloatArray) -> dict[str, FloatArray]:
    return {
        "pgv": pgv,
        "pgv_pga": pgv,
        "pgv_pga_tm": pgv,
        "pga_tm": pga * STANDARD_GRAVITY_M_S2 * tm / (2.0 * math.pi),
    }


def interval_floor(
    model: FragilityModel, richer: Sequence[FragilityModel], sample: Sample
) -> list[float]:
    """Return the least widths of the model's interval over its quantile, at all nodes.

    With fewer than `FEW_EARTHQUAKES` it is the `SHARE_OF_FEW` quantile of a cell's widths.

    Args:
        model: the model that knows less.
        richer: models that know more, with their own tables.
        sample: where they are compared.
    """
    if not richer:
        return []
    widest = np.zeros(sample.y.size)
    values, possible = _values(model, sample)
    x, ns = sample.intensity_m_s[model.term.name], arrays()
    with np.errstate(all="ignore"):
        eta = np.where(possible, model.form.eta(model.parameters, values, ns).eta, np.nan)
    # what a width is multiplied by when this model answers, which has degrees of freedom of its own
    reach = student_half_width(LEVEL, model.degrees_of_freedom)
    for other in richer:
        half_width = student_half_width(LEVEL, other.degrees_of_freedom)
        values, possible = _values(other, sample)
        with np.errstate(all="ignore"):
            _, low, high, _ = other.answer(values, half_width, ns)
            width = np.where(possible, high - low, 0.0)
        is_known = np.isfinite(sample.intensity_m_s[other.term.name])
        widest = np.where(is_known, np.fmax(widest, width / reach), widest)
    few = min(_earthquakes(other) for other in richer) < FEW_EARTHQUAKES
    share = SHARE_OF_FEW if few else 1.0
    # eta of an intensity that is not known is a number like any other
    known = np.isfinite(eta) & np.isfinite(x)
    by_y = sample.y[known] / (2.0 * x[known])
    places = (
        (eta[known] - FLOOR_FROM) / FLOOR_STEP,
        by_y / FLOOR_SHARE_STEP,
    )
    widest = widest[known] * MARGIN
    return [value for place in places for value in _table(place, widest, share)]


def _values(
    model: FragilityModel, sample: Sample
) -> tuple[dict[str, FloatArray], NDArray[np.bool_]]:
    """Return what the model reads, and where mechanics leaves it the answer."""
    values = {
        "y_m_s": sample.y,
        "p": sample.p,
        "kr": sample.y * sample.p / STANDARD_GRAVITY_M_S2,
        "pga_g": sample.pga_g,
        "tm_s": sample.tm_s,
        "intensity_m_s": sample.intensity_m_s[model.term.name],
    }
    possible = np.ones(sample.y.size, dtype=np.bool_)
    for bound in model.form.bounds:
        possible &= ~bound.holds(values)
    return values, possible


def _earthquakes(model: FragilityModel) -> int:
    events = model.row.diagnostics.get("events")
    return events if isinstance(events, int) else model.degrees_of_freedom + 1


def _table(place: FloatArray, width: FloatArray, share: float) -> list[float]:
    """Return widths at the nodes such that the lines between them are below none of a cell.

    Args:
        place: where each interval is, in nodes from the first.
        width: its width.
        share: quantile of a cell's widths that stands for it.
    """
    cell = np.clip(np.floor(place), 0, FLOOR_NODES - 2).astype(np.int64)
    nodes = np.zeros(FLOOR_NODES)
    for each in np.unique(cell).tolist():
        own = np.quantile(width[cell == each], share)
        nodes[each : each + 2] = np.maximum(nodes[each : each + 2], own)
    # Rounded off upwards, or bands would show the cells.
    around = np.pad(nodes, 3, mode="edge")
    highest = np.maximum(np.maximum(around[:-2], around[1:-1]), around[2:])
    smooth = np.convolve(highest, _ROUNDING, mode="valid")
    return [float(value) for value in np.maximum(nodes, smooth)]
