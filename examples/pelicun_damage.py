"""A damage run of pelicun with an exported block fragility, beside rbfrag's own answer.

    rbfrag export pelicun --p2 3 --kr 0.1 --name block --out block.csv
    python examples/pelicun_damage.py block.csv 0.6

pelicun (3.10 or newer) may live in an environment of its own: this script needs nothing of rbfrag.
It prints, for the first block of the table, the share of realisations in which each limit state is
reached at the given level of the table's measure [m/s, g].
"""

from __future__ import annotations

import sys

import pandas as pd
from pelicun.assessment import Assessment
from pelicun.base import EDP_to_demand_type

REALISATIONS = 200_000


def damage_shares(table: str, level: float, seed: int = 7) -> list[float]:
    """Return the shares of realisations that reach each limit state."""
    row = pd.read_csv(table, dtype={"ID": str}).iloc[0]
    demand, _, period = row["Demand-Type"].partition("|")
    name = EDP_to_demand_type[demand] + (f"_{period}" if period else "")
    run = Assessment({"PrintLog": False, "Seed": seed})
    place = pd.MultiIndex.from_tuples([(name, "0", "1")])
    sample = pd.DataFrame([[row["Demand-Unit"]]] + [[level]] * REALISATIONS, columns=place)
    sample.index = ["Units", *map(str, range(REALISATIONS))]
    run.demand.load_sample(sample)
    run.stories = 1
    block = {"Units": ["ea"], "Location": ["0"], "Direction": ["1"], "Theta_0": ["1"],
             "Family": [""], "Blocks": [1]}  # fmt: skip
    run.asset.load_cmp_model({"marginals": pd.DataFrame(block, index=[row["ID"]])})
    run.asset.generate_cmp_sample(REALISATIONS)
    run.damage.load_model_parameters([table], {row["ID"]})
    run.damage.calculate()
    reached = run.damage.save_sample()
    states = sorted(set(reached.columns.get_level_values("ds")) - {"0"})
    # a damage state is the last limit state that is reached
    state_fractions = [
        float(reached.xs(state, level="ds", axis=1).mean().iloc[0]) for state in states
    ]
    return [sum(state_fractions[i:]) for i in range(len(state_fractions))]


if __name__ == "__main__":
    print(*damage_shares(sys.argv[1], float(sys.argv[2])))
