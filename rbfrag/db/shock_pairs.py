"""Storage of block responses to two consecutive motions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal, NamedTuple

from sqlalchemy import Connection, select

from rbfrag.db.insert import insert_rows, rows_of_keys
from rbfrag.db.keys import NOT_DIGESTED, canonical_json
from rbfrag.db.rows import stored_json
from rbfrag.db.schema import campaign, earthquake, motion, recording, shock_pair
from rbfrag.motions.polarity import Polarity

Pairing = Literal["station", "drawn"]

PARTS = ("first", "second", "intact")
"""The runs of a pair: the first motion, the second after it, the second alone."""

COLUMNS = tuple(column.name for column in shock_pair.c if column.name not in NOT_DIGESTED)


class ShockEnd(NamedTuple):
    """Final state of a block after one motion of a pair.

    Args:
        outcome: how the run ended.
        displacement_m: slip along the base since the block's first place [m]; None if not known.
        rotation_rad: rotation that is left [rad]; None of slides, and if not known.
        peak_rad: greatest rotation [rad]; None of slides, and where the block failed.
    """

    outcome: str | None
    displacement_m: float | None
    rotation_rad: float | None
    peak_rad: float | None


NOT_RUN = ShockEnd(None, None, None, None)
"""The second motion, where the first leaves the block nowhere known."""


@dataclass(frozen=True)
class ShockPairRecord:
    """One block under two motions in stored form.

    Args:
        natural_key: from :func:`rbfrag.db.keys.pair_key`.
        pairing: ``station`` for two shocks of one station, ``drawn`` for others.
        polarity: of both.
        yield_g: yield acceleration in its first place [g].
        critical_rad: rotation without strength [rad]; None of slides.
        first: after the first motion.
        second: after both.
        intact: after the second alone.
    """

    natural_key: str
    first_motion_id: int
    second_motion_id: int
    pairing: Pairing
    polarity: Polarity
    kind: str
    block: Mapping[str, object]
    yield_g: float
    critical_rad: float | None
    numerics_version: str
    first: ShockEnd
    second: ShockEnd
    intact: ShockEnd


@dataclass(frozen=True)
class StoredShockPair:
    """One stored block under two motions.

    Args:
        processor: the processor and numba of its campaign.
        event_id: earthquake of the second motion.
        pga_g: its PGA [g].
    """

    id: int
    processor: object
    event_id: str
    pga_g: float
    record: ShockPairRecord


def insert_shock_pairs(
    connection: Connection, campaign_id: int, records: Sequence[ShockPairRecord]
) -> None:
    """Store blocks under two motions; existing keys are skipped."""
    rows = []
    # in one order: two campaigns on one server then wait for each other, never both at once
    for record in sorted(records, key=lambda record: record.natural_key):
        ends = {
            f"{part}_{name}": value
            for part in PARTS
            for name, value in getattr(record, part)._asdict().items()
        }
        block = canonical_json(record.block)
        values = {**vars(record), **ends, "campaign_id": campaign_id, "block": block}
        rows.append(tuple(values[name] for name in COLUMNS))
    insert_rows(connection, shock_pair, COLUMNS, rows)


def pair_keys_with_samples(connection: Connection, *, numerics_version: str) -> list[str]:
    """Return the sorted natural keys of motion pairs that can be computed again."""
    first = motion.alias("first")
    query = (
        select(shock_pair.c.natural_key)
        .select_from(
            shock_pair.join(motion, motion.c.id == shock_pair.c.second_motion_id).join(
                first, first.c.id == shock_pair.c.first_motion_id
            )
        )
        .where(
            shock_pair.c.numerics_version == numerics_version,
            motion.c.samples.is_not(None),
            first.c.samples.is_not(None),
        )
    )
    return sorted(connection.scalars(query))


def stored_shock_pairs(connection: Connection, keys: Iterable[str]) -> list[StoredShockPair]:
    """Return the stored motion pairs of natural keys, in the order of the keys."""
    query = select(
        shock_pair, campaign.c.settings, earthquake.c.event_id, motion.c.pga_g
    ).select_from(
        shock_pair.join(motion, motion.c.id == shock_pair.c.second_motion_id)
        .join(recording)
        .join(earthquake)
        .join(campaign, campaign.c.id == shock_pair.c.campaign_id)
    )
    names = [
        attribute.name
        for attribute in fields(ShockPairRecord)
        if attribute.name not in (*PARTS, "block")
    ]
    pairs = []
    for stored in rows_of_keys(connection, query, shock_pair.c.natural_key, keys):
        row = stored._mapping
        label = f"of pair of motions {row['id']}"
        settings = stored_json(row["settings"], dict, f"settings of the campaign {label}")
        ends: dict[str, Any] = {
            part: ShockEnd(*(row[f"{part}_{name}"] for name in ShockEnd._fields)) for part in PARTS
        }
        record = ShockPairRecord(
            **{name: row[name] for name in names},
            block=stored_json(row["block"], dict, f"block {label}"),
            **ends,
        )
        of_second = row["event_id"], row["pga_g"]
        pairs.append(StoredShockPair(row["id"], settings.get("made_on"), *of_second, record))
    return sorted(pairs, key=lambda pair: pair.record.natural_key)
