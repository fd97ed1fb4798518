"""A vertical motion goes with a horizontal one when both are upward and at the same times."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.motions.direction import companion, is_downward_name, is_vertical_name, upward
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.processing import processed
from rbfrag.motions.text import first_sample_time
from rbfrag.solver.toppling_run import respond
from tests.synthetic import shaking

DT_S = 0.02
START = datetime(2020, 5, 15, 11, 3, 14, 418000)


def motion(seed: int = 1, **labels: object) -> GroundMotion:
    return GroundMotion(shaking(seed), DT_S, **labels)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["DOWN", "dwn", "-DN"])
def test_downward_is_turned_once(name: str) -> None:
    down = motion(component=name, is_vertical=True, remarks=("a remark",))
    assert is_downward_name(name)
    assert is_vertical_name(name)
    up = upward(down)
    assert np.array_equal(up.acceleration_g, -down.acceleration_g)
    assert not np.signbit(up.acceleration_g[up.acceleration_g == 0.0]).any()
    assert (up.component, up.source_sha256) == ("UP", down.sha256)
    assert up.processing_applied == {"turned_upward": True}
    assert name in up.remarks[-1]
    assert upward(up) is up


@pytest.mark.parametrize("name", ["UP", "V", "Z", "HNZ", "360", "", "DOWNEY"])
def test_others_are_left(name: str) -> None:
    labelled = motion(component=name)
    assert upward(labelled) is labelled


def test_down_and_its_mirror_image_give_one_answer() -> None:
    horizontal = motion(3)
    up = motion(4, component="UP")
    down = replace(up, acceleration_g=-up.acceleration_g, component="DOWN")
    answers = [
        respond(horizontal, p2=3.0, kr=0.2, vertical=companion(horizontal, vertical))
        for vertical in (up, down)
    ]
    assert answers[0].peak_theta_n == answers[1].peak_theta_n
    assert answers[0].peak_theta_n != respond(horizontal, p2=3.0, kr=0.2).peak_theta_n


@pytest.mark.parametrize(
    ("horizontal", "vertical", "words"),
    [
        (motion(), replace(motion(2), dt_s=0.01), "dt = 0.01 s, the horizontal 0.02 s"),
        (motion(start_time=START), motion(2, start_time=START + timedelta(seconds=0.5)),
         "0.5 s after"),
        (motion(start_time=START), motion(2, start_time=START - timedelta(seconds=3)),
         "3 s before"),
        (processed(motion()), motion(2), "1000 samples before the horizontal and 0"),
    ],
)  # fmt: skip
def test_apart(horizontal: GroundMotion, vertical: GroundMotion, words: str) -> None:
    with pytest.raises(InputError, match=words):
        companion(horizontal, vertical)


def test_together() -> None:
    start = {"start_time": START}
    near = {"start_time": START + timedelta(seconds=0.4 * DT_S)}
    vertical = motion(2, **near)
    assert companion(motion(**start), vertical) is vertical
    assert companion(motion(), vertical) is vertical
    longer = replace(vertical, acceleration_g=np.append(vertical.acceleration_g, 0.0))
    assert companion(motion(**start), longer) is longer
    assert companion(processed(motion()), processed(motion(2))).npts == 2600
    nodes = GroundMotion.from_nodes([0.0, 1.0], [0.0, 0.1])
    assert companion(nodes, nodes) is nodes


@pytest.mark.parametrize(
    ("text", "time"),
    [
        ("2020/05/15 11:03:14.418 UTC (Q=5) RcrdId: (see comment)", START),
        ("8/24/14, 10:20:33.0 UTC (GPS)", datetime(2014, 8, 24, 10, 20, 33)),
        ("12/20/22, 10:34: 1.0 UTC (GPS)", datetime(2022, 12, 20, 10, 34, 1)),
        ("05/02/83, 16:42:48.2 PDT", datetime(1983, 5, 2, 16, 42, 48, 200000)),
        ("2/27/2010 3:54:12.000 GMT", datetime(2010, 2, 27, 3, 54, 12)),
        ("20230206_011729.868", datetime(2023, 2, 6, 1, 17, 29, 868000)),
        ("2023/02/06 01:17:29.8683591", datetime(2023, 2, 6, 1, 17, 29, 868359)),
        ("1/1/1980 0:00:00.000 GMT", None),
        ("13/13/2010 3:54:12", None),
        ("2020/02/30 00:00:00", None),
        ("0000/01/01 00:00:00", None),
        ("To be determined", None),
        ("", None),
    ],
)
def test_times_of_headers(text: str, time: datetime | None) -> None:
    assert first_sample_time(text) == time
