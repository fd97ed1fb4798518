"""Which critical values of blocks that slump or slide a campaign is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import Connection

from rbfrag.campaign.plan import chosen_motions, excitations
from rbfrag.db.keys import combination_key
from rbfrag.db.queries import Vertical
from rbfrag.db.rows import MotionRow
from rbfrag.db.vertical_pairs import VerticalPair
from rbfrag.solver.kind import Case
from rbfrag.solver.results import NUMERICS_VERSION, POLARITIES, Polarity


@dataclass(frozen=True)
class KindCase:
    """One critical value of one motion.

    Args:
        natural_key: of the combination.
        kind: ``slumping`` or ``sliding``.
        polarity: ``forward`` or ``reverse``.
        vertical_id: the vertical motion that goes with it, or None.
        block: which block, as it is stored.
        settings: what else decides the answer: the rotation or the displacement, and how the
            search is made.
    """

    natural_key: str
    kind: str
    polarity: Polarity
    vertical_id: int | None
    block: Mapping[str, object] | None
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


def plan_kind(
    connection: Connection,
    criteria: Sequence[Case],
    *,
    suite: str | None = None,
    vertical: Vertical = "without",
) -> KindPlan:
    """Return every critical value: horizontal motions x vertical or not x polarity x criteria.

    Args:
        connection: the database.
        criteria: of the kind.
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


def _case(row: MotionRow, up: VerticalPair | None, polarity: Polarity, criterion: Case) -> KindCase:
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
        settings=criterion.settings,
    )
