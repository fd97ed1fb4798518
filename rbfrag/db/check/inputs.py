"""Check of stored results against their inputs; histories and motion pairs in full."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

from sqlalchemy import Connection, RowMapping, func, select

from rbfrag.db.check.damage import COMPUTE_AGAIN, Damage
from rbfrag.db.keys import key_of_row
from rbfrag.db.motions import samples_of_motions
from rbfrag.db.schema import campaign, response, shock_pair
from rbfrag.errors import InputError

_SERIES = ("time_s", "theta_rad", "theta_dot_rad_s", "k_h", "k_v")

Inputs = tuple[Mapping[int, tuple[str, float]], Mapping[int, str]]
"""The samples of each motion, as for a natural key, and the numerics of each campaign."""


def stored_inputs(connection: Connection) -> Inputs:
    """Return the inputs that stored results refer to."""
    rows = connection.execute(select(campaign.c.id, campaign.c.numerics_version))
    return samples_of_motions(connection), {row.id: row.numerics_version for row in rows}


def input_problems(row: RowMapping, inputs: Inputs) -> Iterator[str]:
    """Yield problems with the key or the numerics version of a combination, history or pair."""
    samples, numerics = inputs
    motions = {row[name] for name in row if name.endswith("motion_id")} - {None}
    unreadable = []
    for name in ("block", "settings"):
        try:
            json.loads(row.get(name) or "{}")
        except ValueError as error:
            unreadable.append(f"its {name} cannot be read: {error}")
    yield from unreadable
    # a motion that is not there is a broken reference, which is its own finding
    if not unreadable and motions <= samples.keys():
        try:
            is_its_key = key_of_row(row, samples) == row["natural_key"]
        except InputError:  # a number that is not finite
            is_its_key = False
        if not is_its_key:
            yield "its natural key is not the hash of its inputs"
    of_campaign = numerics.get(row.get("campaign_id", 0), row["numerics_version"])
    if of_campaign != row["numerics_version"]:
        yield f"numerics version {row['numerics_version']}, its campaign says {of_campaign}"


def check_responses(connection: Connection) -> Iterator[Damage]:
    """Yield histories with a wrong key or length."""
    inputs = stored_inputs(connection)
    columns = [column for column in response.c if column.name not in _SERIES]
    lengths = [func.length(response.c[name]).label(name) for name in _SERIES]
    query = select(*columns, *lengths).order_by(response.c.id)
    for row in connection.execute(query).mappings():
        problems = [*input_problems(row, inputs)]
        problems += (
            f"{name} holds {row[name]} bytes, not 8 x {row['npts']}"
            for name in _SERIES
            if row[name] != 8 * row["npts"]
        )
        for problem in problems:
            yield Damage("response", str(row["id"]), problem, COMPUTE_AGAIN)


def check_shock_pairs(connection: Connection) -> Iterator[Damage]:
    """Yield motion pairs with a wrong key or impossible values."""
    inputs = stored_inputs(connection)
    for row in connection.execute(select(shock_pair).order_by(shock_pair.c.id)).mappings():
        problems = [*input_problems(row, inputs)]
        if row["second_outcome"] is not None and row["first_outcome"] != "stable":
            problems.append(
                f"the first motion ends as {row['first_outcome']}, yet the second is said to find "
                "the block at rest"
            )
        for problem in problems:
            yield Damage("shock_pair", str(row["id"]), problem, COMPUTE_AGAIN)
