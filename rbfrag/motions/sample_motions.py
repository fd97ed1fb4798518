"""Motions of the demonstration: recorded ones where they are installed, or analytic pulses."""

from __future__ import annotations

import math
from dataclasses import replace
from importlib.util import find_spec
from itertools import product
from pathlib import Path

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.formats import rbfrag_csv
from rbfrag.motions.ground_motion import GroundMotion

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
    files = []
    for period_s, ratio in product((0.2, 0.5, 1.0, 2.0), (0.35, 0.65, 1.0)):
        event = f"{PULSE} T={period_s:g} r={ratio:g}"
        pulse = reversal_pulse(0.4, ratio, period_s, 0.005)
        files.append(pulses / f"pulse_{period_s:g}s_{ratio:g}.csv")
        lines = rbfrag_csv.write([replace(pulse, event=event, is_vertical=False)])
        files[-1].write_text("\n".join(lines) + "\n", encoding="utf-8")
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


PULSE = "reversal pulse"
"""Begin of the event of analytic pulses, by which fits tell them from recorded earthquakes."""

MOST_SAMPLES = 50_000_000


def reversal_pulse(amplitude_g: float, ratio: float, period_s: float, dt_s: float) -> GroundMotion:
    """Return two half-sine pulses of duration T/2 each, of amplitudes A and −rA, sampled.

    There are samples at every zero crossing and every peak; between them are straight lines.

    Args:
        amplitude_g: acceleration A at the first peak [g].
        ratio: r >= 0, size of the second pulse over that of the first.
        period_s: period T, the length of both pulses together [s].
        dt_s: longest sampling interval [s]; shortened where that is needed for a pulse to hold a
            whole, even number of intervals.
    """
    for name, value in (("amplitude", amplitude_g), ("ratio", ratio)):
        if not math.isfinite(value):
            raise InputError(f"the {name} of a pulse must be a finite number, not {value}")
    if ratio < 0.0:
        raise InputError(f"the ratio must not be negative, and is {ratio:g}: it sets the size only")
    for name, value in (("period", period_s), ("dt", dt_s)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(
                f"the {name} of a pulse must be a positive number of seconds, not {value}"
            )
    duration, interval = 0.5 * float(period_s), float(dt_s)
    if not duration / interval <= MOST_SAMPLES:
        raise InputError(
            f"a pulse of {duration:g} s sampled at {interval:g} s has more than {MOST_SAMPLES} "
            "samples: give a longer dt"
        )
    half = max(1, round(0.5 * duration / interval))
    if not math.isclose(2 * half * interval, duration, rel_tol=1e-12):
        half = math.ceil(0.5 * duration / interval)
        interval = 0.5 * duration / half
    rising = np.sin((0.5 * math.pi / half) * np.arange(half))
    # mirrored, so that the pulse is symmetric and its ends and peak are exact
    pulse = np.concatenate([rising, [1.0], rising[::-1]])
    samples = np.concatenate([float(amplitude_g) * pulse, (-ratio * amplitude_g) * pulse[1:]])
    return GroundMotion(samples, interval, event=PULSE)
