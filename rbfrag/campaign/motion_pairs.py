"""Motion pairs of a campaign of sequences: consecutive shocks at one station, and random pairs."""

from __future__ import annotations

import hashlib
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from heapq import nsmallest
from itertools import pairwise

from sqlalchemy import Connection

from rbfrag.db.motions import times_of_earthquakes
from rbfrag.db.rows import MotionRow
from rbfrag.db.shock_pairs import Pairing
from rbfrag.errors import InputError


@dataclass(frozen=True)
class MotionPair:
    """Two horizontal motions, one after the other.

    Args:
        pairing: ``station`` for two shocks of one station, ``drawn`` for others.
    """

    first: MotionRow
    second: MotionRow
    pairing: Pairing


def motion_pairs(
    connection: Connection, rows: Sequence[MotionRow], *, seed: int, draws: int
) -> tuple[MotionPair, ...]:
    """Return the pairs of a campaign, the longest first.

    Args:
        rows: its horizontal motions.
        draws: how many first motions are drawn for each that is no later shock of a station.

    Raises:
        InputError: there are no two earthquakes.
    """
    real = shocks_of_stations(rows, times_of_earthquakes(connection))
    pairs = (*real, *drawn_pairs(rows, {pair.second.id for pair in real}, seed, draws))
    if not pairs:
        raise InputError(
            "no motions of two earthquakes: add some with a metadata table that gives the "
            "earthquakes"
        )

    def longest_first(pair: MotionPair) -> tuple[int, str, str]:
        npts = pair.first.npts + pair.second.npts
        return -npts, pair.second.sha256, pair.first.sha256

    return tuple(sorted(pairs, key=longest_first))


def shocks_of_stations(
    rows: Iterable[MotionRow], times: Mapping[str, str]
) -> tuple[MotionPair, ...]:
    """Return each shock with its predecessor, at one station in one direction.

    Their order is that of the times that the metadata state; where these are equal, such as one
    year, that of the clocks of the files if all tell the time, and else that of the ids of the
    events, in which catalogues number the shocks of a sequence.

    Args:
        times: time or year by event id, of earthquakes that metadata state.
    """
    by_station: defaultdict[tuple[str, object], list[MotionRow]] = defaultdict(list)
    for row in rows:
        if row.station and not row.event_guessed and row.event_id in times:
            direction = row.component if row.orientation_deg is None else row.orientation_deg
            by_station[row.station, direction].append(row)
    pairs = []
    for shocks in by_station.values():
        clocks = all(row.start_time for row in shocks)
        by_event = {row.event_id: row for row in sorted(shocks, key=lambda row: row.sha256)}
        in_order = sorted(
            by_event.values(),
            key=lambda row: (
                times[row.event_id],
                (row.start_time or "") if clocks else "",
                _numbered(row.event_id),
            ),
        )
        pairs += [MotionPair(first, other, "station") for first, other in pairwise(in_order)]
    return tuple(pairs)


def drawn_pairs(
    rows: Sequence[MotionRow], without: set[int], seed: int, draws: int
) -> tuple[MotionPair, ...]:
    """Return random pairs: each second motion after motions of other earthquakes.

    Drawn are the first motions of least hash with the second (Thaler and Ravishankar 1998,
    IEEE/ACM Transactions on Networking 6(1), 1-14): the draw depends on samples and seed alone,
    and a motion that is added later changes only the pairs that it is drawn for.

    Args:
        without: ids of motions that are no second ones here.
        draws: first motions for each second one.
    """
    pairs = []
    for second in rows:
        candidates = [row for row in rows if row.event_id != second.event_id]
        if second.id not in without:
            begun = f"{seed}:{second.sha256}:"
            firsts = nsmallest(draws, candidates, key=lambda row: _hash(begun + row.sha256))
            pairs += [MotionPair(first, second, "drawn") for first in firsts]
    return tuple(pairs)


def _hash(text: str) -> bytes:
    return hashlib.sha256(text.encode("ascii")).digest()


def _numbered(event_id: str) -> list[tuple[int, str]]:
    """Return a sort key that puts shock 2 before shock 10."""
    parts = re.findall(r"\d+|\D+", event_id)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]
