"""What a fit reads from the critical values: which points count, and which are left out."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.rows import CombinationTable
from rbfrag.errors import FitError
from rbfrag.fragility.terms import Term
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]

FEWEST_EVENTS = 3
FEWEST_FOUND = 10

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
        pgv_m_s: peak ground velocity [m/s], shape (n,).
        p2: frequency parameter p² [1/s²], shape (n,).
        tm_s: mean period [s], NaN where not defined, shape (n,).
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
    pgv_m_s: FloatArray
    p2: FloatArray
    tm_s: FloatArray
    n_total: int
    n_excluded: int
    n_outside_model: int
    guessed_events: int
    fingerprint: str


def fit_data(table: CombinationTable, term: Term) -> FitData:
    """Select the points of a fit.

    Args:
        table: critical values as the database returns them.
        term: the intensity term.

    Raises:
        FitError: the data cannot carry the fit; the message says why and what to do.
    """
    n_total = int(table.p2.size)
    if n_total == 0:
        raise FitError(
            "no critical values to fit: add motions with  rbfrag motions add  and run  "
            "rbfrag simulate"
        )
    x = np.asarray(
        term.intensity_m_s({name: getattr(table, name) for name in term.inputs}), dtype=np.float64
    )
    is_found = table.status == "found"
    is_censored = np.isin(table.status.astype(str), _CENSORED)
    usable = np.isfinite(x)
    if not usable.any() and "tm_s" in term.inputs:
        raise FitError(
            f"the term {term.name} needs the mean period Tm, which none of the {n_total} "
            "combinations has: add the motions again with their samples, or fit --term pgv"
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
        pgv_m_s=table.pgv_m_s[chosen],
        p2=table.p2[chosen],
        tm_s=table.tm_s[chosen],
        n_total=n_total,
        n_excluded=int((is_found & ~usable).sum()),
        n_outside_model=int((table.status == "outside_model").sum()),
        guessed_events=len(set(table.event_id[chosen][table.event_guessed[chosen]].tolist())),
        fingerprint=_fingerprint(
            table.natural_key[chosen][found], x[chosen][found], y[chosen][found]
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
