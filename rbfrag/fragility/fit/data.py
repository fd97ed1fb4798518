"""What a fit reads from the critical values: which points count, and which are left out."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import FitError
from rbfrag.fragility.fit.scores import GRID_OF_Y0_OVER_PGV
from rbfrag.fragility.fit.source import FitSource
from rbfrag.fragility.measures import Term
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]

FEWEST_EVENTS = 3
FEWEST_FOUND = 10
FEW_EVENTS = 10

_CENSORED = ("below_limit", "no_motion")


@dataclass(frozen=True, eq=False)
class FitData:
    """Points of one fit, found and censored, with rising intensity.

    Args:
        x: intensity [m/s], shape (n,).
        y: critical toppling velocity [m/s]; for censored points the value it lies below.
        found: True for critical values that were found, False for censored ones.
        event: number of the point's earthquake, shape (n,).
        event_names: the earthquakes by that number.
        motion: number of the point's motion, shape (n,).
        pgv_m_s: peak ground velocity [m/s], shape (n,).
        pga_g: peak ground acceleration [g], shape (n,).
        p2: frequency parameter p² [1/s²], shape (n,).
        tm_s: mean period [s], NaN where not defined, shape (n,).
        topples: outcomes of the blocks of :attr:`y0_m_s`, shape (n, 25): 1 topples, 0 safe, NaN
            not known.
        n_total: number of combinations read.
        n_excluded: found combinations left out because the term is not defined.
        n_outside_model: combinations for which the block model does not apply.
        guessed_events: number of earthquakes read off file headers.
        fingerprint: hash of natural keys and fitted values.
    """

    x: FloatArray
    y: FloatArray
    found: NDArray[np.bool_]
    event: NDArray[np.intp]
    event_names: tuple[str, ...]
    motion: NDArray[np.int64]
    pgv_m_s: FloatArray
    pga_g: FloatArray
    p2: FloatArray
    tm_s: FloatArray
    topples: FloatArray
    n_total: int
    n_excluded: int
    n_outside_model: int
    guessed_events: int
    fingerprint: str

    @property
    def y0_m_s(self) -> FloatArray:
        """Toppling velocities of the blocks whose outcomes are known [m/s], shape (n, 25)."""
        return self.pgv_m_s[:, None] * GRID_OF_Y0_OVER_PGV

    @property
    def has_outcomes(self) -> bool:
        """Whether any outcome is known."""
        return bool(np.isfinite(self.topples).any())


def fit_data(source: FitSource, term: Term) -> FitData:
    """Select the points of a fit.

    Args:
        source: critical values, spectra and outcomes as the database returns them.
        term: the intensity term.

    Raises:
        FitError: the data cannot carry the fit; the message says why and what to do.
    """
    table = source.table
    n_total = int(table.p2.size)
    if n_total == 0:
        raise FitError(
            "no critical values to fit: add motions with  rbfrag motions add  and run  "
            "rbfrag simulate"
        )
    measures = {
        name: source.xp_m_s if name == "xp_m_s" else getattr(table, name) for name in term.inputs
    }
    x = np.asarray(term.intensity_m_s(measures), dtype=np.float64)
    for values in measures.values():
        x = np.where(np.isfinite(values), x, np.nan)
    is_found = table.status == "found"
    is_censored = np.isin(table.status.astype(str), _CENSORED)
    usable = np.isfinite(x)
    if not usable.any() and "tm_s" in term.inputs:
        raise FitError(
            f"the term {term.name} needs the mean period Tm, which none of the {n_total} "
            "combinations has: add the motions again with their samples, or fit --term pgv"
        )
    if not usable.any() and "xp_m_s" in term.inputs:
        raise FitError(
            "the term xp needs the toppling spectrum X(p), which is stored for none of the "
            f"{n_total} combinations: run  rbfrag simulate  again, which adds it"
        )
    limit = table.search_limit * table.pga_g * STANDARD_GRAVITY_M_S2 / np.sqrt(table.p2)
    y = np.where(is_found, table.y_m_s, limit)
    chosen = np.flatnonzero(usable & (is_found | is_censored))
    # A second key makes the order, and so every sum, independent of the order of the rows.
    keys = table.natural_key[chosen].astype(str)
    chosen = chosen[np.lexsort((keys, x[chosen]))]
    names, event = np.unique(table.event_id[chosen].astype(str), return_inverse=True)
    found = is_found[chosen]
    data = FitData(
        x=x[chosen],
        y=y[chosen],
        found=found,
        event=event.astype(np.intp),
        event_names=tuple(names.tolist()),
        motion=np.unique(table.motion_id[chosen], return_inverse=True)[1].astype(np.int64),
        pgv_m_s=table.pgv_m_s[chosen],
        pga_g=table.pga_g[chosen],
        p2=table.p2[chosen],
        tm_s=table.tm_s[chosen],
        topples=source.topples[chosen],
        n_total=n_total,
        n_excluded=int((is_found & ~usable).sum()),
        n_outside_model=int((table.status == "outside_model").sum()),
        guessed_events=len(set(table.event_id[chosen][table.event_guessed[chosen]].tolist())),
        fingerprint=_fingerprint(
            table.natural_key[chosen] + " " + table.event_id[chosen].astype(str).astype(object),
            x[chosen],
            np.where(found, y[chosen], 0.0),
        ),
    )
    _refuse_thin(data, term)
    return data


def _fingerprint(keys: NDArray[np.object_], x: FloatArray, y: FloatArray) -> str:
    lines = sorted(
        f"{key}\t{a.hex()}\t{b.hex()}\n"
        for key, a, b in zip(keys, x.tolist(), y.tolist(), strict=True)
    )
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def _refuse_thin(data: FitData, term: Term) -> None:
    n_found = int(data.found.sum())
    if n_found < FEWEST_FOUND:
        raise FitError(
            f"{n_found} critical values were found among {data.n_total} combinations with the "
            f"term {term.name}; a fit needs {FEWEST_FOUND}: simulate more motions or more p²"
        )
    events = np.unique(data.event[data.found]).size
    if events < FEWEST_EVENTS:
        raise FitError(
            f"the critical values come from {events} earthquake(s); a fit needs "
            f"{FEWEST_EVENTS}, because points of one earthquake are not independent: add "
            "motions of other earthquakes, and name the events by  motions add --metadata"
        )
    if not np.all(np.isfinite(data.y[data.found])):
        raise FitError("a critical value is not finite: run  rbfrag db check")
    if np.ptp(data.x[data.found]) == 0.0:
        raise FitError(
            f"all motions have the same {term.title}, {data.x[data.found][0]:.4g} m/s: a line "
            "needs motions of different strength"
        )
