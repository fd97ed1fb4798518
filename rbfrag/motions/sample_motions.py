"""Motions of the demonstration: recorded ones where they are installed."""

from __future__ import annotations

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

from rbfrag.motions.formats import rbfrag_csv
from rbfrag.motions.pulses import PULSE, reversal_pulse

SAMPLES_PACKAGE = "pyslammer"
SAMPLES_FOLDER = "sample_ground_motions"

PULSES_FOLDER = "rbfrag-demo-pulses"


def demo_motions(folder: Path) -> tuple[list[Path], str]:
    """Return the files of the demonstration, and a sentence about their origin.

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
        f"demonstration fits {len(files)} synthetic pulses, which are not earthquakes; the model "
        "shows the steps and predicts nothing."
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
            event = f"{PULSE} T={period_s:g} r={ratio:g}"
            pulse = reversal_pulse(0.4, ratio, period_s, 0.005)
            files.append(folder / f"pulse_{period_s:g}s_{ratio:g}.csv")
            lines = rbfrag_csv.write([replace(pulse, event=event, is_vertical=False)])
            files[-1].write_text("\n".join(lines) + "\n", encoding="utf-8")
    return files
