"""What the dissertation claims, tested on a database:  python -m benchmarks.claims --db FILE"""

from __future__ import annotations

import json
from collections.abc import Sequence

from benchmarks.claims.claim import Claim, agreement_with_reference
from benchmarks.claims.pulses import pulses_scatter_like_records
from benchmarks.claims.records import (
    exponent_one,
    motion_set,
    one_to_one,
    pulses_as_bounds,
    rank_of_terms,
    variance_linear,
    vertical_is_irrelevant,
)
from benchmarks.page import ROOT, markdown, parser, report
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import motion_rows, suite_names
from rbfrag.db.queries import combination_table

PAGE = ROOT / "docs" / "evidence" / "claims.md"


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--db", required=True, help="database with critical values")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--json", action="store_true", help="print JSON instead of the table")
    chosen = options.parse_args(arguments)
    claims, about = tested(chosen.db, chosen.seed)
    if chosen.json:
        print(json.dumps([claim.as_dict() for claim in claims], indent=2, ensure_ascii=False))
        return
    rows = [
        [
            claim.claim,
            claim.statistic,
            f"{claim.value:.3g} ({claim.low:.3g} … {claim.high:.3g})",
            claim.rule,
            f"**{claim.verdict}**",
            f"{claim.n}, {claim.clusters}",
        ]
        for claim in claims
    ]
    headers = ["claim", "statistic", "value (95 % interval)", "rule", "verdict", "n, clusters"]
    report("claims", f"{markdown((headers, rows))}\n\n{about}", write=chosen.write, page=PAGE)


def tested(db: str, seed: int) -> tuple[list[Claim], str]:
    """Return all claims that the database can test, and a sentence about the data."""
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        table = combination_table(connection)
        with_vertical = combination_table(connection, vertical="with")
        every = {row.id for row in motion_rows(connection)}
        suites = {
            name: {row.id for row in motion_rows(connection, suite=name)}
            for name in suite_names(connection)
        }
    sets = {
        motion: name for name, motions in suites.items() if motions != every for motion in motions
    }
    claims = [
        *one_to_one(table, seed=seed),
        *rank_of_terms(table, seed=seed),
        *exponent_one(table, seed=seed),
        *variance_linear(table, seed=seed),
        *motion_set(table, sets, seed=seed),
        *pulses_as_bounds(table, seed=seed),
        *vertical_is_irrelevant(table, with_vertical, seed=seed),
        *pulses_scatter_like_records(table, seed=seed),
    ]
    motions, events = len(set(table.motion_id)), len(set(table.event_id))
    return claims, (
        f"{motions} horizontal motions of {events} earthquakes, both polarities, p² of "
        f"{', '.join(f'{p2:g}' for p2 in sorted(set(table.p2), reverse=True))} 1/s²; seed {seed}. "
        f"{agreement_with_reference(db)}"
    )


if __name__ == "__main__":
    main()
