"""Planes in space against the worked examples of a geologist, at every door."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import rbfrag
from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import read_blocks
from rbfrag.question.sections import in_section
from rbfrag.rockmasses.distributions import OrientationSet, orientation_set
from rbfrag.rockmasses.file import read_rock_mass
from rbfrag.solver.block.planes import Plane, line_of, plane_of, section_of

ROWS = [
    ("20/090", "70/090", "65/090", 1.0, 0.6, 20.0, 50.0, 1.0, 0.6, ""),
    ("25/102", "65/075", "70/090", 1.0, 0.6, 24.5186, 39.7122, 1.0039, 0.6172, "27 deg apart"),
    ("10/090", "80/270", "75/090", 2.0, 0.8, 10.0, 90.0, 2.0, 0.8, ""),
    ("8/025", "75/195", "80/200", 1.5, 0.5, -7.9699, 82.9152, 1.5001, 0.5018, ""),
    ("4/150", "78/095", "80/090", 3.0, 1.0, 2.0024, 75.9531, 3.0055, 1.0037, "cross-tilt of 3.5"),
]
TEN = "22/85 18/97 25/90 19/78 24/101 16/92 21/88 27/95 20/84 17/90"
UPRIGHT = "88/85 86/268 84/92 89/271 87/88 85/95"


@pytest.mark.parametrize(
    ("base", "back", "face", "s1", "s2", "beta", "gamma", "s1_in", "s2_in", "says"), ROWS
)
def test_section(base, back, face, s1, s2, beta, gamma, s1_in, s2_in, says) -> None:  # type: ignore[no-untyped-def]
    planes = {"base": base, "back": back, "face": face}
    inputs, message = in_section({**planes, "s1_m": s1, "s2_m": s2})
    read = [inputs[name] for name in ("beta_deg", "gamma_deg", "s1_m", "s2_m")]
    assert read == pytest.approx([beta, gamma, s1_in, s2_in], abs=6e-5)
    assert [says in text for text in message] == ([True] if says else [])


def test_wedge_is_rejected() -> None:
    base, back, face = Plane(35.0, 140.0), Plane(60.0, 50.0), Plane(70.0, 90.0)
    assert base.trace_deg(90.0) == pytest.approx(24.2318, abs=5e-5)
    assert back.trace_deg(90.0) - base.trace_deg(90.0) == pytest.approx(28.7637, abs=5e-5)
    factors = base.spacing_factor(90.0), back.spacing_factor(90.0)
    assert factors == pytest.approx((1.1132, 1.2038), abs=5e-5)
    assert line_of(base, back) == pytest.approx((33.0, 118.0), abs=0.5)
    with pytest.raises(InputError, match=r"wedge.* plunges 33.0 deg toward 118 and daylights"):
        section_of(face, base, back)


def test_line_lies_in_both_planes() -> None:
    base, back = Plane(25.0, 102.0), Plane(65.0, 75.0)
    plunge, trend = np.radians(line_of(base, back))
    line = np.array(
        [np.cos(plunge) * np.sin(trend), np.cos(plunge) * np.cos(trend), -np.sin(plunge)]
    )
    assert abs(line @ base.pole) < 1e-12
    assert abs(line @ back.pole) < 1e-12
    assert np.degrees([plunge, trend]) == pytest.approx([14.6, 158.0], abs=0.05)


@pytest.mark.parametrize(
    ("base", "back", "face", "why"),
    [
        ("60/090", "63/090", "80/090", "3.0 deg apart"),
        ("60/090", "20/090", "80/090", "gamma = -40"),
        ("91/090", "70/090", "80/090", "at most 90"),
        ("25-102", "70/090", "80/090", "not dip/dip direction"),
    ],
)
def test_rejections(base: str, back: str, face: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        in_section({"base": base, "back": back, "face": face, "s1_m": 1.0, "s2_m": 1.0})


def test_steep_base_and_a_plane_stated_twice() -> None:
    assert "steeper than the face" in section_of(Plane(30, 90), Plane(40, 90)).remarks[0]
    with pytest.raises(InputError, match="beta_deg cannot be combined with base"):
        in_section({"base": "5/090", "face": "70/090", "beta_deg": 5.0, "height_m": 2.0})


def test_every_door_answers_as_the_section(tmp_path: Path) -> None:
    planes = {"base": "4/150", "back": "78/095", "face": "80/090"}
    shape = {"s1_m": 2.0, "s2_m": 0.4, "phi_deg": 40.0}
    expected, _ = in_section({**planes, **shape})
    target = rbfrag.predict(**expected, pgv_m_s=2.0).probability
    assert 0.0 < target < 1.0
    assert rbfrag.predict(**planes, **shape, pgv_m_s=2.0).probability == target
    many = rbfrag.predict(**{**planes, "base": ["4/150", "35/140"]}, **shape, pgv_m_s=2.0)
    assert many.probability[0] == target
    assert "strikes 50 deg off" in many.reason[1]
    table = tmp_path / "blocks.csv"
    table.write_text("s1_m,s2_m,phi_deg,base,back,face\n2,0.4,40,4/150,78/095,80/090\n")
    rows = read_blocks(table).blocks
    kr = rbfrag.predict(rows["p2_1_s2"][0], rows["kr"][0], pgv_m_s=2.0)
    assert kr.probability == target


def test_one_block_loads_no_numpy() -> None:
    code = (
        "import sys, rbfrag; rbfrag.predict(height_m=2.0, width_m=.6, base='4/090', "
        "face='80/090', pgv_m_s=.6); sys.exit('numpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_sets() -> None:
    ten = orientation_set([plane_of(text, "plane") for text in TEN.split()])
    assert ten.mean == pytest.approx((20.78, 90.26), abs=0.005)
    assert (ten.resultant, ten.fisher_k) == pytest.approx((9.9743, 349.97), rel=1e-5)
    assert ten.alpha95_deg == pytest.approx(2.586, abs=5e-4)
    upright = orientation_set([plane_of(text, "plane") for text in UPRIGHT.split()])
    assert upright.mean == pytest.approx((88.16, 89.83), abs=0.005)


def test_share_off_the_face() -> None:
    share = OrientationSet(Plane(20.0, 90.0), 0.0, 100.0, 0.0, 0).share_off(Plane(70.0, 90.0))
    assert share == pytest.approx(0.24, abs=0.005)


def test_rock_mass_of_measured_planes(tmp_path: Path) -> None:
    (tmp_path / "base.csv").write_text("dip,direction\n" + TEN.replace("/", ",").replace(" ", "\n"))
    file = tmp_path / "mass.toml"
    file.write_text(
        '[face]\nplane = "70/110"\n[base]\nplane = "base.csv"\nspacing_m = 1.0\n'
        '[back]\nplane = "65/105"\nspacing_m = { distribution = "lognormal", median = 0.6, '
        "sd_ln = 0.1 }\n[friction]\nphi_deg = 40.0\n"
    )
    mass = read_rock_mass(file)
    dip, spacing = mass.variables["base.dip_deg"], mass.variables["back.spacing_m"]
    pole = np.array(Plane(20.7799, 90.2568).pole)
    across = pole @ [np.cos(np.radians(110.0)), -np.sin(np.radians(110.0)), 0.0]
    assert dip.law == "von_mises"
    assert dip.scale == pytest.approx(349.97 * (1.0 - across**2), rel=1e-4)
    assert spacing.location == pytest.approx(0.6 * Plane(65, 105).spacing_factor(110.0))
    assert (spacing.scale, "Fisher K 350" in mass.remarks[0]) == (0.1, True)
