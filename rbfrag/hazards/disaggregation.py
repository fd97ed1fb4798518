"""Hazard curves of PGV from curves of PGA and their disaggregation by magnitude."""

from __future__ import annotations

import math
import os
import re
from dataclasses import dataclass, replace
from typing import Unpack

import numpy as np

from rbfrag.errors import InputError
from rbfrag.files import csv_rows, number_at, source_text
from rbfrag.hazards.curve import CurveKeywords, HazardCurve
from rbfrag.hazards.rate_density import STEP, Grid, smoothing_of, under
from rbfrag.hazards.shaking import HazardLevel, component_of, component_of_velocity, velocity_of
from rbfrag.question.components import SINGLE_COMPONENT, component_named
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import annual_rate
from rbfrag.solver.results import FloatArray

_VALUE = re.compile(r"mean|rlz\d+")
_PLACE = re.compile(r"\b(lon|lat)=([-+.\de]+)")
_SAME_PLACE = 0.01
"""Degrees that a curve and its disaggregation may lie apart."""

_EVERY = 16
"""Steps of the grid between two levels of the curve of PGV."""

_RAREST = 1e-15
"""Rate over the greatest one from which on the curve of PGV ends."""


@dataclass(frozen=True, eq=False)
class Disaggregation:
    """Disaggregation by magnitude of the rates of exceedance of PGA at one site.

    Args:
        levels: PGA [g], rising, shape (n,).
        magnitude: the middle of each bin, shape (k,).
        share: of each magnitude in the rate of exceedance, which sum to 1, shape (n, k).
        lon: longitude of the site [deg], or None.
        lat: latitude of the site [deg], or None.
        source: the file, for messages.
    """

    levels: FloatArray
    magnitude: FloatArray
    share: FloatArray
    lon: float | None
    lat: float | None
    source: str

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Disaggregation:
        """Read the disaggregation of PGA from an OpenQuake file: Mag-*.csv or Mag_Dist-*.csv.

        Beside imt, iml and mag it has a column ``mean`` or that of one realization, probabilities
        of exceedance by the earthquakes of one bin; what else they are divided by is summed.

        Raises:
            InputError: a file without these columns or without PGA, or a line that is no such row.
        """
        rows = csv_rows(source_text(path, "a disaggregation"), path)
        head = ",".join(next(rows, (0, []))[1])
        names = [name.strip() for name in next(rows, (0, []))[1]]
        values = [name for name in names if _VALUE.fullmatch(name)]
        if not {"imt", "iml", "mag"} <= {*names} or len(values) != 1:
            raise InputError(
                f"{path}: a disaggregation by magnitude has the columns imt, iml, mag, and mean or "
                "one realization: export disagg-stats of OpenQuake, with Mag among disagg_outputs"
            )
        sums: dict[float, dict[float, float]] = {}
        totals: dict[float, float] = {}
        for line, cells in rows:
            row, where = dict(zip(names, cells, strict=False)), f"{path}, line {line}"
            if row.get("imt") != "PGA":
                continue
            level, magnitude, poe = (
                number_at(row.get(name, ""), where) for name in ("iml", "mag", *values)
            )
            if not (0.0 <= poe < 1.0 and 0.0 <= level < np.inf and 0.0 < magnitude < 11.0):
                raise InputError(
                    f"{where}: iml {level:g}, mag {magnitude:g}, {poe:g}: a level, a magnitude "
                    "and a probability below 1 are required"
                )
            of = sums.setdefault(level, {})
            of[magnitude] = of.get(magnitude, 0.0) - math.log1p(-poe)
            totals[level] = totals.get(level, 0.0) + poe
        # Contributions of magnitude bins are independent: their exceedance rates -ln(1 - poe) add
        # up, the probabilities do not. Only fractions of the level's rate are kept.
        levels = sorted(x for x, rates in sums.items() if x > 0.0 and any(rates.values()))
        if not levels:
            raise InputError(f"{path}: it has no disaggregation of PGA")
        if all(abs(totals[level] - 1.0) < 1e-3 for level in levels):
            raise InputError(
                f"{path}: the values of each level sum to 1, not probabilities of exceedance: "
                "export disagg-stats or disagg-rlzs, not the traditional one"
            )
        bins = sorted({m for rates in sums.values() for m in rates})
        rate = np.array([[sums[x].get(m, 0.0) for m in bins] for x in levels])
        place = {name: number_at(text, f"{path}, line 1") for name, text in _PLACE.findall(head)}
        share = rate / rate.sum(axis=1, keepdims=True)
        return cls(
            np.array(levels), np.array(bins), share, place.get("lon"), place.get("lat"), str(path),
        )  # fmt: skip

    def shares(self, u: FloatArray) -> FloatArray:
        """Return the fraction of each magnitude in the exceedance of exp(u) [g], k x u.

        Between levels linear in ln PGA; beyond them that of the last one.
        """
        return np.stack([np.interp(u, np.log(self.levels), fraction) for fraction in self.share.T])

    def velocity_curve(self, curve: HazardCurve, **meaning: Unpack[CurveKeywords]) -> HazardCurve:
        """Return the curve of single-component PGV that corresponds to a curve of PGA.

        The rate λ s_M of each magnitude falls with the PGA; the mass that it loses at a PGA goes to
        the PGV of the law (:func:`rbfrag.hazards.shaking.velocity_of`), with its scatter.
        PGA beyond the last level of its curve counts as that level.

        Args:
            curve: of PGA at the site of the disaggregation.
            meaning: as for :func:`rbfrag.hazard`; what it says of the component is in the result.

        Raises:
            InputError: a curve of another measure or site, or a conversion of it.
        """
        if curve.measure != "pga_g" or meaning.get("convert") is not None:
            raise InputError(
                f"{curve.source}: disaggregation = {self.source} converts PGA to PGV, but the "
                f"curve is of {curve.imt}: omit it, or convert",
                fields=("disaggregation", "convert"),
            )
        for axis, coordinate, other in (("lon", self.lon, curve.lon), ("lat", self.lat, curve.lat)):
            if (
                coordinate is not None
                and other is not None
                and abs(coordinate - other) > _SAME_PLACE
            ):
                raise InputError(
                    f"{self.source}: the disaggregation is of {axis} {coordinate:g}, the curve of "
                    f"{other:g}: choose the site that it is of",
                    fields=("site",),
                )
        name = meaning.get("component")
        component = component_of(curve, name) or component_named(SINGLE_COMPONENT)
        shaking = HazardLevel.about("pgv_m_s", component_of_velocity(component))
        # The rate of PGA above u from magnitude M is λ(u) s_M(u). What it loses between two nodes
        # is mass at that PGA and M, moved to the PGV that both predict.
        end = curve.levels[-1] if curve.end_level is None else curve.end_level
        grid = Grid.over(STEP, float(np.log(curve.levels[0])), float(np.log(end)))
        above = np.append(under([curve], grid)[0][::-1].cumsum()[::-1], 0.0)
        of_each = self.shares(np.append(grid.u, grid.u[-1] + STEP) - 0.5 * STEP) * above
        velocity = np.log(velocity_of(np.exp(grid.u), self.magnitude[:, None]) * shaking.median)
        step, smoothing = smoothing_of(shaking)
        onto = Grid.over(step, velocity.min(), velocity.max(), smoothing.reach)
        mass = smoothing.of(onto.spread(velocity.ravel()) @ -np.diff(of_each).ravel())
        rate = np.maximum.accumulate(mass[::-1].cumsum())[::-1]
        nodes = np.flatnonzero(rate > _RAREST * rate[0])[_EVERY // 2 :: _EVERY]
        texts = [
            *HazardLevel.of(curve, component=name).warnings,
            Diagnostic(
                "PGV is predicted from PGA and the magnitudes of its disaggregation; a hazard "
                "curve of PGV is better",
                "pgv_from_pga",
            ),
        ]
        if curve.end_level is None:
            texts.append(
                Diagnostic(
                    f"the hazard curve ends at PGA = {end:g} g, exceeded at "
                    f"{annual_rate(curve.annual_rate[-1])} /yr: stronger shaking counts as that "
                    "level (unconservative)",
                    "curve_ends",
                )
            )
        return replace(
            curve, measure="pgv_m_s", levels=np.exp(onto.u[nodes] - 0.5 * step), end_level=None,
            annual_rate=rate[nodes], warnings=tuple(texts),
            magnitudes_from_g=float(max(self.levels[0], curve.levels[0])),
        )  # fmt: skip
