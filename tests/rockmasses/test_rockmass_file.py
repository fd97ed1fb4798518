"""Rock mass files: both forms say the same, and what is wrong is named with its place."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbfrag.errors import InputError
from rbfrag.rockmasses.file import read_rock_mass

EXAMPLES = Path(__file__).resolve().parent.parent.parent / "docs" / "examples"

TOML = """
realisations = 500
seed = 7
[base]
dip_deg = { distribution = "von_mises", mean = 20, kappa = 130 }
spacing_m = { distribution = "lognormal", median = 1.0, sd_ln = 0.2, high = 3 }
[back]
dip_deg = { distribution = "measured", values = [41, 44.5] }
spacing_m = 0.6
[friction]
phi_deg = { distribution = "uniform", low = 35, high = 45 }
phi_back_deg = 30
[block]
size_factor = 2.0
back_fracture = false
"""

CSV = """\ufeff# a comment, with a comma
variable, distribution, value, mean, median, sd_ln, kappa, low, high, values
realisations,,500
seed,,7

base.dip_deg,von_mises,,20,,,130
base.spacing_m,lognormal,,,1.0,0.2,,,3
back.dip_deg,measured,,,,,,,,41 44.5
back.spacing_m,,0.6
friction.phi_deg,uniform,,,,,,35,45
friction.phi_back_deg,constant,30
block.size_factor,,2
block.back_fracture,,false
"""


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_both_forms_say_the_same(tmp_path: Path) -> None:
    parsed = read_rock_mass(written(tmp_path, "a.toml", TOML))
    assert parsed == read_rock_mass(written(tmp_path, "a.CSV", CSV))
    assert (parsed.realisations, parsed.seed, parsed.back_fracture) == (500, 7, False)
    assert parsed.variables["back.dip_deg"].values == (41.0, 44.5)
    assert parsed.realise().n == 500


def test_both_forms_state_the_drainage(tmp_path: Path) -> None:
    toml = TOML.replace("spacing_m = 0.6", 'spacing_m = 0.6\nwater_m = 0.3\ndrainage = "drained"')
    toml = toml.replace("back_fracture = false", "")
    csv = CSV.replace("block.back_fracture,,false", "back.water_m,,0.3\nback.drainage,,drained")
    mass = read_rock_mass(written(tmp_path, "a.toml", toml))
    assert mass == read_rock_mass(written(tmp_path, "a.csv", csv))
    assert mass.drainage == "drained"
    undrained = read_rock_mass(
        written(tmp_path, "a.toml", toml.replace('"drained"', '"undrained"'))
    )
    assert undrained.drainage == "undrained"
    assert undrained.realise().is_wet.any()
    assert not mass.realise().is_wet.any()


def test_the_example_files_are_the_same_rock_mass() -> None:
    toml, csv = (read_rock_mass(EXAMPLES / f"rockmass.{kind}") for kind in ("toml", "csv"))
    assert toml == csv
    assert str(toml.variables["base.dip_deg"]) == "normal, mean 20, sd 5, not truncated"


PLANES = """\
variable,distribution,value,median,sd_ln,values
face.plane,,70/090,,,
base.plane,,base.csv,,,
base.spacing_m,,1.0,,,
back.plane,,,,,64/084 65/085 66/087
back.spacing_m,lognormal,,0.6,0.1,
friction.phi_deg,,40,,,
"""


def test_planes_in_both_forms(tmp_path: Path) -> None:
    written(tmp_path, "base.csv", (EXAMPLES / "base.csv").read_text())
    toml = (
        '[face]\nplane = "70/090"\n[base]\nplane = "base.csv"\nspacing_m = 1.0\n[back]\n'
        'plane = ["64/084", "65/085", "66/087"]\nspacing_m = { distribution = "lognormal", '
        "median = 0.6, sd_ln = 0.1 }\n[friction]\nphi_deg = 40.0\n"
    )
    parsed = read_rock_mass(written(tmp_path, "mass.csv", PLANES))
    assert parsed == read_rock_mass(written(tmp_path, "mass.toml", toml))
    assert parsed.variables["base.dip_deg"].scale == pytest.approx(349.97, rel=1e-3)
    for old, new, words in (
        ("70/090", "70", "bad.csv: face.plane = '70' is not dip/dip direction"),
        ("base.csv", "none.csv", "none.csv: no such file"),
        ("base.plane,,", "base.plane,normal,", "base.plane = .* is not dip/dip direction"),
        ("64/084", "64-084", "back.plane = '64-084' is not dip/dip direction"),
    ):
        with pytest.raises(InputError, match=words):
            read_rock_mass(written(tmp_path, "bad.csv", PLANES.replace(old, new, 1)))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("phi_back_deg = 30", "phi_back = 30", "unknown key friction.phi_back"),
        ("[friction]", "[frictions]", "unknown key frictions"),
        ("spacing_m = 0.6", "", "back.spacing_m is missing"),
        ("spacing_m = 0.6", "spacing_m = 0", "back.spacing_m: 0 is out of range"),
        ("spacing_m = 0.6", "spacing_m = nan", "back.spacing_m: nan is not finite"),
        ("spacing_m = 0.6", "spacing_m = '0.6'", "back.spacing_m: '0.6' is not a number"),
        ("kappa = 130", "kapa = 130", "base.dip_deg: the key kappa is missing"),
        ('"uniform"', '"triangle"', "friction.phi_deg: distribution = 'triangle' is unknown"),
        ("high = 45", "high = 90", "friction.phi_deg: 90 is out of range"),
        ("realisations = 500", "realisations = 0", "realisations = 0"),
        ("[block]", "[block", "not valid TOML"),
        ("seed = 7", "seed = " + "7" * 5000, "not valid TOML"),
        ("seed = 7", "seed = " + "[" * 5000, "unsupported TOML"),
        ("[friction]", "[[friction]]", "friction = .* is not a table"),
    ],
)
def test_toml_rejections(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in TOML
    path = written(tmp_path, "bad.toml", TOML.replace(old, new, 1))
    with pytest.raises(InputError, match=f"bad.toml: {words}"):
        read_rock_mass(path)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("kappa, low", "kapa, low", "line 2: the columns are .*kapa"),
        ("variable, d", "name, d", "line 2: the columns are name"),
        ("value, mean", "mean, mean", "line 2: .*each once"),
        ("seed,,7", "seed,,seven", "line 4: seed: value = 'seven' is not a number"),
        ("seed,,7", "seed,,7,8", "line 4: seed: without a distribution give value only"),
        ("seed,,7", "realisations,,7", "line 4: realisations is given twice"),
        ("seed,,7", "seed,,,,,,,,,,,7", "line 4: 12 cells under 10 columns"),
        ("41 44.5", "4" * 200_000, "line 8: not a CSV file"),
        ("41 44.5", "41 x", "line 8: back.dip_deg: values = 'x' is not a number"),
        ("back.dip_deg,", "back.dip,", "unknown key back.dip"),
        ("block.back_fracture,,false", "block.back_fracture,,0", "block.back_fracture = 0"),
    ],
)
def test_csv_rejections(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in CSV
    path = written(tmp_path, "bad.csv", CSV.replace(old, new, 1))
    with pytest.raises(InputError, match=f"bad.csv: {words}"):
        read_rock_mass(path)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfd\x00variable")
    written(tmp_path, "empty.csv", "")
    for name, words in (
        ("none.toml", "no such file"),
        ("folder.toml", "is a folder"),
        ("bytes.csv", "not a text file"),
        ("mass.json", "use .toml or .csv"),
        ("empty.csv", "is empty"),
    ):
        with pytest.raises(InputError, match=words):
            read_rock_mass(tmp_path / name)
