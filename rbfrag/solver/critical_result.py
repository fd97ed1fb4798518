"""The critical block of one motion: its bracket, the proof, and the answer in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.numbers import rounded
from rbfrag.results.result import Result, TextTable
from rbfrag.solver.kinds import FOLLOWED
from rbfrag.solver.quantity import finite_or_none
from rbfrag.solver.results import (
    FloatArray,
    Outcome,
    OutcomeIntervals,
    Polarity,
    Response,
    SearchPoints,
    Status,
    no_intervals,
)

STRENGTH_VALUES = (
    "kr_over_pga", "lower", "upper", "kr", "y_m_s", "status", "search_limit", "certified",
    "k_up_over_pga", "undecided", "island_width", "kr_over_pga_resolved", "reentrant", "n_runs",
    "p2",
)  # fmt: skip
"""Values of a search for a toppling strength in its JSON answer."""

NOTHING_TOPPLES = {
    "below_limit": "the record topples no block of this size down to the search limit",
    "no_motion": "the record uplifts no block of this size down to the search limit",
    "outside_model": "the motion throws blocks off their base, which the model does not follow",
}

NO_FACTOR = {
    "below_limit": "The block does not fail at any factor on the record up to scale_limit that "
    "was tried",
    "no_motion": "The block does not move at any factor on the record up to scale_limit",
}

NOTHING_SLIDES = {
    "below_limit": "No block down to the search limit slides {:g} m",
    "no_motion": "No block down to the search limit slides",
    "outside_model": "The vertical motion throws blocks off their base, which the model does not "
    "follow",
}


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CriticalResult(Result):
    """The critical block of one motion: the strongest one that it brings down.

    For kinds whose record is scaled, k/PGA is the block's yield acceleration over the PGA of the
    scaled record, and takes the place of k_r/PGA; for sliding it is k_y/PGA.

    Args:
        kind: name of the model.
        p2: the block's frequency parameter p² [1/s²]; NaN for sliding, which has none.
        polarity: ``forward`` or ``reverse``.
        pga_g: PGA of the horizontal motion [g].
        status: ``found``; ``below_limit`` (nothing topples down to `search_limit`);
            ``no_motion`` (no block down to the limit ever lifts); ``outside_model``.
        search_limit: smallest k_r/PGA looked at.
        kr_over_pga: the largest k_r/PGA known to topple; None unless found.
        lower: lower end of the bracket, k_r/PGA: a block there topples, by a run that is clear of
            its error.
        upper: upper end of the bracket, k_r/PGA: no block there topples. Where the answer is
            certified the two are 1e-6 apart at most. Toppling where it is not: from `upper` on a
            dense scan has met no block that topples, and no gap in it that may hide one; of a
            search that has found nothing it is K_up, above which nothing topples.
        kr: the critical k_r itself.
        y_m_s: critical toppling velocity k_r g/p [m/s].
        certified: True when every k_r above the bracket is proven not to topple, slivers of
            the total length `undecided` (at most 1e-9) excepted.
        k_up_over_pga: proven upper bound over excursions from rest: nothing above it topples.
        undecided: length of k_r/PGA above the bracket, or where it is not certified above
            `lower`, for which safety is not proven.
        island_width: width in k_r/PGA of the toppling interval that the bracket caps; None
            without a full map.
        kr_over_pga_resolved: the same search with islands narrower than 1e-6 ignored; None
            without a full map.
        reentrant: True when a safe island wider than 1e-6 lies below the critical value; False is
            proven but for what the map leaves undecided. None without a full map, except of kinds
            whose search sees it: then False means that none was met.
        n_runs: number of simulations made.
        warnings: sentences about suspicious input or an uncertain answer.
        points: the blocks that were simulated for themselves.
        intervals: what becomes of every block from the search limit upwards, if a full map was
            asked for; of kinds whose record is scaled, what was seen.
        motion: label of the motion.
        block_kr: k_r of the block that the search was asked for; None for a block size alone.
        block_outcome: outcome of that block under the motion.
        with_map: whether the document lists the map.
    """

    kind: str
    p2: float
    polarity: Polarity
    pga_g: float
    status: Status
    search_limit: float
    kr_over_pga: float | None = None
    lower: float | None = None
    upper: float | None = None
    kr: float | None = None
    y_m_s: float | None = None
    certified: bool = False
    k_up_over_pga: float | None = None
    undecided: float | None = None
    island_width: float | None = None
    kr_over_pga_resolved: float | None = None
    reentrant: bool | None = None
    n_runs: int = 0
    warnings: tuple[str, ...] = ()
    points: SearchPoints
    intervals: OutcomeIntervals = field(default_factory=no_intervals)
    motion: str = ""
    block_kr: float | None = None
    block_outcome: Outcome = Outcome.UNDETERMINED
    with_map: bool = False

    def sentences(self) -> Iterator[str]:
        """Yield the critical value, whether the block topples, and how precise the value is."""
        about = f"p² = {self.p2:.3g} s⁻²; {self._record()}"
        pga_g, upper = self.pga_g, self.upper
        if self.kr is None or self.kr_over_pga is None or upper is None or self.lower is None:
            finding = NOTHING_TOPPLES[self.status]
            if not self.certified and upper is not None:
                finding = (
                    "no block of this size was seen to topple down to the search limit; not "
                    f"certified below k_r = {rounded(upper * pga_g)}"
                )
            yield self._of_block(finding)
            yield about
            return
        kr = rounded(self.kr)
        if self.certified:
            value = f"k_r = {kr}"
            precision = f"certified to ±{0.5 * (upper - self.lower) * pga_g:.0e}"
        else:
            value = f"k_r between {kr} and {rounded(upper * pga_g)}"
            precision = f"not certified ({kr} is the strongest block seen to topple)"
        if self.block_kr is None:
            yield f"Critical {value}: {precision}"
        elif self.block_kr < self.kr and self.block_outcome == Outcome.STABLE:
            yield self._of_block(f"it is in a safe gap below the critical value {value}")
        else:
            yield self._of_block(f"the critical value of this record is {value}")
        yield f"k_r/PGA = {rounded(self.kr_over_pga)}, {precision}; {about}"

    def _of_block(self, finding: str) -> str:
        """Return a finding of the search, with the outcome of the block that it was asked for."""
        if self.block_kr is None:
            return finding[0].upper() + finding[1:]
        verb = {Outcome.TOPPLED: "topples", Outcome.STABLE: "does not topple"}.get(
            self.block_outcome, "may topple"
        )
        return f"The block (k_r = {rounded(self.block_kr)}) {verb}: {finding}"

    def _record(self) -> str:
        name = f"{self.motion}, " if self.motion else ""
        return f"{name}PGA {rounded(self.pga_g)} g, {self.polarity} polarity"

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield every value, if verbose, and the map."""
        values = self.as_dict()
        rows = values.pop("map", [])
        del values["warnings"]
        if verbose:
            yield TextTable((), [*values.items()])
        if rows:
            yield TextTable(
                tuple(rows[0]),
                [(f"{row['k_lo']:.12f}", f"{row['k_hi']:.12f}", row["outcome"]) for row in rows],
            )

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        document = {name: getattr(self, name) for name in STRENGTH_VALUES} | self._common()
        if self.with_map:
            document["map"] = self.map_rows()
        return document

    def _common(self) -> dict[str, Any]:
        """Return the values that the documents of all kinds have."""
        return {
            "polarity": self.polarity,
            "pga_g": self.pga_g,
            "how": FOLLOWED,
            "warnings": list(self.warnings),
        }

    def map_rows(self) -> list[dict[str, Any]]:
        """Return the map of outcomes, one row per interval of k_r/PGA, rising."""
        intervals = self.intervals
        return [
            {"k_lo": low, "k_hi": high, "outcome": outcome}
            for low, high, outcome in zip(
                intervals.k_lo.tolist(), intervals.k_hi.tolist(), intervals.outcome, strict=True
            )
        ]

    def table_columns(self) -> Mapping[str, Any]:
        """Return the columns of the table of one row."""
        columns = super().table_columns()
        return {name: value for name, value in columns.items() if name != "with_map"}


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CriticalScale(CriticalResult):
    """The smallest factor on a record that brings a block down: slumping, confined toppling.

    k/PGA, the block's yield acceleration over the PGA of the scaled record, takes the place of
    k_r/PGA.

    Args:
        rotation_deg: peak rotation that counts as failure [deg]; None for failure past recovery.
        scale: the smallest factor that was seen to fail; None unless found.
        lower_scale: lower end of its bracket, a factor that does not fail.
        starts_scale: factor above which the block moves; None where nothing moves it.
        scale_limit: largest factor that was looked at.
        yield_name: name of the yield acceleration, ``ks`` or ``kct``.
        yield_g: the yield acceleration [g].
        critical_rotation_rad: rotation at which the block has no strength left [rad].
        ended: reason why the model has no answer beyond the limit; empty where it has one.
        runs: the simulations that were made.
    """

    rotation_deg: float | None
    scale: float | None
    lower_scale: float | None
    starts_scale: float | None
    scale_limit: float
    yield_name: str
    yield_g: float
    critical_rotation_rad: float | None
    ended: str
    runs: tuple[Any, ...]

    def sentences(self) -> Iterator[str]:
        """Yield the factor at which the block fails."""
        if self.scale is None:
            yield NO_FACTOR[self.status]
        else:
            yield (
                f"The block fails if the record is multiplied by {rounded(self.scale)} "
                f"(PGA {rounded(self.scale * self.pga_g)} g)"
            )
        yield f"{self.yield_name} = {rounded(self.yield_g)} g; {self._record()}"

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        scale, y_m_s = self.scale, None
        if scale is not None:
            y_m_s = self.yield_g / scale * STANDARD_GRAVITY_M_S2 / math.sqrt(self.p2)
        return {
            "kind": self.kind,
            "rotation_deg": self.rotation_deg,
            "scale": scale,
            "lower": self.lower_scale,
            "upper": scale,
            "status": self.status,
            "starts_scale": self.starts_scale,
            "scale_limit": finite_or_none(self.scale_limit),
            "certified": self.certified,
            "reentrant": self.reentrant,
            "n_runs": self.n_runs,
            "k_over_pga": self.kr_over_pga,
            "pga_at_failure_g": None if scale is None else scale * self.pga_g,
            "y_m_s": y_m_s,
            self.yield_name: self.yield_g,
            "ps2": self.p2,
        } | self._common()


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CriticalSlide(CriticalResult):
    """The greatest k_y/PGA with which a block slides further than a distance.

    Args:
        displacement_m: the distance on a level plane [m].
    """

    displacement_m: float

    def sentences(self) -> Iterator[str]:
        """Yield the yield acceleration below which blocks slide that far."""
        if self.kr is None:
            yield NOTHING_SLIDES[self.status].format(self.displacement_m)
        else:
            yield (
                f"Critical k_y = {rounded(self.kr)} for a displacement of "
                f"{self.displacement_m:g} m on a level plane; {self._record()}"
            )
        yield "On a dipping base, displacements are cos(φ − β)/cos φ times these"

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        return {
            "kind": self.kind,
            "displacement_m": self.displacement_m,
            "ky_over_pga": self.kr_over_pga,
            "lower": self.lower,
            "upper": self.upper,
            "ky": self.kr,
            "status": self.status,
            "search_limit": self.search_limit,
            "certified": self.certified,
            "n_runs": self.n_runs,
        } | self._common()


@dataclass(frozen=True, eq=False, repr=False)
class SlidingStrengths(Result):
    """Critical k_y of several displacements, and displacement by strength, of one motion.

    Args:
        thresholds: the critical value of each displacement.
        ky_over_pga: k_y/PGA of the blocks of the curve, shape (n,).
        displacement_m: their displacements on a level plane [m], shape (n,); NaN after a jump.
        warnings: notes on the motion and the search.
        response: of the block that the search was asked for; None for the motion alone.
        block_ky: k_y of that block; None for the motion alone.
    """

    thresholds: tuple[CriticalResult, ...]
    ky_over_pga: FloatArray
    displacement_m: FloatArray
    warnings: tuple[str, ...]
    response: Response | None = None
    block_ky: float | None = None

    def sentences(self) -> Iterator[str]:
        """Yield how far the block slides, and the critical k_y of the first displacement."""
        if self.response is not None:
            yield self._of_block(self.response)
        yield from self.thresholds[0].sentences()

    def _of_block(self, response: Response) -> str:
        """Return which displacement limits the block exceeds."""
        slid = response.displacement_m
        block = "The block" if self.block_ky is None else f"The block (k_y = {self.block_ky:.3f})"
        if slid is None:
            return f"{block} may slide farther: {response.outcome.advice}"
        limits = sorted(strength.as_dict()["displacement_m"] for strength in self.thresholds)
        verdicts = [
            f"{words} {' and '.join(f'{limit:g}' for limit in of)} m"
            for words, of in (
                ("more than", [limit for limit in limits if slid > limit]),
                ("not more than", [limit for limit in limits if slid <= limit]),
            )
            if of
        ]
        return f"{block} slides {rounded(slid)} m on its base: {', '.join(verdicts)}"

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield the critical values by displacement, and the displacements by strength."""
        document = self.as_dict()
        names = ["displacement_m", "ky_over_pga", "ky"]
        if verbose:
            yield TextTable((), [(name, document[name]) for name in ("kind", "polarity", "pga_g")])
            names += ["lower", "upper", "status", "n_runs"]
        yield TextTable(names, [[row[name] for name in names] for row in document["thresholds"]])
        curve = document["displacements"]
        yield TextTable(tuple(curve[0]), [tuple(row.values()) for row in curve])

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        thresholds = [critical.as_dict() for critical in self.thresholds]
        return {
            **thresholds[0],
            "warnings": list(self.warnings),
            "thresholds": thresholds,
            "displacements": [
                {"ky_over_pga": ratio, "displacement_m": finite_or_none(slid)}
                for ratio, slid in zip(
                    self.ky_over_pga.tolist(), self.displacement_m.tolist(), strict=True
                )
            ],
        }
