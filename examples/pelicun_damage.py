"""A damage run of pelicun with an exported block fragility, beside rbfrag's own answer.

    rbfrag export pelicun --p2 3 --kr 0.1 --name block --out block.csv
    python examples/pelicun_damage.py block.csv 0.6

pelicun (3.10 or newer) may live in an environment of its own: this script needs nothing of rbfrag.
It prints the share of realisations in which the block has toppled at the given PGV [m/s].
"""

from __future__ import annotations

import sys

import pandas as pd
from pelicun.assessment import Assessment

REALISATIONS = 20_000


def damage_share(table: str, pgv_m_s: float, seed: int = 7) -> float:
    """Return the share of realisations with the block toppled."""
    # the demand is a single component's; pelicun would multiply it by 1.2, as for the larger of two
    options = {"PrintLog": False, "Seed": seed, "NonDirectionalMultipliers": {"ALL": 1.0}}
    run = Assessment(options)
    place = pd.MultiIndex.from_tuples([("PGV", "0", "1")])
    demand = pd.DataFrame([["mps"]] + [[pgv_m_s]] * REALISATIONS, columns=place)
    demand.index = ["Units", *map(str, range(REALISATIONS))]
    run.demand.load_sample(demand)
    run.stories = 1
    block = {"Units": ["ea"], "Location": ["0"], "Direction": ["1"], "Theta_0": ["1"],
             "Family": [""], "Blocks": [1]}  # fmt: skip
    run.asset.load_cmp_model({"marginals": pd.DataFrame(block, index=["block"])})
    run.asset.generate_cmp_sample(REALISATIONS)
    run.damage.load_model_parameters([table], {"block"})
    run.damage.calculate()
    return float(run.damage.save_sample().xs("1", level="ds", axis=1).mean().iloc[0])


if __name__ == "__main__":
    print(damage_share(sys.argv[1], float(sys.argv[2])))
