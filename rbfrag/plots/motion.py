"""The plot of a block that is displaced: acceleration against strength, and where it went."""

from __future__ import annotations

import os

import numpy as np

from rbfrag.errors import InputError
from rbfrag.plots.canvas import new_figure, save_figure
from rbfrag.plots.response import BLOCK, GROUND, QUIET_AFTER_S, QUIET_BEFORE_S, STRENGTH
from rbfrag.solver.results import Outcome, Response, ResponseHistory

ROTATION = "#b7791f"


def plot_motion(
    response: Response,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    reverse: bool = False,
) -> None:
    """Draw the response of a sliding, slumping or confined block and write it to `path`.

    The upper panel shows the driving acceleration k_h/(1 + k_v) against the strength where
    the block is: it gains speed down the slope where the first is above the second. The lower
    panel shows the displacement along the base, and the rotation of a block that rotates.

    Args:
        response: a response asked for with its history.
        path: .png, .pdf or .svg.
        title: name of the motion.
        reverse: polarity was reversed, for the title.

    Raises:
        InputError: no history, an unknown suffix, a folder that cannot be written.
        MissingExtraError: matplotlib is not installed.
    """
    history = response.history
    if history is None or history.displacement_m is None or history.strength_g is None:
        raise InputError("this response holds no displacements in time: ask for its history")
    drive = history.k_h / (1.0 + history.k_v)

    figure = new_figure(width_in=7.5, height_in=5.6)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.25, 1.0])
    upper.plot(history.time_s, drive, color=GROUND, lw=0.7, label="ground: $k_h/(1+k_v)$")
    upper.plot(
        history.time_s, history.strength_g, color=STRENGTH, lw=1.3, label="strength of the block"
    )
    top = 1.15 * max(float(np.abs(drive).max()), float(history.strength_g[0]))
    upper.set_ylim(-top, 1.25 * top)
    upper.axhline(0.0, color="black", lw=0.5)
    upper.set_ylabel("acceleration [g]")
    upper.legend(loc="upper right", fontsize=8, ncols=2, framealpha=0.9)

    largest = float(np.abs(history.displacement_m).max())
    factor, unit = (
        (1000.0, "mm") if largest < 0.01 else (100.0, "cm") if largest < 1.0 else (1.0, "m")
    )
    lower.plot(history.time_s, factor * history.displacement_m, color=BLOCK, lw=1.4)
    lower.set_ylabel(f"displacement [{unit}]", color=BLOCK)
    lower.set_xlabel("time [s]")
    least = float(history.displacement_m.min())
    lower.set_ylim(*_around(factor * float(history.displacement_m.max()), factor * least))
    if response.peak_theta_rad is not None or np.any(history.theta_rad):
        right = lower.twinx()
        right.plot(history.time_s, np.degrees(history.theta_rad), color=ROTATION, lw=1.1, ls="--")
        right.set_ylabel("rotation [deg]", color=ROTATION)
        right.set_ylim(*_around(float(np.degrees(history.theta_rad).max()), 0.0))
    lower.set_xlim(*_window(history, response))
    for axes in (upper, lower):
        axes.grid(visible=True, lw=0.3, alpha=0.6)
    polarity = ", reversed" if reverse else ""
    figure.suptitle(f"{title}{polarity}\n{_verdict(response)}", fontsize=10)
    save_figure(figure, path)


def _window(history: ResponseHistory, response: Response) -> tuple[float, float]:
    """Show the whole motion of the block with a little rest on both sides."""
    first, last = float(history.time_s[0]), float(history.time_s[-1])
    if response.started_s is None or response.stopped_s is None:
        return first, max(last, first + 1e-3)
    return response.started_s - QUIET_BEFORE_S, min(response.stopped_s + QUIET_AFTER_S, last)


def _around(largest: float, least: float) -> tuple[float, float]:
    """Return limits that leave some air, and put zero at one height on both axes."""
    span = max(largest, 1e-9)
    return min(-0.06 * span, 1.1 * least), 1.12 * span


def _verdict(response: Response) -> str:
    kind = response.kind.replace("_", " ")
    if response.started_s is None:
        return f"{kind}: the block never moves"
    if response.outcome is Outcome.TOPPLED:
        return f"{kind}: the block fails at {response.toppled_s:.2f} s"
    if response.displacement_m is None:
        return f"{kind}: {response.outcome.value}"
    where = f"{kind}: displacement {response.displacement_m:.3g} m"
    if response.final_theta_rad is not None:
        where += f", rotation {np.degrees(response.final_theta_rad):.3g} deg"
    if response.outcome is not Outcome.STABLE:
        where += f" when the model ended ({response.outcome.value})"
    return where
