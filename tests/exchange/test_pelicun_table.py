"""pelicun tables: the samples, the way there and back, and rows that are not whole."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.exchange.fragility_function import discrete_function, lognormal_function, renamed
from rbfrag.exchange.pelicun_table import metadata_text, pelicun_text, read_pelicun
from rbfrag.hazards.curve import IntensityType

PGV = IntensityType("pgv_m_s", 0.01)


def test_hazus_buildings(formats_dir: Path) -> None:
    parsed = read_pelicun(formats_dir / "simcenter_hazus_v6.1_building_fragility.csv")
    single = next(f for f in parsed if f.name == "LF.W1.HC" and f.limit_state == "LS1")
    assert (single.median, single.beta, single.kind.measure) == (0.26, 0.4, "pga_g")


def test_other_demands_are_passed_over(formats_dir: Path) -> None:
    for name in ("simcenter_fema_p58_component_fragility.csv", "pelicun_damage_db_small.csv"):
        assert read_pelicun(formats_dir / name) == []


def test_there_and_back(tmp_path: Path) -> None:
    x = np.geomspace(0.1, 2.0, 60)
    p = 1.0 - np.exp(-((x / 0.7) ** 3))
    curved = discrete_function("curved", "toppled", PGV, x, p, "test")
    smooth = lognormal_function("smooth", "toppled", PGV, 0.4321, 0.3, "test")
    path = tmp_path / "a.csv"
    path.write_text(pelicun_text([curved, smooth]))
    rows = list(csv.DictReader(path.read_text().splitlines()))
    for row in rows:
        assert (row["Demand-Offset"], row["Demand-Directional"]) == ("0", "1")
    back = {f.name: f for f in read_pelicun(path)}
    inside = np.linspace(0.1, 2.0, 500)
    assert np.abs(back["smooth"].at(inside) - smooth.at(inside)).max() < 1e-9
    assert np.abs(back["curved"].at(inside) - curved.at(inside)).max() < 1e-5  # six digits
    assert back["curved"].probability is not None
    assert (back["curved"].probability[0], back["curved"].probability[-1]) == (0.0, 1.0)
    assert (np.diff(back["curved"].probability) > 1e-8).all()


def test_what_cannot_be_written() -> None:
    single = lognormal_function("a", "toppled", PGV, 0.5, 0.3, "test")
    with pytest.raises(InputError, match="no fragility function"):
        pelicun_text([])
    with pytest.raises(InputError, match="'a' occurs twice"):
        pelicun_text([single, single])


def test_ids_have_no_dashes() -> None:
    named = [lognormal_function(name, "toppled", PGV, 0.5, 0.3, "test") for name in ("A-7", "B")]
    functions, warnings = renamed(named, "-", ".", "a loader splits at")
    assert [f.name for f in functions] == ["A.7", "B"]
    assert "'A-7' is written as 'A.7'" in warnings[0]
    assert renamed(functions, "-", ".", "a loader splits at")[1] == []
    for name in ("A-7", " ", "_x", "References"):
        with pytest.raises(InputError, match="an ID of a fragility table has no dash"):
            pelicun_text([lognormal_function(name, "toppled", PGV, 0.5, 0.3, "test")])
    twice = [lognormal_function(name, "toppled", PGV, 1, 1, "test") for name in ("A-7", "A.7")]
    with pytest.raises(InputError, match=r"'A\.7' occurs twice"):
        pelicun_text(renamed(twice, "-", ".", "a loader splits at")[0])


def test_the_description_has_what_the_library_asks_for() -> None:
    functions = [lognormal_function(n, "toppled", PGV, 0.5, 0.3, "test") for n in ("A", "B")]
    text = metadata_text(functions, ["one", "two"], ("m", "pgv", "lognormal"), "the larger of two")
    document = json.loads(text)
    general, references = document.pop("_GeneralInformation"), document.pop("References")
    assert set(general) == {"ShortName", "Description", "Version", "ComponentGroups"}
    assert list(document) == ["A", "B"]
    for entry in document.values():
        assert set(entry) == {
            "Description", "Comments", "SuggestedComponentBlockSize", "RoundUpToIntegerQuantity",
            "Reference", "LimitStates",
        }  # fmt: skip
        assert set(entry["Reference"]) <= set(references)
        assert list(entry["LimitStates"]) == ["LS1"]
        assert entry["LimitStates"]["LS1"]["DS1"]["Description"]
    assert document["B"]["Description"] == "two"


HEAD = (
    "ID,Incomplete,Demand-Type,Demand-Unit,Demand-Offset,Demand-Directional,LS1-Family,"
    "LS1-Theta_0,LS1-Theta_1,LS1-DamageStateWeights\n"
)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("ID,x\n", "line 1: there is no column Demand-Type"),
        (HEAD + "a,0,Peak Ground Velocity,mps\n", "line 2: 4 cells under 10 columns"),
        (
            HEAD + "a,0,Peak Ground Velocity,knots,0,0,lognormal,1,1,\n",
            "in 'knots' is not supported",
        ),
        (HEAD + "a,0,Peak Ground Velocity,mps,0,0,lognormal,x,1,\n", "Theta_0: 'x' is not"),
        (HEAD + "a,0,Peak Ground Velocity,mps,0,0,lognormal,-1,1,\n", "median is -1"),
        (HEAD + "a,0,Peak Ground Velocity,mps,0,0,lognormal,1,,\n", "Theta_1: '' is not"),
        (HEAD + "a,0,Peak Ground Velocity,mps,0,0,gamma,1,1,\n", "family 'gamma' is not supported"),
        (HEAD + 'a,0,Peak Ground Velocity,mps,0,0,multilinear_CDF,"1,2",,\n', "levels|probab"),
        (HEAD + 'a,0,Peak Ground Velocity,mps,0,0,multilinear_CDF,"2,1|0,1",,\n', "must increase"),
    ],
)
def test_bad_tables_are_rejected(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words.replace("|", r"\|")):
        read_pelicun(path)


def test_incomplete_rows_are_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(HEAD + "a,1,Peak Ground Velocity,mps,0,0,lognormal,,,\n")
    assert read_pelicun(path) == []
