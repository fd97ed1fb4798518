"""A response as scripts read it: a dictionary of plain values, a CSV of its history."""

from __future__ import annotations

import csv
import math
import os
from pathlib import Path
from typing import Any

from rbfrag.errors import InputError
from rbfrag.solver.results import Response

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
        "warnings": list(response.warnings),
    }


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
    theta_c = math.radians(response.critical_angle_deg)
    target = Path(path)
    partial = target.with_name(target.name + ".part")
    try:
        with partial.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(HISTORY_COLUMNS)
            writer.writerows(
                zip(
                    history.time_s.tolist(),
                    history.theta_rad.tolist(),
                    (history.theta_rad / theta_c).tolist(),
                    history.theta_dot_rad_s.tolist(),
                    history.k_h.tolist(),
                    history.k_v.tolist(),
                    strict=True,
                )
            )
        partial.replace(target)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise InputError(
            f"cannot write {target}: {error.strerror}; name a folder you may write"
        ) from None
