"""`respond --json` counts the record intervals in which the block moved, and all there are."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from rbfrag.cli.main import app
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.toppling_run import respond
from tests.synthetic import shaking, write_at2

DT_S = 0.02


def answer(record: Path, *more: str) -> dict[str, object]:
    shown = CliRunner().invoke(app, ["respond", str(record), *more, "--json"])
    assert shown.exit_code == 0, shown.output
    document: dict[str, object] = json.loads(shown.stdout)
    return document


def counted_in_history(motion: GroundMotion, p2: float, kr: float, until_s: float) -> int:
    """Intervals with any rotation in them, from the motion in time."""
    history = respond(motion, p2=p2, kr=kr, history=True).history
    assert history is not None
    count = 0
    for i in range(motion.npts - 1):
        start, end = motion.time_s[i], motion.time_s[i + 1]
        if start >= until_s - 1e-12:
            break
        inside = (history.time_s >= start) & (history.time_s <= end)
        count += bool((history.theta_rad[inside] > 0.0).any())
    return count


def test_one_pulse_counted_by_hand(tmp_path: Path) -> None:
    # a triangle from 0 to 0.4 g and back over samples 10 ... 30: it exceeds 0.1 g from sample
    # 12.5 on, so interval 12 is the first one that moves
    values = np.zeros(400)
    values[10:31] = 0.4 * (1.0 - np.abs(np.arange(-10, 11)) / 10.0)
    record = write_at2(tmp_path / "pulse.AT2", values, dt_s=DT_S)
    message = answer(record, "--p2", "0.2", "--kr", "0.1")
    assert message["outcome"] == "stable"
    assert message["started_s"] == pytest.approx(12.5 * DT_S)
    assert message["samples_total"] == 399
    history = respond(GroundMotion(values, DT_S), p2=0.2, kr=0.1, history=True).history
    assert history is not None
    moving = history.time_s[history.theta_rad > 0.0]
    last = math.ceil(moving[-1] / DT_S)
    assert 31 < last < 399
    # it comes to rest between the last node at which it is up and the next
    assert message["samples_moved"] == last + 1 - 12


@pytest.mark.parametrize("seed", range(4))
def test_the_count_is_that_of_the_motion_in_time(tmp_path: Path, seed: int) -> None:
    record = write_at2(tmp_path / "made.AT2", shaking(seed))
    motion = GroundMotion(shaking(seed).round(12), DT_S)
    for p2, kr in ((3.0, 0.12), (10.0, 0.2), (0.5, 0.05)):
        message = answer(record, "--p2", str(p2), "--kr", str(kr))
        assert message["samples_total"] == motion.npts - 1
        toppled = message["toppled_s"]
        until = toppled if isinstance(toppled, float) else math.inf
        counted = counted_in_history(motion, p2, kr, until)
        # an excursion within one interval may rise and fall between the times that are kept
        assert isinstance(message["samples_moved"], int)
        assert abs(message["samples_moved"] - counted) <= 1
        assert 0 < message["samples_moved"] < message["samples_total"]


def test_rest_is_not_integrated(tmp_path: Path) -> None:
    samples = shaking(1)
    short = write_at2(tmp_path / "short.AT2", samples)
    padded = np.concatenate([np.zeros(3000), samples])
    long = write_at2(tmp_path / "long.AT2", padded)
    single, other = (answer(f, "--p2", "3", "--kr", "0.15") for f in (short, long))
    assert other["samples_total"] == 3000 + samples.size - 1
    assert (single["samples_moved"], single["steps"]) == (other["samples_moved"], other["steps"])
    never = answer(short, "--p2", "3", "--kr", "5")
    assert (never["samples_moved"], never["steps"]) == (0, 0)
