"""Data of a fit: critical values and outcomes of one kind, as rows.

The same three steps serve every kind: the database's columns are a :class:`FitSource`; what
describes the block says how they become the points at which blocks just fail and the grid of blocks
whose outcome is known; both are a :class:`FitData`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.db.rows import IMPORTED, CombinationTable, Selection
from rbfrag.errors import FitError
from rbfrag.fragility.domain import INSIDE, ratios_of
from rbfrag.fragility.fit.completions import (
    MotionTable,
    ordinates_by_motion,
    spectral_velocities,
)
from rbfrag.fragility.measures import Term
from rbfrag.fragility.method import TOPPLING_BLOCK, BlockParameters, Method, arrays
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.numbers import exact_percent
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import INTENSITY, MEASURES, QUANTITIES
from rbfrag.vocabulary.spectral import spectral_names

if TYPE_CHECKING:
    from sqlalchemy import Connection


FEWEST_EVENTS = 3
FEWEST_OBSERVED = 10

KR = (0.02, 1.0)
"""k_r, or k_y, of the weakest and the strongest block that fits read: no rock stands at 1°."""

REAL_KR = 0.05
"""Scores are also stated of the blocks from this k_r on, as most rock blocks are."""

Y0_OVER_PGV = np.geomspace(0.1, 4.0, 25)
"""The grid of blocks that fits are judged on, as y0/PGV, from `KR[0]` on. They also read the weaker
ones that are stored, and safe ones above, nearly all of which are decided where PGV is known."""

LEAST_DISPLACEMENT_M = 1e-3
"""Displacements below this count as less than it, whether zero or not: their scatter is another."""

NARROW = 0.02
"""Greatest (upper - lower)/lower of a critical value that counts as found, certified or not."""

CERTIFIED = 1e-6
"""The same of models that do not state it: those that were fitted to certified values alone."""

_CENSORED = ("below_limit", "no_motion")


@dataclass(frozen=True, eq=False)
class ScoredBlocks:
    """The blocks on which a fit is scored.

    Args:
        failed: 0 or 1, shape (n, m).
        is_known: where the outcome is known.
        event: number of each row's earthquake, shape (n,).
        source: where the outcomes come from.
    """

    failed: FloatArray
    is_known: NDArray[np.bool_]
    event: NDArray[np.intp]
    source: str


def critical_outcomes(
    critical: FloatArray, observed: NDArray[np.bool_], strength: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the outcomes that follow from critical values, 0 or 1, and where they are known.

    Args:
        critical: critical strength, for censored points the value it lies below, shape (n,).
        observed: False for censored points, shape (n,).
        strength: of the blocks, shape (n, m).
    """
    reached = critical[:, None] >= strength
    is_known = (observed[:, None] | ~reached) & (strength > 0.0)
    return (reached & observed[:, None]).astype(np.float64), is_known


@dataclass(frozen=True, eq=False)
class FitSource:
    """Combinations of block and motion with all data for fitting, columns of equal length.

    Args:
        xp_m_s: toppling spectrum at each combination's p² and polarity [m/s], shape (n,); NaN
            where it is not stored.
        k_over_pga: strengths of the blocks of the outcome grid, shape (n, m).
        failed: what they do, same shape: 1 fails, 0 does not, NaN not known.
        displacement_m: how far they slide [m], same shape; None where they do not.
        recording: number of the recording that each combination's motion is of, shape (n,); None
            where that is not known.
        sensitive: whether outcomes of the grid are other ones for the motion times 1 ± 1e-6, shape
            (n, m), NaN where that is not stored; None where it is of none.
        of_block: what is stored of the blocks in addition to their size, by name, shape (n,).
        spectra: ordinates of each motion [g] at `SPECTRUM_PERIODS_S`, shape (n, 21), NaN where they
            are not stored; None where none is.
        structures: number of motions that are excluded, recorded on structures.
        narrow: greatest (upper - lower)/lower of a critical value that counts as found.
    """

    table: CombinationTable
    xp_m_s: FloatArray
    k_over_pga: FloatArray
    failed: FloatArray
    displacement_m: FloatArray | None = None
    recording: NDArray[np.int64] | None = None
    sensitive: FloatArray | None = None
    of_block: Mapping[str, FloatArray] = field(default_factory=dict)
    spectra: FloatArray | None = None
    structures: int = 0
    narrow: float = NARROW

    @classmethod
    def of_table(cls, table: CombinationTable) -> FitSource:
        """Return a source of critical values alone."""
        k = kr_over_pga_of_grid(table.p2, table.pgv_m_s, table.pga_g)
        return cls(table, np.full(table.p2.size, np.nan), k, np.full(k.shape, np.nan))

    def only(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> FitSource:
        """Return a subset of the combinations."""
        columns: dict[str, Any] = {f.name: getattr(self, f.name) for f in fields(self)}
        for name in ("table", "of_block", "structures", "narrow"):
            del columns[name]
        return replace(
            self,
            table=self.table.only(chosen),
            of_block={name: v[chosen] for name, v in self.of_block.items()},
            **{name: v[chosen] for name, v in columns.items() if v is not None},
        )

    def judged_outcomes(
        self, strength: FloatArray, critical: FloatArray, least: FloatArray
    ) -> tuple[FloatArray, str]:
        """Return the outcomes of blocks, 1, 0 or NaN, and a description of their source.

        Args:
            strength: of the blocks, shape (n, m).
            critical: critical strength, for censored combinations its upper limit, shape (n,).
            least: of those with a lower limit that one, NaN of others, shape (n,).
        """
        if np.isfinite(self.failed).any():
            return self.failed, "simulated outcomes"
        observed = (self.table.status == "found") & np.isnan(least)
        failed, is_known = critical_outcomes(critical, observed, strength)
        failed = np.where(strength <= least[:, None], 1.0, np.where(is_known, failed, np.nan))
        return failed, "critical values (safe islands are not seen)"


def kr_over_pga_of_grid(p2: ArrayLike, pgv_m_s: ArrayLike, pga_g: ArrayLike) -> FloatArray:
    """Return k_r/PGA of the blocks of `Y0_OVER_PGV`, shape (n, 25); not finite where PGA is 0.

    Args:
        p2: frequency parameter p² [1/s²], shape (n,).
        pgv_m_s: PGV [m/s], shape (n,).
        pga_g: PGA [g], shape (n,).
    """
    pgv, pga_m_s2 = np.asarray(pgv_m_s), np.asarray(pga_g) * STANDARD_GRAVITY_M_S2
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.sqrt(np.asarray(p2)) * pgv / pga_m_s2
    return np.asarray(z[..., None] * Y0_OVER_PGV)


def motions_of(source: FitSource, block: BlockParameters, events: Sequence[str]) -> MotionTable:
    """Return the motions with response spectra that complete a spectral velocity.

    Args:
        block: what describes the blocks of the fit.
        events: names of the earthquakes of the fit, in the order of its steps.
    """
    table, recording = source.table, source.recording
    kr = kr_over_pga_of_grid(table.p2, table.pgv_m_s, table.pga_g) * table.pga_g[:, None]
    is_judged = (kr >= KR[0]).any(axis=1)
    chosen = np.flatnonzero(is_judged | (block.completed_from == "all"))
    if source.spectra is None or recording is None:
        raise FitError("the motions have no recordings or no response spectra: add them again")
    return MotionTable.of(table.only(chosen), source.spectra[chosen], recording[chosen], events)


def read_source(
    connection: Connection,
    block: BlockParameters = TOPPLING_BLOCK,
    *,
    kind: str | None = None,
    **selection: Unpack[Selection],
) -> FitSource:
    """Read critical values, spectra and outcomes of one kind from the database.

    Args:
        block: what describes the kind's block.
        kind: response kind; None for the one that `block` stands for.
    """
    from rbfrag.db import queries
    from rbfrag.db.campaigns import spectrum_values
    from rbfrag.db.motion_spectra import stored_spectra

    kind_read = kind or block.kind
    table = queries.combination_table(connection, kind=kind_read, **selection)
    spectra = {}
    for version in np.unique(table.numerics_version.astype(str)).tolist():
        spectra = spectrum_values(connection, numerics_version=version)
    all_sensors = selection.get("include_structures")
    keys = zip(table.motion_id.tolist(), table.polarity, table.p2.tolist(), strict=True)
    grid = queries.outcome_grid(connection, table.combination_id)
    recordings = queries.recordings_of_motions(connection)
    source = FitSource(
        table,
        np.array([spectra.get(key, np.nan) for key in keys], dtype=np.float64),
        grid.k_over_pga,
        grid.outcome,
        grid.displacement_m,
        np.array([recordings[motion] for motion in table.motion_id.tolist()], dtype=np.int64),
        grid.sensitive if np.isfinite(grid.sensitive).any() else None,
        {name: _numbers_of(table.block, name) for name in block.stored},
        ordinates_by_motion(stored_spectra(connection), table.motion_id),
        0 if all_sensors else queries.motions_on_structures(connection, kind_read),
    )
    if grid.outcome.shape[1] == 0 and block.points == "strengths":
        none = FitSource.of_table(table)
        return replace(source, k_over_pga=none.k_over_pga, failed=none.failed, displacement_m=None)
    return source


def _numbers_of(blocks: Iterable[str | None], name: str) -> FloatArray:
    """Return a number that each stored block has in addition to its size."""
    values = [json.loads(block or "{}").get(name) for block in blocks]
    for block, value in zip(blocks, values, strict=True):
        if not isinstance(value, int | float):
            raise FitError(f"a stored block {block} has no {name}: run  rbfrag db check")
    return np.array(values, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class FitData:
    """Rows of one fit: the points at which blocks just fail, and the blocks of the outcome grid.

    Args:
        values: what formulas read at the point of failure, by name, shape (n,): measures of the
            shaking, the block's parameters, the intensity. For censored rows at the limit beyond
            which the block fails; NaN where nothing was searched.
        observed: False for censored rows.
        event: number of the earthquake, shape (n,).
        event_names: the earthquakes by that number.
        motion: number of the motion, shape (n,).
        polarity: +1 forward, -1 reverse, shape (n,).
        recording: number of the motion's recording, shape (n,); None where that is not known.
        combination: which row of the source it is, shape (n,): the rows of a fit are sorted by its
            intensity, so that those of two fits belong together by this alone.
        blocks: what formulas read of the blocks of the grid, shape (n, m) or (n, 1).
        failed: what they do: 1 fails, 0 does not, NaN not known, shape (n, m).
        read: which of them this fit reads, same shape.
        scored: those of them that it is judged on, same shape.
        outcomes: where the outcomes come from, in words.
        domain: range of each variable that the fit covers.
        n_excluded: combinations left out because a measure that the term reads is not known.
        n_outside_model: combinations for which the block model does not apply.
        guessed_events: number of earthquakes read off file headers.
        fingerprint: hash of natural keys and fitted values.
        sensitive: whether the outcomes are sensitive to the motion's last digits, shape (n, m);
            None where that is stored of none.
        least_y_m_s: of censored rows whose critical value lies between two ends the lower one
            [m/s], NaN of others, shape (n,); None where there is no such row.
    """

    kind: str
    values: dict[str, FloatArray]
    observed: NDArray[np.bool_]
    event: NDArray[np.intp]
    event_names: tuple[str, ...]
    motion: NDArray[np.int64]
    polarity: FloatArray
    recording: NDArray[np.int64] | None
    combination: NDArray[np.intp]
    blocks: dict[str, FloatArray]
    failed: FloatArray
    read: NDArray[np.bool_]
    scored: NDArray[np.bool_]
    outcomes: str
    domain: dict[str, tuple[float, float]]
    n_total: int = 0
    n_excluded: int = 0
    n_outside_model: int = 0
    guessed_events: int = 0
    fingerprint: str = ""
    sensitive: FloatArray | None = None
    least_y_m_s: FloatArray | None = None

    @property
    def x(self) -> FloatArray:
        """Intensity [m/s], shape (n,)."""
        return self.values["intensity_m_s"]

    @property
    def y(self) -> FloatArray:
        """Critical toppling velocity [m/s]; for censored points its upper bound."""
        return self.values["y_m_s"]

    @property
    def censored(self) -> NDArray[np.bool_]:
        """Rows with an upper bound only, shape (n,)."""
        return np.asarray(~self.observed & np.isfinite(self.values.get("y_m_s", self.x)))

    def between_words(self, treated: str) -> list[str]:
        """Describe how many critical values are wide intervals, and their treatment."""
        if self.least_y_m_s is None or not (n := int(np.isfinite(self.least_y_m_s).sum())):
            return []
        return [
            f"{n} critical values are not certified and are intervals wider than "
            f"{exact_percent(NARROW)} of their lower end; they {treated}"
        ]

    @property
    def events(self) -> int:
        """Number of earthquakes."""
        return len(self.event_names)

    @property
    def judged(self) -> ScoredBlocks:
        """Blocks on which the fit is scored."""
        is_known = np.isfinite(self.failed) & self.scored
        failed = np.where(is_known, self.failed, 0.0)
        return ScoredBlocks(failed, is_known, self.event, self.outcomes)

    @property
    def judged_real(self) -> ScoredBlocks | None:
        """Scored blocks with k_r of at least `REAL_KR`; None for blocks without k_r."""
        if "kr" not in self.blocks:
            return None
        judged = self.judged
        return replace(judged, is_known=judged.is_known & (self.grid("kr") >= REAL_KR))

    def grid(self, name: str) -> FloatArray:
        """Return a variable of the blocks of the grid, shape (n, m)."""
        return np.asarray(np.broadcast_to(self.blocks[name], self.failed.shape))


@dataclass(frozen=True, eq=False)
class _Points:
    """Points and outcome grid before rows are selected."""

    values: dict[str, FloatArray]
    observed: NDArray[np.bool_]
    is_valid: NDArray[np.bool_]
    combination: NDArray[np.intp]
    order: FloatArray
    blocks: dict[str, FloatArray]
    failed: FloatArray
    read: NDArray[np.bool_]
    outcomes: str
    ranges: dict[str, FloatArray]
    scored: NDArray[np.bool_] | None = None
    sensitive: FloatArray | None = None
    least_y_m_s: FloatArray | None = None
    undefined: int = 0


def fit_data(source: FitSource, method: Method, term: Term, *, kind: str | None = None) -> FitData:
    """Select the rows of a fit.

    Args:
        source: critical values, spectra and outcomes as the database returns them.
        kind: response kind; None for the one that the method's block stands for.

    Raises:
        FitError: the data cannot carry the fit; the message says why and what to do.
    """
    # A row is one combination with its measures, its critical value (found, censored or an
    # interval) and the outcomes of the blocks of its grid.
    table, named = source.table, kind or method.block.kind
    if table.p2.size == 0:
        raise FitError(
            "no critical values to fit: add motions by rbfrag motions add, and simulate them by "
            f"rbfrag simulate, of kind {named}"
        )
    of_outcomes = method.reads == "outcomes"
    # what cannot be simulated is judged by its critical values
    imported = method.block.points == "strengths" and IMPORTED in table.numerics_version
    if of_outcomes and not imported and not np.isfinite(source.failed).any():
        raise FitError(
            f"method {method.name} requires outcomes, and none are stored: simulate kind {named} "
            "again, which adds those of the grid, or fit critical values, by method wls or "
            "lognormal"
        )
    points = _READERS[method.block.points](source, method, term)
    combination = points.combination
    keys = table.natural_key[combination].astype(str)
    # further keys make the order, and so every sum, independent of the order of the rows
    order = np.lexsort((points.order, keys, points.values["intensity_m_s"]))
    chosen = order[points.is_valid[order]]
    combination = combination[chosen]
    # Rows that share an earthquake are one cluster, whatever the number of records.
    names, event = np.unique(table.event_id[combination].astype(str), return_inverse=True)
    observed = points.observed[chosen]
    values = {name: np.ascontiguousarray(v[chosen]) for name, v in points.values.items()}
    failed = np.ascontiguousarray(points.failed[chosen])
    least = None if points.least_y_m_s is None else points.least_y_m_s[chosen]
    data = FitData(
        kind=named,
        values=values,
        observed=observed,
        event=event.astype(np.intp),
        event_names=tuple(names.tolist()),
        motion=np.unique(table.motion_id[combination], return_inverse=True)[1].astype(np.int64),
        polarity=np.where(table.polarity[combination] == "forward", 1.0, -1.0),
        recording=None if source.recording is None else source.recording[combination],
        combination=combination,
        blocks={name: v[chosen] for name, v in points.blocks.items()},
        failed=failed,
        read=points.read[chosen],
        scored=points.scored[chosen] if points.scored is not None else points.read[chosen],
        outcomes=points.outcomes,
        domain=ranges_of({name: v[chosen] for name, v in points.ranges.items()}),
        n_total=int(table.p2.size),
        n_excluded=points.undefined,
        n_outside_model=int((table.status == "outside_model").sum()),
        guessed_events=len(
            set(table.event_id[combination][table.event_guessed[combination]].tolist())
        ),
        fingerprint=_fingerprint(
            keys[chosen],
            names[event],
            values if least is None else {**values, "least": least},
            observed,
            np.where(points.read[chosen], failed, np.nan),
            of_outcomes,
        ),
        sensitive=None if points.sensitive is None else points.sensitive[chosen],
        least_y_m_s=least,
    )
    _reject_thin(data, method, term)
    return data


def _fingerprint(
    keys: NDArray[np.str_],
    events: NDArray[np.str_],
    values: Mapping[str, FloatArray],
    observed: NDArray[np.bool_],
    failed: FloatArray,
    of_outcomes: bool,
) -> str:
    columns = np.column_stack([*values.values(), observed]) + 0.0
    lines = [
        f"{key} {event}\t".encode() + row.tobytes()
        for key, event, row in zip(keys.tolist(), events.tolist(), columns, strict=True)
    ]
    if of_outcomes:
        codes = np.where(np.isfinite(failed), failed, 2.0).astype(np.uint8)
        lines = [line + row.tobytes() for line, row in zip(lines, codes, strict=True)]
    return hashlib.sha256(b"\n".join(sorted(lines))).hexdigest()


def _reject_thin(data: FitData, method: Method, term: Term) -> None:
    of_outcomes = method.reads == "outcomes"
    tells = (np.isfinite(data.failed) & data.read).any(axis=1) if of_outcomes else data.observed
    n = int(tells.sum())
    if n < FEWEST_OBSERVED:
        raise FitError(
            f"{n} critical values were found among {data.n_total} combinations with the term "
            f"{term.name}; a fit requires {FEWEST_OBSERVED}: simulate more motions or more blocks "
            f"(rbfrag simulate, of kind {data.kind})"
        )
    events = np.unique(data.event[tells]).size
    if events < FEWEST_EVENTS:
        raise FitError(
            f"the critical values come from {events} earthquake(s); a fit requires "
            f"{FEWEST_EVENTS}, because points of one earthquake are not independent: add motions "
            "of other earthquakes, and give the events in a metadata table"
        )
    if any(
        not np.all(np.isfinite(v[data.observed])) for n, v in data.values.items() if n == "y_m_s"
    ):
        raise FitError("a critical value is not finite: run  rbfrag db check")
    if np.ptp(data.x[tells]) == 0.0:
        raise FitError(
            f"all motions have the same {term.title}, {data.x[tells][0]:.4g} m/s: a line "
            "needs motions of different strength"
        )


def ranges_of(values: Mapping[str, FloatArray]) -> dict[str, tuple[float, float]]:
    """Return the range of the finite values of each variable."""
    finite = {name: v[np.isfinite(v)] for name, v in values.items()}
    return {name: (float(v.min()), float(v.max())) for name, v in finite.items() if v.size}


def ratio_columns(measures: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return every ratio that the intensity measures allow; not finite without shaking."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return {ratio.name: np.asarray(ratio.formula(measures)) for ratio in ratios_of(measures)}


def _measures(source: FitSource) -> dict[str, FloatArray]:
    table = source.table
    stored = (name for name in INTENSITY if QUANTITIES[name].stored)
    names = (*stored, *spectral_names(table.measures))
    return {"xp_m_s": source.xp_m_s, **{name: table.measure(name) for name in names}}


def _column(values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    return {name: value[:, None] for name, value in values.items()}


def _strengths(source: FitSource, method: Method, term: Term) -> _Points:
    """Return the points of blocks of any strength k_r at a stored size p²."""
    table = source.table
    simulated = source.failed.shape[1]
    source = _with_safe_blocks(source, method.block.safe_steps)
    # Strengths scale as y = k_r g/p: the critical k_r of a record is a critical toppling velocity
    # y*, and a block of the grid has y0 = (k/PGA) PGA g/p.
    p, pga_m_s2 = np.sqrt(table.p2), table.pga_g * STANDARD_GRAVITY_M_S2
    measures = {**_measures(source), "p": p}
    velocity, needed = method.forms[term.name].velocity, [*term.inputs]
    if velocity is not None:
        if source.spectra is None or not np.isfinite(source.spectra).any():
            raise FitError(
                f"method {method.name} requires the response spectra of the motions, and none are "
                "stored: add the motions again with their samples, or fit method logistic"
            )
        with np.errstate(divide="ignore", invalid="ignore"):
            measures["velocity_m_s"] = spectral_velocities(velocity, source.spectra, p)
        needed.append("velocity_m_s")
    x = np.asarray(term.intensity_m_s(measures), dtype=np.float64)
    for name in needed:
        x = np.where(np.isfinite(measures[name]), x, np.nan)
    defined = np.isfinite(x)
    if not defined.any() and "tm_s" in term.inputs:
        raise FitError(
            f"the term {term.name} requires the mean period Tm, which none of the {x.size} "
            "combinations has: add the motions again with their samples, or fit the term pgv"
        )
    if not defined.any() and "xp_m_s" in term.inputs:
        raise FitError(
            "the term xp requires the toppling spectrum X(p), which is not stored for the "
            f"{x.size} combinations: run  rbfrag simulate  again, which adds it"
        )
    # found: y* is known. below_limit, no_motion: y* is below the search limit. Wide interval: y*
    # lies between its ends.
    searched = table.status == "found"
    status = table.status.astype(str)
    # a wide interval, which no scan could tighten, has two ends instead of a value
    highest = table.upper * pga_m_s2 / p
    open_above = np.isfinite(highest) & ~(table.upper <= table.kr_over_pga * (1.0 + source.narrow))
    observed = searched & ~open_above
    limit = np.where(np.isin(status, _CENSORED), table.search_limit * pga_m_s2 / p, np.nan)
    y = np.where(observed, table.y_m_s, np.where(open_above, highest, limit))
    least = np.where(searched & open_above, table.y_m_s, np.nan)
    readable = np.isin(status, ("found", *_CENSORED, "not_searched"))
    of_motion = {name: measures[name] for name in dict.fromkeys(("pgv_m_s", "pga_g", *needed))}
    if velocity is not None:  # what completes it
        more = (name for name in velocity.optional if name not in of_motion)
        of_motion |= {name: measures[name] for name in more}
    of_motion |= {"tm_s": table.tm_s, "p2": table.p2, "p": p, "intensity_m_s": x}
    of_motion |= source.of_block
    for name, values in method.block.stored.items():
        if values:
            readable &= np.isin(source.of_block[name], values)
    # Blocks of fits and scores lie within KR; scores use the grid in y0/PGV that all models share.
    kr = source.k_over_pga * table.pga_g[:, None]
    y0 = source.k_over_pga * (pga_m_s2 / p)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = y0 / table.pgv_m_s[:, None]
    read = np.isfinite(y0) & (kr >= KR[0]) & (kr <= KR[1])
    scored = read & (ratio >= Y0_OVER_PGV[0] * (1.0 - 1e-9))
    scored[:, simulated:] = False
    failed, source_of_outcomes = source.judged_outcomes(y0, y, least)
    has_blocks = read.any(axis=0)
    of_outcomes = method.reads == "outcomes"
    ranges = {
        "p2": np.where(table.p2 >= method.block.smallest_p2, table.p2, np.nan),
        "intensity_m_s": x,
        "y_m_s": np.where(read, y0, np.nan)[:, has_blocks] if of_outcomes else y,
        "tm_s": table.tm_s,
        **{name: measures[name] for name in needed if not np.array_equal(measures[name], x, True)},
        **ratio_columns({**measures, "p": p}),
    }
    if velocity is not None:
        # a few motions of very long or short pulses do not stand for a range
        pulse = ranges["pgv_over_pga_s"]
        low, high = np.nanquantile(pulse[defined], (0.5 - 0.5 * INSIDE, 0.5 + 0.5 * INSIDE))
        ranges["pgv_over_pga_s"] = np.where((pulse >= low) & (pulse <= high), pulse, np.nan)
    if not of_outcomes:
        ranges = {name: np.where(observed, v, np.nan) for name, v in ranges.items()}
    ranges["kr"] = np.tile(KR, (x.size, 1))
    blocks = {**_column(of_motion), "kr": kr[:, has_blocks], "y_m_s": y0[:, has_blocks]}
    if method.block.adjust is not None:
        method.block.adjust(blocks, arrays())
        fitted = read[:, has_blocks] & ~method.block.at_rest.holds(blocks)
        # few blocks lie far down
        for name in method.block.options if fitted.any() else ():
            covered = np.quantile(blocks[name][fitted], 1.0 - INSIDE)
            ranges[name] = np.where(fitted & (blocks[name] >= covered), blocks[name], np.nan)
    return _Points(
        values={**of_motion, "kr": y * p / STANDARD_GRAVITY_M_S2, "y_m_s": y},
        observed=observed,
        is_valid=defined & readable,
        undefined=int((~defined & readable).sum()),
        combination=np.arange(x.size),
        order=np.zeros(x.size),
        blocks=blocks,
        failed=failed[:, has_blocks],
        read=read[:, has_blocks],
        outcomes=source_of_outcomes,
        ranges=ranges,
        scored=scored[:, has_blocks],
        sensitive=None if source.sensitive is None else source.sensitive[:, has_blocks],
        least_y_m_s=least if np.isfinite(least).any() else None,
    )


def _with_safe_blocks(source: FitSource, steps: int) -> FitSource:
    """Return a source whose outcome grid continues above its strongest block, with safe blocks."""
    if source.failed.shape[1] < 2:
        return source
    step = Y0_OVER_PGV[1] / Y0_OVER_PGV[0]
    k = source.k_over_pga[:, -1:] * step ** np.arange(1, steps + 1)
    # where nothing was run nothing is added
    safe = np.where(np.isfinite(source.failed).any(axis=1), 0.0, np.nan)
    return replace(
        source,
        k_over_pga=np.hstack([source.k_over_pga, k]),
        failed=np.hstack([source.failed, np.repeat(safe[:, None], steps, axis=1)]),
    )


def _scaled_records(source: FitSource, method: Method, term: Term) -> _Points:
    """Return the outcomes of stored blocks under scaled records."""
    table, k = source.table, source.k_over_pga
    strength = table.yield_g
    if not np.isfinite(strength).all():
        raise FitError("a stored block has no yield acceleration: run  rbfrag db check")
    size = np.sqrt(table.p2)
    block = {method.block.strength: strength, str(method.block.size): table.p2, "p": size}
    block["y_m_s"] = strength * STANDARD_GRAVITY_M_S2 / size
    measures = _measures(source)
    of_record = {name: measures[name] for name in term.inputs}
    defined = np.isfinite(np.column_stack([*of_record.values()])).all(axis=1)
    # PGA of the scaled record is k over the ratio
    pga = strength[:, None] / k
    scale = pga / np.where(table.pga_g > 0.0, table.pga_g, np.nan)[:, None]
    scaled = {
        name: value[:, None] * scale ** MEASURES[name].power for name, value in of_record.items()
    }
    unscaled = {**of_record, "intensity_m_s": term.intensity_m_s(of_record)}
    return _Points(
        values={**unscaled, **block, "y_m_s": np.full(size.size, np.nan)},
        observed=np.zeros(size.size, dtype=np.bool_),
        # a searched one ended where the block lost a contact
        is_valid=(table.status == "not_searched") & defined & (table.pgv_m_s > 0.0),
        combination=np.arange(size.size),
        order=np.zeros(size.size),
        blocks={**scaled, "intensity_m_s": term.intensity_m_s(scaled), **_column(block)},
        failed=source.failed,
        read=np.isfinite(k),
        outcomes="simulated outcomes",
        ranges={
            **ratio_columns({**measures, "p": size}),
            **{name: of_record[name] for name in term.inputs if not MEASURES[name].power},
            str(method.block.size): table.p2,
            "y_m_s": block["y_m_s"],
            "k_over_pga": np.column_stack([k, np.ones(size.size)]),
        },
    )


def _displacements(source: FitSource, method: Method, term: Term) -> _Points:
    """Return the points of blocks of every stored strength: their sliding displacements."""
    from rbfrag.solver.models.sliding import THRESHOLDS_M

    # A slid distance d is one point of ln d against ln x and strength; below LEAST_DISPLACEMENT_M
    # it is censored. Outcomes "d exceeds the limit" follow from d for every displacement limit.
    n, m = source.k_over_pga.shape
    combination, k = np.repeat(np.arange(n), m), source.k_over_pga.ravel()
    displacement = source.displacement_m
    slid = np.full(n * m, np.nan) if displacement is None else displacement.ravel()
    measures = {name: value[combination] for name, value in _measures(source).items()}
    beyond = np.maximum(slid, LEAST_DISPLACEMENT_M)
    read = {name: measures[name] for name in dict.fromkeys(("pgv_m_s", "pga_g", *term.inputs))}
    strength = k * measures["pga_g"]
    values = {
        **read, method.block.strength: strength, "intensity_m_s": term.intensity_m_s(read),
    }  # fmt: skip
    distances = np.broadcast_to(np.array(THRESHOLDS_M), (k.size, len(THRESHOLDS_M)))
    with np.errstate(invalid="ignore"):
        is_valid = (k < 1.0) & (values["pgv_m_s"] > 0.0) & np.isfinite(slid)
        is_valid &= (strength >= KR[0]) & (strength <= KR[1])
        defined = np.isfinite([values[name] for name in term.inputs]).all(axis=0)
        observed = slid >= LEAST_DISPLACEMENT_M
        failed = (beyond[:, None] > distances).astype(np.float64)
    return _Points(
        values={**values, "displacement_m": beyond},
        observed=observed,
        is_valid=is_valid & defined,
        undefined=np.unique(combination[is_valid & ~defined]).size,
        combination=combination,
        order=k,
        blocks={**_column(values), "displacement_m": distances},
        failed=failed,
        read=np.ones(failed.shape, dtype=np.bool_),
        outcomes="simulated outcomes",
        ranges={
            **ratio_columns(measures),
            **read,
            method.block.strength: np.tile(KR, (k.size, 1)),
            "displacement_m": np.where(observed, beyond, np.nan),
            "k_over_pga": np.column_stack([k, np.ones(k.size)]),
        },
    )


_READERS: Mapping[str, Callable[[FitSource, Method, Term], _Points]] = {
    "strengths": _strengths,
    "scaled_records": _scaled_records,
    "displacements": _displacements,
}
"""How the columns of the database become points, as the description of the block says."""
