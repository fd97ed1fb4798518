"""The motions of the demonstration: recorded ones where they are installed."""

from __future__ import annotations

import csv
from importlib.util import find_spec
from pathlib import Path

from rbfrag.motions.pulses import reversal_pulse

SAMPLES_PACKAGE = "pyslammer"
SAMPLES_FOLDER = "sample_ground_motions"

PULSES_FOLDER = "rbfrag-demo-pulses"


def demo_motions(folder: Path) -> tuple[list[Path], str]:
    """Return the files of the demonstration, and a sentence about where they come from.

    Args:
        folder: where analytic pulses are written when no records are installed.

    The sample records belong to the package pyslammer (GPL-3.0). Its folder is found without
    running any of its code, and only its data files are read.
    """
    samples = sample_folder()
    if samples is not None:
        count = len(list(samples.glob("*.csv")))
        return [samples], (
            f"{count} recorded motions, the data files of the package {SAMPLES_PACKAGE}"
        )
    pulses = folder / PULSES_FOLDER
    pulses.mkdir(exist_ok=True)
    files = _write_pulses(pulses)
    return files, (
        "The sample records are not installed (pip install 'rbfrag[samples]'): the "
        f"demonstration uses {len(files)} analytic pulses instead, which are no earthquakes; "
        "its fit means nothing beyond showing the steps."
    )


def sample_folder() -> Path | None:
    """Return the folder of the installed sample records, or None."""
    spec = find_spec(SAMPLES_PACKAGE)
    for place in (spec.submodule_search_locations or []) if spec is not None else []:
        folder = Path(place) / SAMPLES_FOLDER
        if folder.is_dir():
            return folder
    return None


def _write_pulses(folder: Path) -> list[Path]:
    files = []
    for period_s in (0.2, 0.5, 1.0, 2.0):
        for ratio in (0.35, 0.65, 1.0):
            pulse = reversal_pulse(0.4, ratio, period_s, 0.005)
            name = f"Pulse T={period_s:g} r={ratio:g}"
            files.append(folder / f"pulse_{period_s:g}s_{ratio:g}.csv")
            with files[-1].open("w", newline="", encoding="utf-8") as file:
                file.write(f"# {name}\n# Time (s),Acceleration (g's)\n")
                writer = csv.writer(file)
                for i, value in enumerate(pulse.acceleration_g.tolist()):
                    writer.writerow((f"{i * 0.005:.3f}", repr(value)))
    return files
