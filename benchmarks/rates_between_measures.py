"""Failure rates from an event set by other intensity measures over those by PGV.

python benchmarks/rates_between_measures.py FOLDER, one job's exports of the OpenQuake engine with
PGV, PGA and SA(1.0).
"""

from __future__ import annotations

import sys

import numpy as np

from rbfrag.exchange.event_losses import losses
from rbfrag.exchange.openquake_events import job_files, read_events

RAREST = 1e-4
"""Rates below are not resolved by the events [1/a]."""

ROUTES = {
    "SA(1.0)": {"imt": ("SA(1.0)",)},
    "PGA": {"imt": ("PGA",)},
    "PGV and PGA": {"imt": ("PGV", "PGA"), "model": "toppling-pgv_pga"},
    "PGA and SA(1.0)": {"imt": ("PGA", "SA(1.0)"), "model": "toppling-pga"},
}


def main(folder: str) -> None:
    """Print the ratios of one job."""
    sites = read_events(job_files(folder)).site_ids
    p2, kr = np.meshgrid([0.3, 1.0, 3.0, 10.0, 20.0, 30.0], [0.03, 0.05, 0.1, 0.2, 0.3, 0.4])
    blocks = {
        "p2_1_s2": np.tile(p2.ravel(), len(sites)),
        "kr": np.tile(kr.ravel(), len(sites)),
        "site_id": np.repeat(np.array(sites, dtype=object), p2.size),
    }

    def rates(**about: object) -> np.ndarray:
        return losses(folder, blocks, component="rotd50", expected=True, **about).block_rates[0]

    velocity = rates()
    is_shaken = velocity > RAREST
    print(f"{is_shaken.sum()} blocks that fail more than {RAREST:g} times a year by PGV")
    for name, about in ROUTES.items():
        ratio = np.log(rates(**about)[is_shaken] / velocity[is_shaken])
        print(f"{name:20}{np.exp(ratio.mean()):6.2f}  sd of ln {ratio.std():.2f}")


if __name__ == "__main__":
    main(sys.argv[1])
