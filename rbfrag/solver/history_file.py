"""History of the block's motion as CSV."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rbfrag.errors import InputError
from rbfrag.files import written_whole
from rbfrag.solver.results import FloatArray, Response, ResponseHistory

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
    with (
        written_whole(Path(path)) as partial,
        partial.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(HISTORY_COLUMNS if history.displacement_m is None else MOTION_COLUMNS)
        writer.writerows(_rows(response, history))


def _rows(response: Response, history: ResponseHistory) -> Iterator[tuple[float | str, ...]]:
    columns: list[list[float] | list[str] | list[float | str]] = [
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
            [""] * history.time_s.size if values is None else _written(values)
            for values in (
                history.displacement_m,
                history.velocity_m_s,
                None if centroid is None else centroid[:, 0],
                None if centroid is None else centroid[:, 1],
                history.strength_g,
            )
        ]
    return zip(*columns, strict=True)


def _written(values: FloatArray) -> list[float | str]:
    """Return numbers in their written form; NaN as an empty cell."""
    return [value if math.isfinite(value) else "" for value in values.tolist()]


def _over_critical(response: Response, history: ResponseHistory) -> list[float] | list[str]:
    if response.critical_angle_deg is None:
        return [""] * history.time_s.size
    theta = history.theta_rad
    ratio = theta / math.radians(response.critical_angle_deg)
    if response.critical_backward_deg is not None:
        backward = theta / math.radians(response.critical_backward_deg)
        ratio = np.where(theta < 0.0, backward, ratio)
    over: list[float] = ratio.tolist()
    return over
