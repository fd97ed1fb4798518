"""Figure of the response spectrum of a motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.readers import MotionLike, as_motion
from rbfrag.motions.response_spectrum import (
    DirectionalPeaks,
    spectral_accelerations,
)
from rbfrag.plots import canvas
from rbfrag.plots.canvas import as_written
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S

_LINE, _RECORDING = "#1f4e79", {50: ("#d98c1f", "s"), 100: ("#8c2d4f", "^")}
_POINTS = 121
_LOWEST_PART = 1e-4
"""Part of the highest value shown below which the curve may leave the sheet."""


@canvas.in_own_style
def plot_response_spectrum(
    motion: MotionLike,
    out: canvas.Out = None,
    *,
    recording: Sequence[DirectionalPeaks] = (),
) -> canvas.Picture:
    """Draw the pseudo-spectral acceleration of a motion over the period, 5 % damped.

    Args:
        motion: the motion or its file.
        out: file to write (.png, .pdf, .svg); None for a picture that a notebook shows.
        recording: RotD50 and RotD100 of its recording, at the periods that are stored.
    """
    canvas.plot_path(out)
    ground = as_motion(motion)
    if ground.pga_g == 0.0:
        raise InputError("the ground is at rest in this motion: nothing to draw")
    figure = canvas.new_figure(7.2, 4.6)
    axes = figure.add_subplot()
    ends = SPECTRUM_PERIODS_S[0], SPECTRUM_PERIODS_S[-1]
    periods = np.geomspace(*ends, _POINTS)
    samples = ground.acceleration_g, ground.interval_s
    curve = np.array(spectral_accelerations(*samples, periods.tolist()))
    axes.plot(periods, curve, color=_LINE, lw=1.7, label=as_written(ground.label, 42))
    axes.plot(SPECTRUM_PERIODS_S, ground.spectrum_g, "o", ms=3.5, color=_LINE)
    highest = float(np.max(curve))
    for peaks in recording:
        colour, marker = _RECORDING[peaks.percentile]
        label = f"RotD{peaks.percentile} of the recording"
        axes.plot(SPECTRUM_PERIODS_S, peaks.sa_g, marker, color=colour, ms=4.5, label=label)
        highest = max(highest, *peaks.sa_g)
    canvas.logarithmic(axes, (1.0, 2.0, 5.0), (1.0, 2.0, 5.0))
    axes.set_xlim(*ends)
    drawn = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in axes.lines])
    axes.set_ylim(max(_LOWEST_PART * highest, 0.8 * float(np.min(drawn))), 1.3 * highest)
    axes.set_xlabel("period [s]")
    axes.set_ylabel("spectral acceleration, 5 % damping [g]")
    canvas.light_grid(axes, which="both")
    canvas.legend_below(figure, 2)
    return canvas.save_figure(figure, out)
