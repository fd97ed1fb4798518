"""Why knowing less never gives a narrower interval.

The interval of a model says how well its parameters are known. A model of few measures has
few parameters, so that its interval may come out narrower than that of a model which knows
more of the motion, though the answer is vaguer. To keep the order, every model carries a
table: the widest interval that any model which knows more gives, at level 0.95, for a block
and a motion at which the model itself has that eta. Its own intervals are never narrower.

With few earthquakes the widest is noise: a richer model that is hardly determined may know
nothing at all of some block, which says little of the others. The table then holds what nine in
ten of the intervals do not exceed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility import formulas
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.quantiles import student_half_width
from rbfrag.fragility.source import FitSource
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]

LEVEL = 0.95
MARGIN = 1.05
"""For what lies between the sampled points."""

FEW_EARTHQUAKES = 30
SHARE_OF_FEW = 0.9
"""Share of blocks and motions with the same eta for which the interval is no narrower, if the fit
has fewer earthquakes than that; all of them otherwise."""

RICHER = {
    "pgv": ("pgv_pga", "pgv_pga_tm"),
    "pga_tm": ("pgv_pga_tm",),
    "pgd_tm": ("xp",),
    "pgv_pga": ("pgv_pga_tm",),
    "pgv_pga_tm": ("xp",),
    "xp": (),
}
"""The terms of the models that know more than one of each term, directly or by their table."""

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
    """Return the least width of the model's interval over its quantile, at each node of eta.

    With fewer than `FEW_EARTHQUAKES` it is the `SHARE_OF_FEW` quantile of a cell's widths.

    Args:
        model: the model that knows less.
        richer: models that know more, with their own tables.
        sample: where they are compared.
    """
    from rbfrag.fragility.compiled_formulas import answers, etas

    if not richer:
        return []
    eta, widest = np.empty(sample.y.size), np.zeros(sample.y.size)
    etas(
        model.shape,
        np.array(model.padded),
        sample.y,
        sample.p,
        sample.intensity_m_s[model.term.name],
        sample.pga_g,
        sample.tm_s,
        eta,
    )
    for other in richer:
        middle, low, high = np.empty((3, sample.y.size))
        half_width = student_half_width(LEVEL, other.degrees_of_freedom)
        answers(
            other.shape,
            other.link,
            np.array(other.padded),
            np.array(other.packed_covariance),
            np.array(other.floor),
            half_width,
            sample.y,
            sample.p,
            sample.intensity_m_s[other.term.name],
            sample.pga_g,
            sample.tm_s,
            middle,
            low,
            high,
        )
        widest = np.fmax(widest, (high - low) / half_width)
    few = min(other.degrees_of_freedom for other in richer) < FEW_EARTHQUAKES - 1
    return _table(eta, widest * MARGIN, SHARE_OF_FEW if few else 1.0)


def _table(eta: FloatArray, width: FloatArray, share: float) -> list[float]:
    known = np.isfinite(eta)
    cell = np.floor((eta[known] - formulas.FLOOR_FROM) / formulas.FLOOR_STEP).astype(np.int64)
    cell = np.clip(cell, -1, formulas.FLOOR_NODES - 1) + 1  # the first and last have no end
    order = np.argsort(cell, kind="stable")
    cell, width = cell[order], width[known][order]
    cells = np.arange(formulas.FLOOR_NODES + 1)
    starts, ends = np.searchsorted(cell, cells), np.searchsorted(cell, cells, side="right")
    by_cell = np.zeros(cells.size)
    for i, (start, end) in enumerate(zip(starts.tolist(), ends.tolist(), strict=True)):
        if end > start:
            by_cell[i] = np.quantile(width[start:end], share)
    # A line between nodes is nowhere below a cell whose two ends are not.
    return [float(each) for each in np.maximum(by_cell[:-1], by_cell[1:])]
