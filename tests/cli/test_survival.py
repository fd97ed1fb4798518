"""`rbfrag survival` as people and scripts call it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rbfrag.db.engine import opened_database
from rbfrag.db.models import save_model
from tests.cli.conftest import Shell
from tests.fragility.conftest import model_row

BLOCK = ("--p2", "3", "--kr", "0.1", "--kind", "toppling", "--component", "single")
TREE = "openquake_classical_logic_tree/three_realizations"


def written(path: str, times: float = 1.0) -> str:
    x = np.geomspace(0.01, 10.0, 20)
    lines = [
        f"{a!r},{b!r}" for a, b in zip(x.tolist(), (times * 1e-3 * x**-2).tolist(), strict=True)
    ]
    Path(path).write_text("\n".join(["pgv_m_s,annual_rate", *lines]))
    return path


@pytest.fixture
def curve(shell: Shell) -> str:
    """A power law of PGV in the current folder, with a database of one model beside it."""
    with opened_database("rbfrag.db", create=True) as engine, engine.begin() as connection:
        save_model(connection, model_row())
    return written("curve.csv")


def test_one_block(shell: Shell, curve: str) -> None:
    answer = shell.json("survival", curve, *BLOCK, "--age", "200")
    rate = shell.json("hazard", curve, *BLOCK)["annual_rate"]
    assert answer["annual_rate_any"] == pytest.approx(rate, rel=1e-4)
    assert answer["probability_standing"] == pytest.approx(math.exp(-200 * rate), rel=1e-4)
    assert answer["factor_5_percent"] == pytest.approx(math.log(20) / (200 * rate), rel=1e-4)
    assert answer["factor_50_percent"] == pytest.approx(math.log(2) / (200 * rate), rel=1e-4)
    (branch,) = answer["branches"]
    assert (branch["weight"], branch["weight_given_standing"]) == (None, None)
    assert (answer["bounds"], answer["imt"], answer["kind"]) == (None, "PGV", "toppling")
    assert any("backed by a rock face" in text for text in answer["warnings"])


def test_a_sentence_goes_before_the_numbers(shell: Shell, curve: str) -> None:
    first, second, *_ = shell("survival", curve, *BLOCK, "--age", "5000").stdout.splitlines()
    assert first.startswith("P(still standing after 5,000 years) = ")
    assert re.search(r" %   \(95 % confidence interval [\d.<]+–[\d.]+ %\)$", first)
    assert re.fullmatch(r"Return period of failure [\d,]+ years", second)
    old = shell("survival", curve, *BLOCK, "--age", "5000").stdout
    assert "rejected at the 5 % level: consistent only if all its rates are multiplied by" in old
    calm = shell("survival", curve, *BLOCK, "--age", "50").stdout
    assert "is not rejected at the 5 % level" in calm
    safe = ("--p2", "3", "--kr", "500", "--kind", "toppling", "--component", "single")
    assert (
        "is not rejected at the 5 % level" in shell("survival", curve, *safe, "--age", "9").stdout
    )


def test_a_table_has_its_own_sigmas(shell: Shell, curve: str) -> None:
    Path("one.csv").write_text("block_id,p2_1_s2,kr,kr_sigma,p2_sigma\nA7,3,0.1,0.2,\n")
    command = ("--component", "single", "--kind", "toppling", "--age", "200")
    table = shell.json("survival", curve, "--blocks", "one.csv", "--kr-sigma", "0.7", *command)
    alone = shell.json("survival", curve, *BLOCK, "--kr-sigma", "0.2", "--age", "200")
    assert table["probability_standing"] == alone["probability_standing"]
    Path("two.csv").write_text("p2_1_s2,kr\n3,0.1\n3,0.1\n")
    both = shell.json("survival", curve, "--blocks", "two.csv", *command)
    assert both["blocks"] == 2
    assert set(both["bounds"]) == {"independent", "fully_dependent"}
    printed = shell("survival", curve, "--blocks", "two.csv", *command)
    assert "P(all 2 blocks still standing after 200 years)" in printed.stdout
    assert "fully dependent  " in printed.stdout


def test_weights_in_the_order_of_the_curves(shell: Shell, curve: str) -> None:
    other = written("other.csv", 3.0)
    command = (curve, other, *BLOCK, "--age", "300")
    answer = shell.json("survival", *command, "--weights", "0.4,0.6")
    first, second = answer["branches"]
    complete = 0.4 * first["probability_standing"] + 0.6 * second["probability_standing"]
    assert answer["probability_standing"] == pytest.approx(complete, rel=1e-9)
    assert first["weight_given_standing"] == pytest.approx(
        0.4 * first["probability_standing"] / complete, rel=1e-9
    )
    assert shell.json("survival", *command)["probability_standing"] == first["probability_standing"]
    assert "The hazard of" in shell("survival", *command, "--weights", "0.4,0.6").stdout


def test_branches_of_openquake(shell: Shell, curve: str, formats_dir: Path) -> None:
    tree = formats_dir / TREE
    files = [tree / f"hazard_curve-{name}-PGV_7.csv" for name in ("mean", "rlz-000", "rlz-001")]
    files += [tree / "hazard_curve-rlz-002-PGV_7.csv", tree / "quantile_curve-0.84-PGV_7.csv"]
    command = ("--site", "SLIDE-A", *BLOCK, "--age", "3000")
    weights = ("--weights", tree / "realizations_7.csv")
    answer = shell.json("survival", *files, *command, *weights, "--plot", "tree.svg")
    assert [branch["name"] for branch in answer["branches"]] == [
        "mean", "rlz-000", "rlz-001", "rlz-002", "quantile-0.84"
    ]  # fmt: skip
    before = [branch["weight"] for branch in answer["branches"]]
    assert before[1:4] == pytest.approx([0.5, 0.3, 0.2], abs=1e-6)
    assert (before[0], before[4], answer["site"]) == (None, None, "SLIDE-A")
    after = [branch["weight_given_standing"] for branch in answer["branches"][1:4]]
    assert sum(after) == pytest.approx(1.0, rel=1e-12)
    rates = [branch["annual_rate_any"] for branch in answer["branches"][1:4]]
    calmest = int(np.argmin(rates))
    assert after[calmest] > before[1 + calmest]
    drawn = Path("tree.svg").read_text()
    for word in ("quantile-0.84", "weight given standing", "factor on all hazard rates"):
        assert word in drawn


def test_rejections_of_a_logic_tree(
    rejects: Callable[..., str], curve: str, formats_dir: Path
) -> None:
    tree = formats_dir / TREE
    branch, weights = tree / "hazard_curve-rlz-000-PGV_7.csv", tree / "realizations_7.csv"
    command = (*BLOCK, "--age", "3000")
    at = ("--site", "SLIDE-A")
    assert "choose it by number or name" in rejects("survival", branch, *command)
    assert "add up to 0.5, not 1" in rejects(
        "survival", branch, *at, *command, "--weights", weights
    )
    assert "none of the curves is one" in rejects("survival", curve, *command, "--weights", weights)
    Path("few.csv").write_text("rlz_id,branch_path,weight\n1,A~B,1.0\n")
    message = rejects("survival", branch, *at, *command, "--weights", "few.csv")
    assert "there is no rlz_id 0" in message
    Path("none.csv").write_text("rlz_id,weight\n0,half\n")
    message = rejects("survival", branch, *at, *command, "--weights", "none.csv")
    assert "is not a realization" in message
    other = tree / "hazard_curve-mean-PGA_7.csv"
    assert "curves are of PGV, PGA" in rejects("survival", branch, other, *at, *command)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--age", "0"), "age = 0 years"),
        (("--age", "100", "--age-sd=-1"), "standard deviation of the age"),
        (("--age", "100", "--kr-sigma=-1"), "kr_sigma = -1"),
        (("--age", "100", "--weights", "0.5,0.5"), "2 weights for 1 curves"),
        (("--age", "100", "--kind", "rolling"), "rolling"),
        (("--age", "100", "--plot", "plot.xls"), ".png"),
    ],
)
def test_rejections(
    rejects: Callable[..., str], curve: str, options: tuple[str, ...], words: str
) -> None:
    assert words in rejects("survival", curve, *BLOCK, *options)


def test_a_sigma_below_zero_is_rejected_by_name(rejects: Callable[..., str], curve: str) -> None:
    Path("one.csv").write_text("block_id,p2_1_s2,kr,kr_sigma\nA7,3,0.1,-0.2\n")
    message = rejects(
        "survival", curve, "--blocks", "one.csv", "--kind", "toppling", "--age", "100"
    )
    assert "line 2 (block A7): kr_sigma = -0.2 is negative" in message
