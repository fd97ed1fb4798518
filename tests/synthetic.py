"""Small made-up accelerograms for tests that need files but no earthquakes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rbfrag.vocabulary.quantities import MEASURES


def shaking(seed: int, npts: int = 600, dt_s: float = 0.02) -> NDArray[np.float64]:
    """Enveloped noise with a long-period pulse: topples slender blocks of every size."""
    rng = np.random.default_rng(seed)
    t = np.arange(npts) * dt_s
    noise = np.convolve(rng.standard_normal(npts), np.hanning(9), mode="same")
    envelope = np.exp(-(((t - 5.0) / 2.0) ** 2))
    samples = envelope * (0.1 * noise + 0.3 * np.sin(2.0 * np.pi * t / (0.6 + 0.1 * (seed % 7))))
    samples[[0, -1]] = 0.0
    return samples


def write_at2(
    path: Path,
    samples: NDArray[np.float64],
    dt_s: float = 0.02,
    *,
    event: str = "SOMEWHERE 01/02/03",
    station: str = "STA",
    component: str = "090",
) -> Path:
    """Write samples as a PEER AT2 file."""
    lines = [
        "PEER STRONG MOTION DATABASE RECORD",
        f"{event}, {station}, {component}",
        "ACCELERATION TIME HISTORY IN UNITS OF G",
        f"NPTS= {samples.size}, DT= {dt_s:.5f} SEC",
    ]
    values = [f"{value: .7E}" for value in samples]
    lines += ["  ".join(values[i : i + 5]) for i in range(0, len(values), 5)]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_suite(folder: Path, count: int = 6) -> Path:
    """Write several made-up records of different events into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for seed in range(count):
        write_at2(
            folder / f"record{seed}.AT2",
            shaking(seed),
            event=f"EVENT {seed // 2}",
            station=f"S{seed}",
        )
    return folder


def unknown_measures(n: int) -> dict[str, np.ndarray]:
    """Return unknown measures of n motions: spectrum, energy and magnitude."""
    rest = (name for name in MEASURES if name not in ("pga_g", "pgv_m_s", "pgd_m", "tm_s"))
    return {name: np.full(n, np.nan) for name in rest}
