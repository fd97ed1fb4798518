"""Hazard curves and blocks of a region, made up, to try rates of many blocks.

    python examples/region.py [--blocks 100000] [--sites 10000] [--out FOLDER]

Writes curves.csv, mean hazard curves of PGV in the form of the OpenQuake engine, and blocks.csv,
rectangles with the places where they stand.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

PGV_CM_S = np.geomspace(0.5, 500.0, 40)
YEARS = 50.0
ABOUT = f"kind='mean', investigation_time={YEARS}, imt='PGV'"


def write_curves(path: Path, lon: np.ndarray, lat: np.ndarray, random: np.random.Generator) -> None:
    """Write a curve of each site, stronger at some than at others."""
    bend = 100.0 * random.uniform(0.5, 1.5, lon.size)[:, None]
    rate = 0.2 * (PGV_CM_S / 0.5) ** -1.0 * np.exp(-((PGV_CM_S / bend) ** 1.2))
    poe = -np.expm1(-rate * YEARS)
    with path.open("w") as file:
        levels = ",".join(f"poe-{level:.7g}" for level in PGV_CM_S.tolist())
        file.write(f'#,,,,"{ABOUT}"\ncustom_site_id,lon,lat,depth,{levels}\n')
        for i, row in enumerate(poe.tolist()):
            cells = ",".join(f"{value:.6E}" for value in row)
            file.write(f"c{i:05d},{lon[i]:.5f},{lat[i]:.5f},0.0,{cells}\n")


def main() -> None:
    """Write both files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blocks", type=int, default=100_000)
    parser.add_argument("--sites", type=int, default=10_000)
    parser.add_argument("--out", type=Path, default=Path())
    chosen = parser.parse_args()
    random = np.random.default_rng(1)
    lon, lat = random.uniform(10.0, 12.0, chosen.sites), random.uniform(45.0, 46.5, chosen.sites)
    chosen.out.mkdir(parents=True, exist_ok=True)
    write_curves(chosen.out / "curves.csv", lon, lat, random)
    near = random.integers(chosen.sites, size=chosen.blocks)
    apart = random.normal(0.0, 0.003, (2, chosen.blocks))
    height = random.uniform(0.5, 4.0, chosen.blocks)
    width = height * random.uniform(0.05, 0.5, chosen.blocks)
    with (chosen.out / "blocks.csv").open("w") as file:
        file.write("block_id,lon,lat,height_m,width_m\n")
        columns = (lon[near] + apart[0], lat[near] + apart[1], height, width)
        for i, (x, y, h, w) in enumerate(zip(*columns, strict=True)):
            file.write(f"b{i:06d},{x:.5f},{y:.5f},{h:.2f},{w:.3f}\n")


if __name__ == "__main__":
    main()
