"""Figures of one response over time: acceleration against strength, and motion of the block."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rbfrag.errors import InputError
from rbfrag.plots import canvas
from rbfrag.plots.labels import as_written, write_near
from rbfrag.solver.results import FloatArray, Outcome, Response, ResponseHistory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOTION = "#7f7f7f"
STRENGTH = "#c44e52"
BLOCK = canvas.BLUE

QUIET_BEFORE_S = 1.0
QUIET_AFTER_S = 2.0

TALLEST_SHOWN = 6.0
"""Rotation over the critical angle beyond which a toppling block is of no interest."""


@canvas.in_own_style
def plot_response(
    response: Response,
    path: canvas.Out,
    *,
    p2: float,
    kr: float,
    reverse: bool = False,
    title: str = "",
) -> canvas.Picture:
    """Draw one toppling response in the form of Gibson's dissertation and write it to `path`.

    The upper panel shows the driving acceleration k_h/(1 + k_v) against the strength left
    at the present rotation, k_r(theta) = tan(theta_c - theta): the block accelerates
    forward where the first is above the second. The lower panel shows theta/theta_c, where
    1 is the point of balance.

    Args:
        p2: the block's p² [1/s²], for the title.
        kr: the block's k_r, for the title.
    """
    history = response.history
    if history is None:
        raise InputError("this response has no history: use history=True")
    assert response.critical_angle_deg is not None
    theta_c = math.radians(response.critical_angle_deg)
    ratio = history.theta_rad / theta_c
    remaining = theta_c - history.theta_rad
    # tan runs away beyond 90 degrees past balance, where strength means nothing any more
    strength = np.tan(np.clip(remaining, -1.4, 1.4))
    label = r"$k_r(\theta)=\tan(\theta_c-\theta)$"
    figure, upper, lower = _panels(history, strength, f"block: {label}", kr)
    lower.plot(history.time_s, ratio, color=BLOCK, lw=1.3)
    lower.axhline(1.0, color=STRENGTH, lw=0.8, ls="--")
    lower.set_ylabel(r"rotation $\theta/\theta_c$")
    seen = ratio if response.toppled_s is None else ratio[history.time_s <= response.toppled_s]
    tallest = min(max(1.0, float(seen.max(initial=0.0))), TALLEST_SHOWN)
    lower.set_ylim(-0.05 * tallest, 1.15 * tallest)
    _name_balance(lower, 1.0, "balance")
    if response.toppled_s is not None:
        for axes in (upper, lower):
            axes.axvline(response.toppled_s, color="black", lw=0.8, ls=":")
        _name_time(lower, response.toppled_s, "toppling inevitable", 0.97)
    lower.set_xlim(*_window(history.time_s, ratio, response))
    figure.suptitle(_title(title, reverse, _verdict(response, p2, kr)), fontsize=10)
    return canvas.save_figure(figure, path)


def _name_balance(axes: Axes, ratio: float, name: str) -> None:
    """Write a name on the line of a rotation ratio."""
    at = (0.005, ratio)
    write_near(axes, name, at, (1, 3), ha="left", xycoords=("axes fraction", "data"), fontsize=8,
               color=STRENGTH, movable=False)  # fmt: skip


def _name_time(axes: Axes, time_s: float, label: str, height: float) -> None:
    """Write the event at a vertical line, above the position, or below it near the top."""
    write_near(
        axes, f"{label} at {time_s:.2f} s", (time_s, height), (-3, 3 if height < 0.5 else -3),
        xycoords=("data", "axes fraction"), rotation=90, fontsize=8,
    )  # fmt: skip


def _panels(
    history: ResponseHistory, strength: FloatArray, label: str, least_top: float
) -> tuple[Figure, Axes, Axes]:
    """Draw acceleration against strength; return the figure, its upper and its empty lower axes."""
    figure = canvas.new_figure(width_in=7.5, height_in=5.6)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.25, 1.0])
    driving = history.k_h / (1.0 + history.k_v)
    upper.plot(history.time_s, driving, color=MOTION, lw=0.7, label="ground: $k_h/(1+k_v)$")
    upper.plot(history.time_s, strength, color=STRENGTH, lw=1.3, label=label)
    top = 1.15 * max(float(np.abs(driving).max()), least_top) or 1.0
    upper.set_ylim(-top, 1.25 * top)
    upper.axhline(0.0, color="black", lw=0.5)
    upper.set_ylabel("acceleration [g]")
    upper.legend(loc="upper right", fontsize=8, ncols=2, framealpha=0.9)
    lower.set_xlabel("time [s]")
    canvas.light_grid(upper, lower)
    return figure, upper, lower


def _title(name: str, reverse: bool, verdict: str) -> str:
    return f"{as_written(name + (', reversed' if reverse else ''), 85)}\n{verdict}"


def _window(time_s: FloatArray, ratio: FloatArray, response: Response) -> tuple[float, float]:
    """Return the time range of the motion of the block, with a short rest on both sides."""
    if response.started_s is None:
        return float(time_s[0]), float(max(time_s[-1], time_s[0] + 1e-3))
    first = response.started_s - QUIET_BEFORE_S
    moving = time_s[ratio > 0.0]
    last = float(moving[-1]) if moving.size else response.started_s
    beyond = time_s[ratio > TALLEST_SHOWN]
    if response.toppled_s is not None and beyond.size:
        last = max(float(beyond[0]), response.toppled_s)
    return float(first), last + QUIET_AFTER_S


def _verdict(response: Response, p2: float, kr: float) -> str:
    block = f"block $p^2$ = {p2:g} s$^{{-2}}$, $k_r$ = {kr:g}"
    if response.outcome is Outcome.TOPPLED:
        return f"{block}: topples"
    if response.peak_theta_n is None:
        return f"{block}: {response.outcome.value}"
    if response.started_s is None:
        return f"{block}: never lifts off its base"
    return f"{block}: stays, peak rotation {response.peak_theta_n:.3g} of the critical angle"


ROTATION = "#b7791f"


@canvas.in_own_style
def plot_motion(
    response: Response, path: canvas.Out, *, title: str = "", reverse: bool = False
) -> canvas.Picture:
    """Draw the response of a sliding, slumping or confined block and write it to `path`.

    The upper panel shows the driving acceleration k_h/(1 + k_v) against the strength where
    the block is: it gains speed down the slope where the first is above the second. The lower
    panel shows the displacement along the base, and the rotation of a block that rotates.
    """
    history = response.history
    if history is None or history.displacement_m is None or history.strength_g is None:
        raise InputError("this response holds no displacements in time: use history=True")
    has_strength = np.isfinite(history.strength_g)
    label = f"strength of the block{'' if has_strength.all() else ', while its contacts hold'}"
    figure, upper, lower = _panels(
        history, history.strength_g, label, _least_top(history.strength_g)
    )
    largest = float(np.abs(history.displacement_m).max())
    factor, unit = (
        (1000.0, "mm") if largest < 0.01 else (100.0, "cm") if largest < 1.0 else (1.0, "m")
    )
    lower.plot(history.time_s, factor * history.displacement_m, color=BLOCK, lw=1.4)
    lower.set_ylabel(f"displacement [{unit}]", color=BLOCK)
    least = float(history.displacement_m.min())
    lower.set_ylim(*_around(factor * float(history.displacement_m.max()), factor * least))
    if response.peak_theta_rad is not None or np.any(history.theta_rad):
        right = lower.twinx()
        right.plot(history.time_s, np.degrees(history.theta_rad), color=ROTATION, lw=1.1, ls="--")
        right.set_ylabel("rotation [deg]", color=ROTATION)
        right.set_ylim(*_around(float(np.degrees(history.theta_rad).max()), 0.0))
    for part in response.parts[1:]:
        for axes in (upper, lower):
            axes.axvline(part.begins_s, color="black", lw=0.9, ls=":")
    lower.set_xlim(*_motion_window(history, response))
    figure.suptitle(_title(title, reverse, _motion_verdict(response)), fontsize=10)
    return canvas.save_figure(figure, path)


def _least_top(strength_g: FloatArray) -> float:
    """Return the first finite strength; 0 where there is none."""
    values = strength_g[np.isfinite(strength_g)]
    return float(values[0]) if values.size else 0.0


def _motion_window(history: ResponseHistory, response: Response) -> tuple[float, float]:
    """Return the time range of the motion of the block, with a short rest on both sides."""
    first, last = float(history.time_s[0]), float(history.time_s[-1])
    if response.started_s is None or response.stopped_s is None:
        return first, max(last, first + 1e-3)
    return response.started_s - QUIET_BEFORE_S, min(response.stopped_s + QUIET_AFTER_S, last)


def _around(largest: float, least: float) -> tuple[float, float]:
    """Return axis limits with a margin that put zero at the same height on both axes."""
    span = largest if largest > 0.0 else 1.0
    return min(-0.06 * span, 1.1 * least), 1.12 * span


def _motion_verdict(response: Response) -> str:
    kind = canvas.mode_title(response.kind)
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


@canvas.in_own_style
def plot_rocking(
    response: Response, path: canvas.Out, *, title: str = "", reverse: bool = False
) -> canvas.Picture:
    """Draw the response of a free-standing block and write it to `path`.

    The upper panel shows the driving acceleration k_h/(1 + k_v) against the strength left about
    either corner: the block speeds up forward where it is above the upper line, backward where it
    is below the lower one. The lower panel shows the rotation over the critical angle of its
    sense, forward positive, and the impacts.
    """
    history = response.history
    if history is None or history.impact_s is None:
        raise InputError("this response holds no impacts in time: use history=True")
    assert response.critical_angle_deg is not None
    assert response.critical_backward_deg is not None
    toe, heel = map(math.radians, (response.critical_angle_deg, response.critical_backward_deg))
    theta = history.theta_rad
    # tan runs away beyond 90 degrees past balance, where strength means nothing any more
    forward = np.tan(np.clip(toe - np.maximum(theta, 0.0), -1.4, 1.4))
    backward = -np.tan(np.clip(heel - np.maximum(-theta, 0.0), -1.4, 1.4))
    label = "strength about toe and heel"
    figure, upper, lower = _panels(history, forward, label, max(math.tan(toe), math.tan(heel)))
    upper.plot(history.time_s, backward, color=STRENGTH, lw=1.3)
    ratio = np.where(theta >= 0.0, theta / toe, theta / heel)
    lower.plot(history.time_s, ratio, color=BLOCK, lw=1.2)
    lower.plot(
        history.impact_s, np.zeros(history.impact_s.size), "|", color="black", ms=6, mew=0.7,
        label="impacts",
    )  # fmt: skip
    lower.legend(loc="upper right", fontsize=8, framealpha=0.9)
    for balance, name in ((1.0, "balance on the toe"), (-1.0, "balance on the heel")):
        lower.axhline(balance, color=STRENGTH, lw=0.8, ls="--")
        _name_balance(lower, balance, name)
    lower.set_ylabel(r"rotation $\theta/\theta_c$, forward up")
    lower.set_ylim(-1.4, 1.6)
    if response.toppled_s is not None:
        for axes in (upper, lower):
            axes.axvline(response.toppled_s, color="black", lw=0.8, ls=":")
        _name_time(lower, response.toppled_s, "overturning certain", 0.03)
    lower.set_xlim(*_window(history.time_s, np.abs(ratio), response))
    figure.suptitle(_title(title, reverse, _rocking_verdict(response)), fontsize=10)
    return canvas.save_figure(figure, path)


def _rocking_verdict(response: Response) -> str:
    kind = canvas.mode_title(response.kind)
    if response.started_s is None:
        return f"{kind}: the block never lifts off its base"
    if response.outcome is Outcome.TOPPLED:
        over = "forward over its toe" if response.peak_forward_rad is None else "over its heel"
        verdict = f"{kind}: overturns {over}"
    elif response.peak_theta_n is None:
        return f"{kind}: {response.outcome.value}"
    else:
        verdict = f"{kind}: stays, peak rotation {response.peak_theta_n:.3g} of the critical angle"
    return f"{verdict} (sensitive)" if response.sensitive else verdict
