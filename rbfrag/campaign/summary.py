"""Progress and summary of a campaign."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.conditional import ConditionalShare
from rbfrag.results.numbers import interval, percent, rounded
from rbfrag.results.result import Result, Tabular, TextTable

SHORT = ("certified", "reentrant", "without_vertical", "runs", "responses", "seconds")
"""Numbers that a terminal shows where they are not zero, unless every value is requested."""

STATUSES = {
    "found": "with a critical value",
    "below_limit": "in which nothing fails down to the search limit",
    "no_motion": "in which nothing moves",
    "outside_model": "outside the model",
    "not_searched": "with outcomes of a grid alone",
}
"""Status of combinations in a sentence."""

CONDITIONAL = (
    "limit", "state left", "PGA/yield", "blocks", "earthquakes", "of station", "P", "interval",
    "P intact", "interval", "ratio",
)  # fmt: skip
"""Headers of the conditional fragility."""

_COUNTS = ("blocks", "earthquakes", "of_station", "fails", "intact_fails", "unknown")


@dataclass(frozen=True)
class CampaignProgress:
    """Progress of a campaign in combinations, or of a rock mass in blocks."""

    completed: int
    total: int
    resumed: int
    seconds: float

    @property
    def rate_per_s(self) -> float:
        """Number completed per second in this run."""
        computed = self.completed - self.resumed
        return computed / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def seconds_left(self) -> float | None:
        """Estimated remaining time [s]; None before the first result."""
        return (self.total - self.completed) / self.rate_per_s if self.rate_per_s else None


@dataclass(frozen=True, repr=False)
class SequenceReport(Tabular):
    """Results of a campaign of sequences.

    Args:
        seed: of the pairs that are drawn.
        station_pairs: pairs of motions that are two shocks of one station.
        drawn_pairs: pairs of motions of different earthquakes, drawn by the seed.
        conditional: the conditional fragility: a row for each limit, state and shaking.
    """

    seed: int
    station_pairs: int
    drawn_pairs: int
    conditional: tuple[ConditionalShare, ...]

    def table_columns(self) -> dict[str, NDArray[Any]]:
        """Return the conditional fragility by column; NaN for missing values."""
        names = [item.name for item in fields(ConditionalShare)]
        return {
            name: np.array(
                [getattr(row, name) for row in self.conditional],
                dtype=int if name in _COUNTS else float,
            )
            for name in names
        }

    def text_table(self) -> TextTable:
        """Return the conditional fragility as a terminal table."""
        rows = []
        for row in self.conditional:
            limit = "recovery"
            if row.displacement_m is not None:
                limit = f"{row.displacement_m:g} m"
            elif row.rotation_deg is not None:
                limit = f"{row.rotation_deg:g}°"
            state = interval(row.state_from, row.state_to) if row.state_to > 0.0 else "none"
            least, most = row.pga_over_yield_from, row.pga_over_yield_to
            ratios = f"over {least:g}" if most is None else f"{least:g}–{most:g}"
            probability = percent(row.probability), interval(row.ci_low, row.ci_high)
            intact = interval(row.intact_ci_low, row.intact_ci_high)
            ratio = None if row.ratio is None else rounded(row.ratio)
            rows.append((
                limit, state, ratios, row.blocks, row.earthquakes, row.of_station, *probability,
                percent(row.intact_probability), intact, ratio,
            ))  # fmt: skip
        return TextTable(CONDITIONAL, rows)


@dataclass(frozen=True, repr=False)
class CampaignSummary(Result):
    """Summary of a completed campaign.

    Args:
        kind: what the blocks do.
        combinations: those asked for (motions x vertical x polarity x cases of the kind).
        found: of these, with a critical value above the limit.
        below_limit: nothing fails down to the search limit, or to where the model ends (censored).
        no_motion: no block down to the limit ever moves.
        outside_model: the motion is outside the model.
        not_searched: of a kind without a search; outcomes of its grid are all there is.
        certified: with a proven answer.
        reentrant: with a stronger failure below which a block is spared, as far as was looked at.
        runs: simulations made by this run.
        grid_runs: of these, runs of blocks asked for by `grid`.
        responses: histories that this run stored.
        without_vertical: horizontal motions that vertical shaking was asked for and have none.
        seconds: wall time of this run.
        resumed: combinations of which everything that is asked for was stored before.
        warnings: what a reader of the results should know.
        sequence: of a campaign of sequences, whose combinations are pairs of motions x polarities x
            blocks, what they show; None of others.
    """

    kind: str
    combinations: int
    found: int = 0
    below_limit: int = 0
    no_motion: int = 0
    outside_model: int = 0
    not_searched: int = 0
    certified: int = 0
    reentrant: int = 0
    runs: int = 0
    grid_runs: int = 0
    responses: int = 0
    without_vertical: int = 0
    seconds: float = 0.0
    resumed: int = 0
    warnings: tuple[str, ...] = ()
    sequence: SequenceReport | None = None

    def sentences(self) -> Iterator[str]:
        """Yield the number of stored combinations, by their status."""
        several = self.combinations != 1
        before = f", {self.resumed:,} of them before" if self.resumed else ""
        if self.sequence is not None:
            yield (
                f"{self.combinations:,} sequence{'s' if several else ''} of {self.kind} blocks "
                f"stored{before}: {self.sequence.station_pairs} pairs of shocks of one station, "
                f"{self.sequence.drawn_pairs} drawn pairs"
            )
            return
        parts = [f"{getattr(self, n):,} {text}" for n, text in STATUSES.items() if getattr(self, n)]
        yield (
            f"{self.combinations:,} combination{'s' if several else ''} of kind {self.kind} "
            f"stored{before}: {', '.join(parts) or 'none'}"
        )

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield the numbers of the campaign, or the conditional fragility of sequences."""
        if self.sequence is not None:
            yield self.sequence.text_table()
            return
        values = self.as_dict()
        del values["warnings"]
        rows = [(name, value) for name, value in values.items() if verbose or name in SHORT]
        yield TextTable((), [(name, value) for name, value in rows if verbose or value])

    def as_dict(self) -> dict[str, Any]:
        """Return the keys of the JSON contract."""
        document = {**asdict(self), "warnings": list(self.warnings)}
        if self.sequence is None:
            del document["sequence"]
        return document
