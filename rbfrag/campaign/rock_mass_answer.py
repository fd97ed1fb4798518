"""The blocks between two fracture sets, and what a motion does to them: `rockmass`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any, Unpack

from numpy.typing import NDArray

from rbfrag.campaign.shake_rockmass import shake
from rbfrag.campaign.summary import CampaignProgress
from rbfrag.errors import InputError, UnknownFieldError
from rbfrag.files import as_path
from rbfrag.fragility.intervals import checked_level
from rbfrag.fragility.measures import spectral
from rbfrag.fragility.model import Model
from rbfrag.motions.polarity import Polarity
from rbfrag.motions.recognise import MotionLike, as_motion
from rbfrag.question.fields import MeasureFields
from rbfrag.results.result import Tabular
from rbfrag.rockmasses.counts import crossings, mode_counts
from rbfrag.rockmasses.failures import failure_warnings, failures, failures_as_dict, outcome_columns
from rbfrag.rockmasses.file import read_rock_mass, rock_mass_of_tables
from rbfrag.rockmasses.joint_sets import Realisations, RockMass
from rbfrag.rockmasses.report import as_dict, block_columns
from rbfrag.rockmasses.scenario import Scenario, scenario
from rbfrag.rockmasses.shaking import FailureLimits, ShakenMass


@dataclass(frozen=True, eq=False, repr=False)
class RockMassAnswer(Tabular):
    """Blocks of a rock mass, and what fails of them.

    Its table has one row a block; with a motion one a block and scale.

    Args:
        blocks: the blocks that were drawn.
        scenario: probabilities by measures of the motion; None where none is given.
        outcomes: what a motion did to each block; None without a motion.
        level: confidence level of the intervals.
    """

    blocks: Realisations
    scenario: Scenario | None
    outcomes: ShakenMass | None
    level: float

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know about the answer."""
        return tuple(self.as_dict()["warnings"])

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        ran, level = self.outcomes, self.level
        failed = None if ran is None else failures_as_dict(ran, failures(ran, level), level)
        document = as_dict(
            self.blocks, mode_counts(self.blocks), crossings(self.blocks), self.scenario, failed
        )
        if ran is not None:
            document["warnings"] += failure_warnings(ran)
        return document

    def table_columns(self) -> Mapping[str, NDArray[Any]]:
        """Return the columns by name."""
        if self.outcomes is not None:
            return outcome_columns(self.outcomes)
        return block_columns(self.blocks, self.scenario)

    def __repr__(self) -> str:
        """Return how many blocks of each mode there are, on one line."""
        counts = {name: each.count for name, each in mode_counts(self.blocks).items()}
        return f"RockMassAnswer({self.blocks.n_blocks} blocks: {counts})"


class RockMassQuestion(MeasureFields[float | None], total=False):
    """What may be asked of the blocks of a rock mass."""

    sa_g: Mapping[float, float] | None
    motion: MotionLike | None
    vertical: MotionLike | None
    polarity: Polarity
    scales: Sequence[float]
    displacement_m: float | None
    rotation_deg: float | None
    model: Model | None
    level: float
    db: str | PathLike[str] | None
    jobs: int | None
    on_progress: Callable[[CampaignProgress], None] | None


ANSWERED_BY = ("model", "level", "db", "displacement_m", "rotation_deg")
SHAKEN_BY = ("scales", "polarity", "jobs", "on_progress")
FAILS_BY = ("displacement_m", "rotation_deg")
"""Which of these a fragility model, a motion and the failure by a motion take."""


def rockmass(
    mass: str | PathLike[str] | RockMass | Mapping[str, object],
    *,
    n: int | None = None,
    seed: int | None = None,
    **question: Unpack[RockMassQuestion],
) -> RockMassAnswer:
    """Draw blocks from two fracture sets, with their modes, yields and failures.

    With a measure of the motion the probability of failure is averaged over the blocks of each
    mode that there is a fragility model for; with `motion` every block that it moves is run.

    Args:
        mass: a rock mass, its file (.toml, .csv), or its description by tables as in the file.
        n: number of realisations; None for what the file says, else 20,000.
        seed: of the random numbers; None for what the file says, else 1.
        pgv_m_s: peak ground velocity [m/s].
        pga_g: peak ground acceleration [g].
        tm_s: mean period [s].
        pgd_m: peak ground displacement [m].
        sa03_g, sa10_g, sa30_g: spectral accelerations [g]; or all of them as sa_g, by
            their period [s], as in :func:`rbfrag.predict`.
        arias_m_s: Arias intensity [m/s].
        magnitude: magnitude of the earthquake.
        motion: accelerogram, or its file, that every block is run under in its own mode.
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` (positive samples drive out of the slope; if left out) or ``reverse``.
        scales: factors on the motion; the motion itself if left out.
        displacement_m: a slide fails beyond this displacement [m]; None for 0.05 with a motion,
            and with measures for an answer of toppling alone.
        rotation_deg: a slump, or a topple against the back plane, fails beyond this rotation
            [deg]; None for past recovery only.
        model: as in :func:`rbfrag.predict`.
        level: confidence level of the intervals; 0.95 if left out.
        db: as in :func:`rbfrag.predict`.
        jobs: worker processes; None for one a processor where there is work for them.
        on_progress: called as blocks are run.

    Raises:
        InputError: a description or value that cannot be used, or measures that do not suffice.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    UnknownFieldError.refuse(question, RockMassQuestion, "a rock mass")
    blocks = _rock_mass(mass).realise(n, seed)
    given: dict[str, Any] = {name: each for name, each in question.items() if each is not None}

    def of(names: Iterable[str]) -> dict[str, Any]:
        return {name: given[name] for name in names if name in given}

    measures = of(MeasureFields.__annotations__) | spectral(given.get("sa_g", {}))
    level, motion = checked_level(given.get("level", 0.95)), given.get("motion")
    if motion is not None and measures:
        raise InputError(
            f"motion does not go with {next(iter(measures))}: give the accelerogram, or the "
            "measures that a fragility model answers for"
        )
    answer = scenario(blocks, measures, **of(ANSWERED_BY)) if measures else None
    vertical = as_motion(given["vertical"], "vertical") if "vertical" in given else None
    ran = None
    if motion is not None:
        limits = FailureLimits(**of(FAILS_BY))
        ran = shake(blocks, as_motion(motion), vertical=vertical, limits=limits, **of(SHAKEN_BY))
    elif vertical is not None:
        raise InputError("vertical goes with a motion: give motion, too")
    return RockMassAnswer(blocks, answer, ran, level)


def _rock_mass(given: object) -> RockMass:
    if isinstance(given, RockMass):
        return given
    if isinstance(given, Mapping):
        return rock_mass_of_tables(given)
    return read_rock_mass(as_path(given, "mass", "a rock mass"))
