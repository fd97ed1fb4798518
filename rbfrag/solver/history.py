"""History of a block's motion: from what a kernel has kept of it, and as CSV."""

from __future__ import annotations

import csv
import math
import os
from pathlib import Path

import numpy as np

from rbfrag.errors import InputError
from rbfrag.files import written_whole
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.results import FloatArray, Response, ResponseHistory

TAIL_PERIODS = 12.0
"""Length of the free motion shown after the record, in units of 1/p."""

TAIL_INTERVALS = 400


def with_free_motion(excited: Excitation, p: float) -> Excitation:
    """Return the shaking and the stretch of rest after it in which free motion is shown.

    Args:
        p: frequency parameter of the block [1/s].
    """
    return excited.with_rest_after(TAIL_PERIODS / p, TAIL_INTERVALS)


def node_history(
    excited: Excitation, longer: Excitation, rows: FloatArray, *, toppled: bool
) -> ResponseHistory:
    """Return the history of a run, with the nodes of rest, which kernels skip, inserted again.

    Args:
        excited: the excitation; all its nodes are shown unless the block topples.
        longer: the same with the free motion after it, over which the run went.
        rows: time, rotation, its rate and node of what was kept (below 0 for an event between
            nodes), shape (4, n).
        toppled: whether the history ends with the last of them.
    """
    # nodes that the kernel skipped are nodes of rest: zero in both
    at_node = rows[3] >= 0.0
    theta = np.zeros(longer.time_s.size)
    rate = np.zeros(longer.time_s.size)
    moved = rows[3, at_node].astype(np.int64)
    theta[moved] = rows[1, at_node]
    rate[moved] = rows[2, at_node]
    # all of the record, and of the free motion after it what the run went through
    shown = max(excited.time_s.size, int(moved[-1]) + 1) if moved.size else excited.time_s.size
    if toppled and moved.size:
        shown = int(moved[-1]) + 1
    # a stable order: at one time the node comes before the event
    event = rows[:3, ~at_node]
    time_s = np.concatenate([longer.time_s[:shown], event[0]])
    order = np.argsort(time_s, kind="stable")

    def merged(at_nodes: FloatArray, at_events: FloatArray) -> FloatArray:
        return np.concatenate([at_nodes[:shown], at_events])[order]

    def between(values: FloatArray) -> FloatArray:
        there: FloatArray = np.interp(event[0], longer.time_s, values)
        return there

    return ResponseHistory(
        time_s=time_s[order],
        theta_rad=merged(theta, event[1]),
        theta_dot_rad_s=merged(rate, event[2]),
        k_h=merged(longer.k_h, between(longer.k_h)),
        k_v=merged(longer.w - 1.0, between(longer.w - 1.0)),
    )


HISTORY_COLUMNS = (
    "time_s",
    "theta_rad",
    "theta_over_critical",
    "theta_dot_rad_s",
    "k_h_g",
    "k_v_g",
)
MOTION_COLUMNS = (
    *HISTORY_COLUMNS, "displacement_m", "velocity_m_s", "centroid_x_m", "centroid_y_m",
    "strength_g",
)  # fmt: skip
"""Columns of histories; the latter of models in which the block is displaced, empty where one
does not apply."""


def write_history(response: Response, path: str | os.PathLike[str]) -> None:
    """Write the history of the block's motion as CSV, completely or not at all.

    Args:
        response: a response that was asked for with its history.
        path: the file to write; units are in its column names.

    Raises:
        InputError: the response holds no history, or the file cannot be written.
    """
    history = response.history
    if history is None:
        raise InputError("this response holds no history: ask for it with history=True")
    theta, nothing = history.theta_rad, np.full(history.time_s.size, math.nan)
    ratio = nothing
    if response.critical_angle_deg is not None:
        ratio = theta / math.radians(response.critical_angle_deg)
        if response.critical_backward_deg is not None:
            backward = theta / math.radians(response.critical_backward_deg)
            ratio = np.where(theta < 0.0, backward, ratio)
    names: tuple[str, ...] = HISTORY_COLUMNS
    columns = [history.time_s, theta, ratio, history.theta_dot_rad_s, history.k_h, history.k_v]
    if history.displacement_m is not None:
        names = MOTION_COLUMNS
        centroid = (nothing, nothing) if history.centroid_m is None else history.centroid_m.T
        moved = (history.displacement_m, history.velocity_m_s, *centroid, history.strength_g)
        columns += [nothing if values is None else values for values in moved]
    with (
        written_whole(Path(path)) as partial,
        partial.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(names)
        # a number that does not apply leaves its cell empty
        writer.writerows(
            [value if math.isfinite(value) else "" for value in row]
            for row in zip(*(values.tolist() for values in columns), strict=True)
        )
