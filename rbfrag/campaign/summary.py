"""How far a campaign is, and what it reports."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.conditional import ConditionalShare
from rbfrag.results.result import Tabular

_COUNTS = ("blocks", "earthquakes", "of_station", "fails", "intact_fails", "unknown")


@dataclass(frozen=True)
class CampaignProgress:
    """How far a campaign is, in combinations; or the runs of a rock mass, in blocks."""

    done: int
    total: int
    resumed: int
    seconds: float

    @property
    def rate_per_s(self) -> float:
        """What is finished per second by this run."""
        computed = self.done - self.resumed
        return computed / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def seconds_left(self) -> float | None:
        """Estimated time left [s]; None before anything is finished."""
        return (self.total - self.done) / self.rate_per_s if self.rate_per_s else None


@dataclass(frozen=True, repr=False)
class SequenceReport(Tabular):
    """What a campaign of sequences shows.

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
        """Return the conditional fragility by column; NaN for nothing."""
        names = [each.name for each in fields(ConditionalShare)]
        return {
            name: np.array(
                [getattr(row, name) for row in self.conditional],
                dtype=int if name in _COUNTS else float,
            )
            for name in names
        }


@dataclass(frozen=True, repr=False)
class CampaignSummary(Tabular):
    """What a finished campaign reports.

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

    def as_dict(self) -> dict[str, object]:
        """Return the keys of the JSON contract."""
        document = {**asdict(self), "warnings": list(self.warnings)}
        if self.sequence is None:
            del document["sequence"]
        return document
