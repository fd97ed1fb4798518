"""A response as scripts read it: a dictionary of plain values, a CSV of its history."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rbfrag.errors import InputError
from rbfrag.files import written_whole
from rbfrag.solver.results import Response, ResponseHistory

HISTORY_COLUMNS = (
    "time_s",
    "theta_rad",
    "theta_over_critical",
    "theta_dot_rad_s",
    "k_h_g",
    "k_v_g",
)


def as_dict(response: Response) -> dict[str, Any]:
    """Return the answer with the keys of the JSON contract."""
    return {
        "kind": response.kind,
        "outcome": response.outcome.value,
        "peak_theta_n": response.peak_theta_n,
        "peak_theta_rad": response.peak_theta_rad,
        "critical_angle_deg": response.critical_angle_deg,
        "started_s": response.started_s,
        "toppled_s": response.toppled_s,
        "error_estimate": response.error_estimate,
        "steps": response.steps,
        "samples_moved": response.samples_moved,
        "samples_total": response.samples_total,
        "final_theta_rad": response.final_theta_rad,
        "displacement_m": response.displacement_m,
        "peak_displacement_m": response.peak_displacement_m,
        "centroid_displacement_m": response.centroid_displacement_m,
        "stopped_s": response.stopped_s,
        "mode_changes": [
            {"time_s": change.time_s, "motion": change.motion} for change in response.mode_changes
        ],
        "warnings": list(response.warnings),
    }


MOTION_COLUMNS = (
    *HISTORY_COLUMNS,
    "displacement_m",
    "velocity_m_s",
    "centroid_x_m",
    "centroid_y_m",
    "strength_g",
)
"""Columns for the models in which the block is displaced; empty where one does not apply."""


def write_history(response: Response, path: str | os.PathLike[str]) -> None:
    """Write the motion of the block in time as CSV, whole or not at all.

    Args:
        response: a response that was asked for with its history.
        path: the file to write; units are in its column names.

    Raises:
        InputError: the response holds no history, or the file cannot be written.
    """
    history = response.history
    if history is None:
        raise InputError("this response holds no history: ask for it with history=True")
    with (
        written_whole(Path(path)) as partial,
        partial.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(HISTORY_COLUMNS if history.displacement_m is None else MOTION_COLUMNS)
        writer.writerows(_rows(response, history))


def _rows(response: Response, history: ResponseHistory) -> Iterator[tuple[float | str, ...]]:
    columns: list[list[float] | list[str]] = [
        history.time_s.tolist(),
        history.theta_rad.tolist(),
        _over_critical(response, history),
        history.theta_dot_rad_s.tolist(),
        history.k_h.tolist(),
        history.k_v.tolist(),
    ]
    if history.displacement_m is not None:
        centroid = history.centroid_m
        columns += [
            values.tolist() if values is not None else [""] * history.time_s.size
            for values in (
                history.displacement_m,
                history.velocity_m_s,
                None if centroid is None else centroid[:, 0],
                None if centroid is None else centroid[:, 1],
                history.strength_g,
            )
        ]
    return zip(*columns, strict=True)


def _over_critical(response: Response, history: ResponseHistory) -> list[float] | list[str]:
    if response.critical_angle_deg is None:
        return [""] * history.time_s.size
    ratio: list[float] = (history.theta_rad / math.radians(response.critical_angle_deg)).tolist()
    return ratio
