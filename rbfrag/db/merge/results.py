"""Bringing in the results of another database: combinations, histories, spectra, models."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from sqlalchemy import RowMapping, select

from rbfrag.db.campaigns import (
    GRID_MEETS_POINT,
    INTERVAL_COLUMNS,
    POINT_COLUMNS,
    known_combinations,
)
from rbfrag.db.check.maps import BORDER_ERROR, ROTATION_ERROR, contradictions
from rbfrag.db.digest import NOT_DIGESTED
from rbfrag.db.insert import insert_if_new, insert_row, insert_rows, update_rows
from rbfrag.db.keys import key_of_row
from rbfrag.db.merge.ledger import Ledger, Merge
from rbfrag.db.model_file import ModelRow, encode_model
from rbfrag.db.models import model_rows
from rbfrag.db.rows import Interval, Point
from rbfrag.db.schema import (
    campaign,
    combination,
    fragility_model,
    motion,
    outcome_interval,
    response,
    shock_pair,
    simulation,
    toppling_spectrum,
)
from rbfrag.db.shock_pairs import PARTS, ShockEnd
from rbfrag.db.stored_combination import intervals_of, points_of

_AT_ONCE = 500
_COLUMNS = tuple(c.name for c in combination.c if c.name not in ("id", "digest"))
_INPUTS = (
    "natural_key", "polarity", "kind", "linear", "p2", "block", "settings", "numerics_version",
)  # fmt: skip
_INCIDENTAL = ("campaign_id", "motion_id", "vertical_motion_id", "warnings")
_OF_A_MAP = ("island_width", "kr_over_pga_resolved", "reentrant")
_VALUES = tuple(name for name in _COLUMNS if name not in (*_INPUTS, *_INCIDENTAL, *_OF_A_MAP))

AnyRow = RowMapping | Mapping[str, Any]


def merge_campaigns(merge: Merge) -> None:
    """Bring campaigns in; two are one when settings, versions and start are the same."""
    source, target, ledger = merge.source, merge.target, merge.ledger
    ids = merge.campaigns
    for theirs in source.execute(select(campaign).order_by(campaign.c.id)).mappings():
        key = {
            name: theirs[name]
            for name in ("settings", "numerics_version", "rbfrag_version", "started")
        }
        ours = target.execute(
            select(campaign.c.id, campaign.c.finished).filter_by(**key).order_by(campaign.c.id)
        ).first()
        if ours is not None:
            ledger.same["campaign"] += 1
            ids[theirs["id"]] = ours.id
            if ours.finished is None and theirs["finished"] is not None:
                values = {"finished": theirs["finished"]}
                update_rows(target, campaign, campaign.c.id == ours.id, values)
            continue
        ids[theirs["id"]] = insert_row(target, campaign, {**key, "finished": theirs["finished"]})
        ledger.added["campaign"] += 1


def merge_combinations(merge: Merge) -> None:
    """Bring combinations in, each with its map and its simulations."""
    last = 0
    while True:
        query = select(combination).where(combination.c.id > last).order_by(combination.c.id)
        portion = merge.source.execute(query.limit(_AT_ONCE)).mappings().all()
        if not portion:
            return
        last = portion[-1]["id"]
        rows = [{**row, "natural_key": _key_here(merge, row)} for row in portion]
        known = known_combinations(merge.target, (row["natural_key"] for row in rows))
        _add(merge, [row for row in rows if row["natural_key"] not in known])
        shared = [row for row in rows if row["natural_key"] in known]
        if shared:
            ids = {key: stored.id for key, stored in known.items()}
            _compare(merge, shared, ids)


def _add(merge: Merge, rows: Sequence[Mapping[str, Any]]) -> None:
    if not rows:
        return
    target, ledger = merge.target, merge.ledger
    values = []
    for row in rows:
        own = {
            **row,
            "campaign_id": merge.campaigns[row["campaign_id"]],
            **_motions_here(merge, row),
        }
        values.append(tuple(own[name] for name in _COLUMNS))
    insert_rows(target, combination, _COLUMNS, values)
    ledger.added["combination"] += len(rows)
    ids = known_combinations(target, (row["natural_key"] for row in rows))
    here = {row["id"]: ids[row["natural_key"]].id for row in rows}
    intervals = _moved(intervals_of(merge.source, list(here)), here)
    insert_rows(target, outcome_interval, INTERVAL_COLUMNS, intervals)
    ledger.added["outcome_interval"] += len(intervals)
    points = _moved(points_of(merge.source, list(here)), here)
    insert_rows(target, simulation, POINT_COLUMNS, points)
    ledger.added["simulation"] += len(points)


def _moved(
    theirs: Mapping[int, Sequence[tuple[Any, ...]]], here: Mapping[int, int]
) -> list[tuple[Any, ...]]:
    return [(here[their_id], *row) for their_id, rows in theirs.items() for row in rows]


def _motions_here(merge: Merge, row: AnyRow) -> dict[str, int | None]:
    names = ("motion_id", "vertical_motion_id")
    return {name: None if row[name] is None else merge.motions[row[name]] for name in names}


def _key_here(merge: Merge, row: AnyRow) -> str:
    """Return the natural key that a combination there has with the samples here."""
    inputs = (row["motion_id"], row["vertical_motion_id"])
    if not merge.other_bits.keys() & set(inputs):
        return str(row["natural_key"])
    query = select(motion.c.id, motion.c.samples_sha256, motion.c.dt_s)
    rows = merge.source.execute(query.where(motion.c.id.in_([i for i in inputs if i]))).all()
    shas = {one.id: merge.other_bits.get(one.id, one.samples_sha256) for one in rows}
    (dt_s,) = {one.dt_s for one in rows if one.id == row["motion_id"]}
    return key_of_row(row, shas[row["motion_id"]], dt_s, shas.get(row["vertical_motion_id"]))


def _compare(merge: Merge, rows: Sequence[Mapping[str, Any]], known: Mapping[str, int]) -> None:
    source, target, ledger = merge.source, merge.target, merge.ledger
    our_ids = [known[row["natural_key"]] for row in rows]
    query = select(combination).where(combination.c.id.in_(our_ids))
    ours_by_key = {row["natural_key"]: row for row in target.execute(query).mappings()}
    their_ids = [row["id"] for row in rows]
    maps = intervals_of(target, our_ids), intervals_of(source, their_ids)
    runs = points_of(target, our_ids), points_of(source, their_ids)
    more: list[tuple[object, ...]] = []
    intervals: list[tuple[object, ...]] = []
    for theirs in rows:
        ours = ours_by_key[theirs["natural_key"]]
        name = f"{theirs['natural_key'][:12]}…"
        here_map, there_map = maps[0][ours["id"]], maps[1][theirs["id"]]
        both_mapped = bool(here_map and there_map)
        compared = (*_VALUES, *_OF_A_MAP) if both_mapped else _VALUES
        exact = all(ours[c] == theirs[c] for c in compared) and (
            not both_mapped or here_map == there_map
        )
        if not exact and not _within_error(name, ours, theirs, here_map, there_map, ledger):
            continue
        ledger.same["combination"] += 1
        ledger.within_error += not exact
        if there_map and not here_map:
            intervals += ((ours["id"], *interval) for interval in there_map)
            columns = {column: theirs[column] for column in _OF_A_MAP}
            update_rows(target, combination, combination.c.id == ours["id"], columns)
        band = None if exact else _band(ours, theirs)
        points = (runs[0][ours["id"]], runs[1][theirs["id"]])
        more += ((ours["id"], *point) for point in _more_points(name, *points, band, ledger))
    insert_rows(target, outcome_interval, INTERVAL_COLUMNS, intervals)
    insert_rows(target, simulation, POINT_COLUMNS, more, on_conflict=GRID_MEETS_POINT)
    ledger.added["outcome_interval"] += len(intervals)
    ledger.added["simulation"] += len(more)


def _within_error(
    name: str,
    ours: AnyRow,
    theirs: AnyRow,
    here_map: Sequence[Interval],
    there_map: Sequence[Interval],
    ledger: Ledger,
) -> bool:
    if ours["status"] != theirs["status"]:
        ledger.conflict("combination", name, "status", ours["status"], theirs["status"])
        return False
    if ours["status"] == "found":
        low = max(_lower(ours), _lower(theirs))
        high = min(_upper(ours), _upper(theirs))
        if low > high * (1.0 + BORDER_ERROR):
            here, there = ours["kr_over_pga"], theirs["kr_over_pga"]
            ledger.conflict("combination", name, "kr_over_pga", here, there)
            return False
    for bottom, top, here, there in contradictions(here_map, there_map):
        column = f"the outcome from kr/PGA {bottom!r} to {top!r}"
        ledger.conflict("combination", name, column, here, there)
        return False
    return True


def _lower(row: AnyRow) -> float:
    return float(row["kr_over_pga"] if row["lower"] is None else row["lower"])


def _upper(row: AnyRow) -> float:
    return float(row["kr_over_pga"] if row["upper"] is None else row["upper"])


def _band(ours: AnyRow, theirs: AnyRow) -> tuple[float, float] | None:
    """Return where runs of the other search belong to its bracket, not to ours."""
    if ours["status"] != "found":
        return None
    low = min(_lower(ours), _lower(theirs))
    high = max(_upper(ours), _upper(theirs))
    return low * (1.0 - BORDER_ERROR), high * (1.0 + BORDER_ERROR)


def _more_points(
    name: str,
    here: Sequence[Point],
    there: Sequence[Point],
    band: tuple[float, float] | None,
    ledger: Ledger,
) -> list[Point]:
    known = {point.kr_over_pga: point for point in here}
    numbered = {point.grid: point for point in here if point.grid is not None}
    more: list[Point] = []
    for point in there:
        k, number = point.kr_over_pga, point.grid
        # another processor may have given a block of the grid a strength of other last bits
        mine = known.get(k) if number is None else numbered.get(number, known.get(k))
        in_band = band is not None and band[0] <= k <= band[1]
        if mine is None:
            if number is not None or not in_band:
                more.append(point)
            continue
        if number is not None and mine.grid is None:
            more.append(mine._replace(grid=number))
        if _differ(point.displacement_m, mine.displacement_m):
            column = f"displacement_m at ky/PGA {k!r}"
            ledger.conflict("simulation", name, column, mine.displacement_m, point.displacement_m)
        if point.outcome != mine.outcome:
            # another processor's last bits turn a sensitive outcome as other motions do
            if not (in_band or mine.sensitive or point.sensitive):
                column = f"the outcome at kr/PGA {k!r}"
                ledger.conflict("simulation", name, column, mine.outcome, point.outcome)
        # where outcomes may be sensitive the size of peaks may be chaotic
        elif mine.sensitive is None and _differ(point.theta_n, mine.theta_n):
            column = f"theta_n at kr/PGA {k!r}"
            ledger.conflict("simulation", name, column, mine.theta_n, point.theta_n)
    return more


def _differ(one: float | None, other: float | None) -> bool:
    if one is None or other is None:
        return False
    return not math.isclose(one, other, rel_tol=ROTATION_ERROR, abs_tol=1e-12)


def merge_spectra(merge: Merge) -> None:
    """Bring toppling spectra in."""
    source, target, ledger = merge.source, merge.target, merge.ledger
    for theirs in source.execute(select(toppling_spectrum)).mappings():
        values = {**theirs, "motion_id": merge.motions[theirs["motion_id"]]}
        del values["digest"]
        if insert_if_new(target, toppling_spectrum, values):
            ledger.added["toppling_spectrum"] += 1
            continue
        ledger.same["toppling_spectrum"] += 1
        key = {name: values[name] for name in ("motion_id", "polarity", "p2", "numerics_version")}
        here = target.execute(select(toppling_spectrum.c.x_m_s).filter_by(**key)).scalar_one()
        if not math.isclose(here, values["x_m_s"], rel_tol=1e-9, abs_tol=1e-15):
            row = f"of motion {key['motion_id']} at p2 {key['p2']:g}, {key['polarity']}"
            ledger.conflict("toppling_spectrum", row, "x_m_s", here, values["x_m_s"])


def merge_responses(merge: Merge) -> None:
    """Bring histories in."""
    source, target, ledger = merge.source, merge.target, merge.ledger
    for their_id in list(source.scalars(select(response.c.id).order_by(response.c.id))):
        theirs = source.execute(select(response).where(response.c.id == their_id)).mappings().one()
        if merge.other_bits.keys() & {theirs["motion_id"], theirs["vertical_motion_id"]}:
            ledger.notes.append(
                f"left out: history {theirs['natural_key'][:12]}… of samples whose last bits "
                "are other here: rbfrag simulate  makes it again"
            )
            continue
        values = {name: value for name, value in theirs.items() if name not in NOT_DIGESTED}
        values |= _motions_here(merge, theirs)
        if insert_if_new(target, response, values):
            ledger.added["response"] += 1
            continue
        ledger.same["response"] += 1
        same_key = response.c.natural_key == theirs["natural_key"]
        ours = target.execute(select(response).where(same_key)).mappings().one()
        name = f"{theirs['natural_key'][:12]}…"
        here, there = ours["peak_theta_n"], theirs["peak_theta_n"]
        if ours["outcome"] != theirs["outcome"]:
            ledger.conflict("response", name, "outcome", ours["outcome"], theirs["outcome"])
        elif here != there and (
            None in (here, there) or not math.isclose(here, there, rel_tol=ROTATION_ERROR)
        ):
            ledger.conflict("response", name, "peak_theta_n", here, there)
        elif any(ours[c] != theirs[c] for c in ("time_s", "theta_rad", "theta_dot_rad_s")):
            ledger.within_error += 1


def merge_shock_pairs(merge: Merge) -> None:
    """Bring in what two motions do to blocks."""
    source, target, ledger = merge.source, merge.target, merge.ledger
    for theirs in source.execute(select(shock_pair).order_by(shock_pair.c.id)).mappings():
        both = {theirs["first_motion_id"], theirs["second_motion_id"]}
        if merge.other_bits.keys() & both:
            ledger.notes.append(
                f"left out: pair of motions {theirs['natural_key'][:12]}… of samples whose last "
                "bits are other here: a campaign of sequences makes it again"
            )
            continue
        values = {name: value for name, value in theirs.items() if name not in NOT_DIGESTED}
        values["campaign_id"] = merge.campaigns[theirs["campaign_id"]]
        for name in ("first_motion_id", "second_motion_id"):
            values[name] = merge.motions[theirs[name]]
        if insert_if_new(target, shock_pair, values):
            ledger.added["shock_pair"] += 1
            continue
        ledger.same["shock_pair"] += 1
        same_key = shock_pair.c.natural_key == theirs["natural_key"]
        ours = target.execute(select(shock_pair).where(same_key)).mappings().one()
        _compare_ends(f"{theirs['natural_key'][:12]}…", ours, theirs, ledger)


def _compare_ends(name: str, ours: AnyRow, theirs: AnyRow, ledger: Ledger) -> None:
    if ours["pairing"] != theirs["pairing"]:
        ledger.keep("shock_pair", name, "pairing", ours["pairing"], theirs["pairing"])
    columns = [f"{part}_{end}" for part in PARTS for end in ShockEnd._fields]
    for column in columns:
        here, there = ours[column], theirs[column]
        differs = here != there
        if isinstance(here, float) and isinstance(there, float):
            differs = _differ(here, there)
        if differs:
            ledger.conflict("shock_pair", name, column, here, there)
            return
    ledger.within_error += any(ours[column] != theirs[column] for column in columns)


def merge_models(merge: Merge) -> None:
    """Bring models in; of two that differ under one name, the other's gets a number.

    A model "m" that differs from the "m" here is stored as "m-2", or the first number that is
    free. Chosen defaults stay; a database without models of a kind takes the other's choice.
    """
    source, target, ledger = merge.source, merge.target, merge.ledger
    ours = {row.name: row for row in model_rows(target)}
    had = {row.kind for row in ours.values()}
    chosen = set(source.scalars(select(fragility_model.c.name).where(fragility_model.c.is_default)))
    for theirs in model_rows(source):
        name, number = theirs.name, 1
        while name in ours and not _same(ours[name], theirs):
            number += 1
            name = f"{theirs.name}-{number}"
        if name in ours:
            ledger.same["fragility_model"] += 1
            continue
        is_default = theirs.name in chosen and theirs.kind not in had
        row = replace(theirs, name=name, is_default=is_default)
        insert_row(target, fragility_model, encode_model(row))
        ours[name] = row
        ledger.added["fragility_model"] += 1
        if name != theirs.name:
            ledger.notes.append(
                f"there is another model {theirs.name!r} here: theirs is stored as {name!r}"
            )


def _same(one: ModelRow, other: ModelRow) -> bool:
    left, right = (
        encode_model(replace(row, name="-", is_default=False, created="")) for row in (one, other)
    )
    return left == right
