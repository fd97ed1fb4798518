"""Which critical values of blocks that slump or slide a campaign is made of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import Connection

from rbfrag.campaign.plan import chosen_motions, excitations
from rbfrag.campaign.slumping_family import FAMILY, BlockClass
from rbfrag.db.keys import combination_key
from rbfrag.db.queries import Vertical
from rbfrag.db.rows import MotionRow
from rbfrag.db.vertical_pairs import VerticalPair
from rbfrag.errors import InputError
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import NUMERICS_VERSION, POLARITIES, SEARCH_LIMIT, Polarity
from rbfrag.solver.search.displacement import THRESHOLDS_M, TOLERANCE
from rbfrag.solver.search.scale import BRACKET, SCAN_RATIO
from rbfrag.solver.shaken_mechanism import shaken_mechanism

LEVEL_PLANE: Mapping[str, object] = {"plane": "level"}
"""The block of a sliding campaign: on a base that dips a displacement is a factor times its."""

ROTATIONS_DEG: tuple[float | None, ...] = (2.0, None)
"""Rotations that count as failure of a slump [deg]; None for failure past recovery."""


@dataclass(frozen=True)
class KindCase:
    """One critical value of one motion.

    Args:
        natural_key: of the combination.
        kind: ``slumping`` or ``sliding``.
        polarity: ``forward`` or ``reverse``.
        vertical_id: the vertical motion that goes with it, or None.
        block: which block, as it is stored.
        block_class: the same of a slumping block; None for sliding.
        settings: what else decides the answer: the rotation or the displacement, and how the
            search is made.
    """

    natural_key: str
    kind: str
    polarity: Polarity
    vertical_id: int | None
    block: Mapping[str, object]
    block_class: BlockClass | None
    settings: Mapping[str, object]


@dataclass(frozen=True)
class KindMotionPlan:
    """All critical values of one horizontal motion, so that its samples travel once."""

    motion: MotionRow
    vertical: VerticalPair | None
    cases: tuple[KindCase, ...]


@dataclass(frozen=True)
class KindPlan:
    """What a campaign is made of; the longest records first."""

    motions: tuple[KindMotionPlan, ...]
    without_vertical: int
    warnings: tuple[str, ...]

    @property
    def cases(self) -> list[KindCase]:
        """All critical values."""
        return [case for plan in self.motions for case in plan.cases]


@dataclass(frozen=True)
class Criterion:
    """One block with one measure of failure, whatever the motion."""

    kind: str
    p2: float | None
    block: Mapping[str, object]
    block_class: BlockClass | None
    settings: Mapping[str, object]


def slumping_criteria(
    rotations_deg: Sequence[float | None] = ROTATIONS_DEG,
    family: Sequence[BlockClass] = FAMILY,
) -> tuple[Criterion, ...]:
    """Return every block of the family with every rotation that counts as failure.

    Raises:
        InputError: no rotation, one that repeats or that a block of the family cannot reach; a
            block that does not slump.
    """
    rotations = [
        None if value is None else positive(value, "--rotation", "degrees")
        for value in rotations_deg
    ]
    _refuse_repeated(rotations, "--rotation")
    least = min(each.gamma_deg for each in family)
    for rotation in rotations:
        if rotation is not None and rotation >= least:
            raise InputError(
                f"--rotation {rotation:g}: a block of the family lies on its back edge at "
                f"{least:g} degrees; give less, or the word recovery for failure past recovery"
            )
    made = []
    for each in family:
        shaken = shaken_mechanism(
            each.block, kind="slumping", beta_deg=each.beta_deg, phi_deg=each.phi_deg
        )
        for rotation in rotations:
            settings = {
                "search_limit": SEARCH_LIMIT,
                "scan_ratio": SCAN_RATIO,
                "bracket": BRACKET,
                "rotation_deg": rotation,
                "map": "seen",
            }
            made.append(Criterion("slumping", shaken.p2, each.as_dict(), each, settings))
    return tuple(made)


def sliding_criteria(displacements_m: Sequence[float] = THRESHOLDS_M) -> tuple[Criterion, ...]:
    """Return the first motion, which carries the displacements, and every stated displacement.

    Raises:
        InputError: a displacement that is not above zero, or repeats.
    """
    stated = [positive(value, "--displacement", "m") for value in displacements_m]
    _refuse_repeated(stated, "--displacement")
    return tuple(
        Criterion(
            "sliding",
            None,
            LEVEL_PLANE,
            None,
            {"search_limit": SEARCH_LIMIT, "tolerance": TOLERANCE, "displacement_m": value},
        )
        for value in (0.0, *stated)
    )


def plan_kind(
    connection: Connection,
    criteria: Sequence[Criterion],
    *,
    suite: str | None = None,
    vertical: Vertical = "without",
) -> KindPlan:
    """Return every critical value: horizontal motions x vertical or not x polarity x criteria.

    Args:
        connection: the database.
        criteria: from :func:`slumping_criteria` or :func:`sliding_criteria`.
        suite: only the horizontal motions of this suite.
        vertical: ``without`` vertical motion, ``with`` that of the same recording, or ``both``.

    Raises:
        InputError: no such suite, no horizontal motion, none with a vertical one where it is
            needed.
    """
    chosen = chosen_motions(connection, suite=suite, vertical=vertical)
    plans = [
        KindMotionPlan(
            motion=row,
            vertical=chosen.fitting.get(row.id),
            cases=tuple(
                _case(row, up, polarity, criterion)
                for up in excitations(vertical, chosen.fitting.get(row.id))
                for polarity in POLARITIES
                for criterion in criteria
            ),
        )
        for row in chosen.rows
    ]
    kept = sorted((p for p in plans if p.cases), key=lambda p: (-p.motion.npts, p.motion.id))
    return KindPlan(tuple(kept), chosen.without_vertical, chosen.warnings)


def _case(
    row: MotionRow, up: VerticalPair | None, polarity: Polarity, criterion: Criterion
) -> KindCase:
    key = combination_key(
        motion_sha256=row.sha256,
        dt_s=row.dt_s,
        vertical_sha256=None if up is None else up.vertical_sha256,
        polarity=polarity,
        kind=criterion.kind,
        p2=criterion.p2,
        settings=criterion.settings,
        numerics_version=NUMERICS_VERSION,
        block=criterion.block,
    )
    return KindCase(
        natural_key=key,
        kind=criterion.kind,
        polarity=polarity,
        vertical_id=None if up is None else up.vertical_id,
        block=criterion.block,
        block_class=criterion.block_class,
        settings=criterion.settings,
    )


def _refuse_repeated(values: Sequence[float | None], option: str) -> None:
    def each() -> Iterator[str]:
        for value in values:
            yield "recovery" if value is None else f"{value:g}"

    words = list(each())
    if not words:
        raise InputError(f"{option}: the list is empty: name at least one value")
    for word in words:
        if words.count(word) > 1:
            raise InputError(f"{option}: {word} is in the list twice: name each value once")
