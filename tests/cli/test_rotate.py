"""`motions rotate`, `--slope-azimuth` and the spectra of `motions show`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import export_motions, read_motions
from rbfrag.motions.rotation import rotate
from tests.cli.conftest import Rejects, Shell
from tests.synthetic import shaking


@pytest.fixture
def pair(tmp_path: Path) -> tuple[Path, GroundMotion, GroundMotion]:
    """A file of two horizontals and their motions."""
    labels: dict[str, Any] = {"station": "S", "recording": "R", "is_vertical": False}
    first, other = (
        GroundMotion(
            shaking(seed), 0.02, component=f"{azimuth:g}", orientation_deg=azimuth, **labels
        )
        for seed, azimuth in ((3, 30.0), (4, 120.0))
    )
    path = tmp_path / "pair.csv"
    export_motions([first, other], path)
    return path, first, other


def test_a_rotated_component_is_written(
    shell: Shell, pair: tuple[Path, GroundMotion, GroundMotion]
) -> None:
    path, first, other = pair
    written = shell.json("motions", "rotate", path, "--azimuth", "75", "--out", "az.csv")
    (motion,) = read_motions("az.csv")
    expected = rotate(first, other, 75.0)
    assert motion.sha256 == expected.sha256 == written["sha256"][0]
    assert (motion.component, motion.orientation_deg) == ("az75", 75.0)


def test_rotated_components_are_stored_and_shown(
    shell: Shell, rejects: Rejects, pair: tuple[Path, GroundMotion, GroundMotion]
) -> None:
    path, first, other = pair
    shell("motions", "add", path)
    report = shell.json("motions", "rotate", "1", "--azimuth", "75", "--suite", "slope")
    assert (report["motion_ids"], report["pairs"]) == ([3], [[1, 2]])
    shown = shell.json("motions", "show", "3")
    assert (shown["component"], shown["orientation_deg"]) == ("az75", 75.0)
    assert shown["sha256"] == rotate(first, other, 75.0).sha256
    assert "rotd50" not in shown
    shown = shell.json("motions", "show", "1", "--plot", "spectrum.png")
    assert Path("spectrum.png").stat().st_size > 10_000
    assert shown["sa_g"]["1"] == first.spectral_acceleration(1.0)
    assert shown["housner_m"] == first.housner_m
    assert shown["rotd100"]["sa_g"]["1"] >= shown["sa_g"]["1"] * (1.0 - 1e-4)
    text = shell("motions", "show", "1").stdout
    for part in ("RotD50", "RotD100", "SA(10 s) [g]", "D_5-75", "CAV", "I_a", "SI "):
        assert part in text
    text = rejects("motions", "rotate", path, "--azimuth", "75")
    assert "is not a database id: give --out" in text


@pytest.mark.parametrize(
    ("command", "polarity"),
    [
        (("respond", "--p2", "7", "--kr", "0.1"), ("--reverse",)),
        (("critical", "--p2", "7"), ("--reverse",)),
        (("predict", "--p2", "7", "--kr", "0.1"), ("--polarity", "reverse")),
    ],
)
def test_a_slope_azimuth_is_the_reverse_polarity_of_the_component_toward_it(
    shell: Shell,
    rejects: Rejects,
    pair: tuple[Path, GroundMotion, GroundMotion],
    command: tuple[str, ...],
    polarity: tuple[str, ...],
) -> None:
    path, first, other = pair
    export_motions([rotate(first, other, 200.0)], "az200.csv")
    word = ("--motion",) if command[0] == "predict" else ()
    inputs = shell.json(*command, *word, path, "--slope-azimuth", "200")
    expected = shell.json(*command, *word, "az200.csv", *polarity)
    numbers = {name: value for name, value in inputs.items() if isinstance(value, float)}
    assert len(numbers) > 3
    assert numbers == {name: expected[name] for name in numbers}
    text = rejects(*command, *word, path, "--slope-azimuth", "200", *polarity)
    assert f"--slope-azimuth cannot be combined with {polarity[0]}" in text
