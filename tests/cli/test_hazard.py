"""`rbfrag hazard` as people and scripts call it."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import rbfrag
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.models import save_model
from rbfrag.hazards.hazard_rates import merge_similar_warnings
from rbfrag.results.numbers import annual_rate, place, return_period
from tests.block_tables import read_columns
from tests.cli.conftest import Rejects, Shell
from tests.fragility.conftest import model_row


@pytest.fixture
def curve(shell: Shell) -> Path:
    """A power law of PGV in the current folder, with a database of one model beside it."""
    x = np.geomspace(0.01, 10.0, 20)
    lines = [f"{a!r},{b!r}" for a, b in zip(x.tolist(), (1e-3 * x**-2).tolist(), strict=True)]
    path = Path("curve.csv")
    path.write_text("\n".join(["pgv_m_s,annual_rate", *lines]))
    with opened_database("rbfrag.db", create=True) as engine, engine.begin() as connection:
        save_model(connection, model_row())
    return path


def test_one_block(shell: Shell, curve: Path) -> None:
    answer = shell.json("hazard", curve, "--p2", "3", "--kr", "0.1", "--component", "single")
    assert answer["ci_low"] < answer["annual_rate"] < answer["ci_high"]
    assert answer["probability"] == pytest.approx(1 - np.exp(-50 * answer["annual_rate"]))
    assert (answer["years"], answer["imt"], answer["term"]) == (50.0, "PGV", "pgv")
    parts = sum(part["annual_rate"] for part in answer["contributions"])
    assert parts == pytest.approx(answer["annual_rate"], rel=0.05)
    # a steep fragility fails about as often as its median is exceeded: y = 0.566 = 0.72 PGV
    assert answer["annual_rate"] == pytest.approx(1e-3 * (0.566 / 0.72) ** -2, rel=0.05)


def test_a_curve_that_ends_too_early_is_no_answer(shell: Shell, curve: Path) -> None:
    command = ("--p2", "3", "--kr", "0.1", "--component", "single")
    assert "between" not in shell("hazard", curve, *command).stdout.splitlines()[0]
    Path("map.csv").write_text("PGV [m/s],return_period_years\n0.1,475\n0.2,2475\n")
    printed = shell("hazard", "map.csv", *command).stdout
    # shaking above 0.2 m/s comes once in 2,475 years and may fail the block each time
    assert printed.startswith("Return period of failure at least 2,500 years: the hazard curve")


def test_a_single_block_is_described_as_in_a_prediction(shell: Shell, curve: Path) -> None:
    block = ("--p2", "3", "--kr", "0.1")

    def line(*inputs: object) -> str:
        printed = shell(*inputs, *block).stdout.splitlines()
        return next(text for text in printed if text.startswith("Block "))

    described = line("predict", "--pgv", "0.5")
    assert line("hazard", curve) == described
    stands = ("--age", "100", "--kind", "toppling")
    assert described.startswith(f"{line('survival', curve, *stands)}; assumed backed")
    Path("blocks.csv").write_text("p2_1_s2,kr\n3,0.1\n3,0.2\n")
    assert "\nBlock " not in shell("hazard", curve, "--blocks", "blocks.csv").stdout


def test_shares_are_printed_between_the_levels(shell: Shell, curve: Path) -> None:
    printed = shell("hazard", curve, "--p2", "3", "--kr", "0.1", "--component", "single").stdout
    _, head, rows = printed.partition("PGV [m/s]")
    assert head
    lines = rows.splitlines()[1:]
    assert sum(float(line.split()[-1]) for line in lines) == pytest.approx(100.0, abs=0.5)
    assert re.match(r"[\d.]+–[\d.]+ ", lines[0])


def test_what_the_component_means(shell: Shell, curve: Path) -> None:
    block = ("--p2", "3", "--kr", "0.1")
    unsaid = shell.json("hazard", curve, *block)
    assert any("assumed to be of a single" in text for text in unsaid["warnings"])
    single = shell.json("hazard", curve, *block, "--component", "single")
    assert unsaid["annual_rate"] == single["annual_rate"]
    larger = shell.json("hazard", curve, *block, "--component", "larger")
    mean = shell.json("hazard", curve, *block, "--component", "geometric_mean")
    # one component scatters about the mean, which adds to the rate, and lies below the larger one
    assert larger["annual_rate"] < single["annual_rate"] < mean["annual_rate"]


@pytest.mark.parametrize("name", ["rates.csv", "rates.xlsx"])
def test_a_row_that_is_no_block_has_its_reason(shell: Shell, curve: Path, name: str) -> None:
    Path("blocks.csv").write_text(
        "block_id,p2_1_s2,kr\nA7,3,0.1\nbad,x,0.1\nB2,10,0.3\nflat,3,-0.1\nshort,3\n"
    )
    process = shell("hazard", curve, "--blocks", "blocks.csv", "--out", name)
    assert "3 of 5 blocks could not be used and are left out of all sums" in process.stdout
    assert "the first is line 3 (block bad): p2_1_s2 = 'x' is not a number" in process.stdout
    names = ("annual_rate", "block_id", "reason")
    parsed = read_columns(name, names[:1], texts=names[1:])
    assert parsed["block_id"].tolist() == ["A7", "bad", "B2", "flat", "short"]
    assert np.isfinite(parsed["annual_rate"]).tolist() == [True, False, True, False, False]
    assert parsed["reason"].tolist()[:3] == ["", "p2_1_s2 = 'x' is not a number", ""]
    assert "kr = -0.1" in parsed["reason"][3]
    assert parsed["reason"][4] == "2 cells under 3 columns"
    Path("sound.csv").write_text("block_id,p2_1_s2,kr\nA7,3,0.1\nB2,10,0.3\n")
    shell("hazard", curve, "--blocks", "sound.csv", "--out", "sound-rates.csv")
    expected = read_columns("sound-rates.csv", names[:1])["annual_rate"]
    assert parsed["annual_rate"][[0, 2]] == pytest.approx(expected, rel=1e-12)


def test_a_table_of_blocks(shell: Shell, curve: Path) -> None:
    Path("blocks.csv").write_text("block_id,p2_1_s2,kr\nA7,3,0.1\nB2,10,0.3\n")
    shell("hazard", curve, "--blocks", "blocks.csv", "--out", "rates.csv")
    with Path("rates.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["block_id"] for row in rows] == ["A7", "B2"]
    alone = shell.json("hazard", curve, "--p2", "3", "--kr", "0.1")
    assert float(rows[0]["annual_rate"]) == pytest.approx(alone["annual_rate"], rel=1e-8)
    alone = shell.json("hazard", curve, "--blocks", "blocks.csv")
    assert (alone["annual_rate_any"], "bounds" in alone) == (None, False)
    command = ("hazard", curve, "--blocks", "blocks.csv", "--years", "100", "--joint")
    answer = shell.json(*command)
    assert [row["block_id"] for row in answer["blocks"]] == ["A7", "B2"]
    assert set(answer) == {
        "site", "annual_rate_any", "annual_rate_any_ci", "probability_any", "annual_rate_at_least",
        "joint_law", "bounds", "expected_failures_per_year", "expected_failures_upper_bound",
        "expected_failures_low", "expected_failures_high", "years", "level", "how", "model",
        "term", "method", "imt", "curve_kind", "between_measures", "blocks", "warnings",
    }  # fmt: skip
    assert answer["how"] == f"model {answer['model']}"
    separate = [row["annual_rate"] for row in answer["blocks"]]
    assert answer["expected_failures_per_year"] == pytest.approx(sum(separate), rel=1e-12)
    assert max(separate) < answer["annual_rate_any"] < sum(separate)
    # a Poisson process of earthquakes
    assert answer["probability_any"] == pytest.approx(1 - np.exp(-100 * answer["annual_rate_any"]))
    assert any("blocks are assumed to be at one site" in text for text in answer["warnings"])
    printed = shell(*command).stdout
    assert f"return period {return_period(answer['annual_rate_any'])}" in printed
    assert (
        f"Expected failures {annual_rate(answer['expected_failures_per_year'])} /yr of 2 blocks"
        in printed
    )
    assert "At least one failure: return period" in printed
    ends = answer["expected_failures_low"], answer["expected_failures_high"]
    assert ends[0] < sum(separate) < ends[1]
    assert "numerical_error" not in printed
    periods = f"A7 ({return_period(separate[0])}), B2 ({return_period(separate[1])})"
    assert f"Shortest return periods: {periods}" in printed


def test_numbers_of_failures_that_are_asked_for(shell: Shell, curve: Path) -> None:
    rows = "".join(f"b{i},3,{0.1 + 0.01 * i}\n" for i in range(6))
    Path("blocks.csv").write_text("block_id,p2_1_s2,kr\n" + rows)
    answer = shell.json("hazard", curve, "--blocks", "blocks.csv", "--at-least", "3,6")
    counts = {row["count"]: row["annual_rate"] for row in answer["annual_rate_at_least"]}
    assert list(counts) == [1, 3, 6]
    assert counts[1] == answer["annual_rate_any"] > counts[3] > counts[6] > 0.0
    message = shell("hazard", curve, "--blocks", "blocks.csv", "--at-least", "7", expect=2).stderr
    assert "at least 7 failures of 6 blocks" in message
    message = shell("hazard", curve, "--blocks", "blocks.csv", "--at-least", "x", expect=2).stderr
    assert "give whole numbers separated by commas" in message


@pytest.fixture
def logic_tree(formats_dir: Path) -> Path:
    return formats_dir / "openquake_classical_logic_tree" / "three_realizations"


def test_blocks_stand_at_sites_by_their_id(shell: Shell, curve: Path, logic_tree: Path) -> None:
    mean = logic_tree / "hazard_curve-mean-PGV_7.csv"
    head = "block_id,p2_1_s2,kr,site_id\n"
    Path("blocks.csv").write_text(head + "A,3,0.1,SLIDE-A\nB,10,0.2,0012\nC,3,0.2,0012\n")
    answer = shell.json("hazard", mean, "--blocks", "blocks.csv", "--component", "rotd50",
                       "--out", "rates.csv", "--joint")  # fmt: skip
    assert [(row["site"], row["block_id"]) for row in answer["blocks"]] == [
        ("SLIDE-A", "A"), ("0012", "B"), ("0012", "C"),
    ]  # fmt: skip
    assert [site["site"] for site in answer["sites"]] == ["0012"]
    alone = shell.json("hazard", mean, "--site", "SLIDE-A", "--p2", "3", "--kr", "0.1",
                       "--component", "rotd50")  # fmt: skip
    assert answer["blocks"][0]["annual_rate"] == pytest.approx(alone["annual_rate"], rel=1e-9)
    with Path("rates.csv").open() as file:
        assert [row["site"] for row in csv.DictReader(file)] == ["SLIDE-A", "0012", "0012"]
    both = shell.json("hazard", mean, "--blocks", "blocks.csv", "--at-least", "2")
    counts = [[item["count"] for item in site["annual_rate_at_least"]]
              for site in both["sites"] if "annual_rate_at_least" in site]  # fmt: skip
    assert counts == [[1, 2]]
    rejected = shell("hazard", mean, "--blocks", "blocks.csv", "--at-least", "3", expect=2).stderr
    assert "at least 3 failures of" in rejected
    only = shell.json("hazard", mean, "--blocks", "blocks.csv", "--site", "0012")
    assert [row["block_id"] for row in only["blocks"]] == ["B", "C"]
    Path("blocks.csv").write_text(head + "A,3,0.1,12\n")
    message = shell("hazard", mean, "--blocks", "blocks.csv", expect=2).stderr
    assert "stands at site '12', of which there is no curve" in message
    unnamed = shell.json("hazard", curve, "--blocks", "blocks.csv")
    assert any("site_id of the blocks is not used" in text for text in unnamed["warnings"])


def test_blocks_stand_at_the_nearest_site_by_place(
    shell: Shell, logic_tree: Path, formats_dir: Path
) -> None:
    """A place and the identifier of its site give the same answer, for curves and events."""
    mean = logic_tree / "hazard_curve-mean-PGV_7.csv"
    events = formats_dir / "openquake_event_based" / "one_realization"
    with (events / "sitemesh_1.csv").open() as file:
        sites = list(csv.DictReader(list(file)[1:]))[:3]
    by_id = [f"B{i},3,0.1,{site['custom_site_id']}" for i, site in enumerate(sites)]
    by_place = [
        f"B{i},3,0.1,{float(site['lon']) + 0.0004},{site['lat']}" for i, site in enumerate(sites)
    ]
    Path("id.csv").write_text("\n".join(["block_id,p2_1_s2,kr,site_id", *by_id]))
    Path("place.csv").write_text(
        "\n".join(["block_id,p2_1_s2,kr,lon,lat", *by_place, "F,3,.1,0,0"])
    )
    for command in (("hazard", mean), ("losses", events, "--expected")):
        rates = []
        for table in ("id.csv", "place.csv"):
            answer = shell.json(*command, "--blocks", table, "--component", "rotd50")
            blocks = answer.get("blocks") or answer["answers"]
            rates.append(
                {
                    row["block_id"]: row.get("annual_rate", row.get("average_annual_failures"))
                    for row in blocks
                }
            )
        assert any("at the nearest sites" in text for text in answer["warnings"])
        assert any("within_km is 5" in str(row.get("reason")) for row in blocks)
        assert rates[1].pop("F") is None
        assert rates[1] == pytest.approx(rates[0], rel=1e-12)
        message = shell(*command, "--blocks", "place.csv", "--within-km", "0.001", expect=2).stderr
        assert "km away" in message
    Path("nowhere.csv").write_text("block_id,p2_1_s2,kr\nA,3,0.1\nB,3,0.1\n")
    message = shell("hazard", mean, "--blocks", "nowhere.csv", expect=2).stderr
    assert "2 of 2 blocks have no site" in message


def test_places_have_letters_for_signs() -> None:
    assert place(-122.005, 37.1) == "37.100 N, 122.005 W"
    assert place(174.79, -41.3) == "41.300 S, 174.790 E"


def test_branches_with_openquakes_weights(shell: Shell, curve: Path, logic_tree: Path) -> None:
    branches = sorted(logic_tree.glob("hazard_curve-rlz-*-PGV_7.csv"))
    command = ("--site", "RIDGE_2", "--p2", "3", "--kr", "0.1", "--component", "rotd50")
    answer = shell.json("hazard", *branches, *command, "--weights",
                       logic_tree / "realizations_7.csv")  # fmt: skip
    separate = [shell.json("hazard", branch, *command)["annual_rate"] for branch in branches]
    assert answer["annual_rate"] == pytest.approx(np.dot((0.5, 0.3, 0.2), separate), rel=1e-6)
    assert answer["logic_tree_low"] == pytest.approx(min(separate), rel=1e-9)
    assert answer["logic_tree_high"] == pytest.approx(max(separate), rel=1e-9)
    # the branches and what is not known of the model together
    assert answer["annual_rate_p05"] < min(separate) < answer["annual_rate_p50"]
    assert max(separate) < answer["annual_rate_p95"]
    assert answer["curve_kind"] == "weighted branches"
    assert [row["weight"] for row in answer["branches"]] == pytest.approx([0.5, 0.3, 0.2])
    # the engine's mean curve is that of the branches
    mean = shell.json("hazard", logic_tree / "hazard_curve-mean-PGV_7.csv", *command)
    assert mean["curve_kind"] == "mean"
    assert answer["annual_rate"] == pytest.approx(mean["annual_rate"], rel=2e-3)
    middle = shell.json("hazard", logic_tree / "quantile_curve-0.5-PGV_7.csv", *command)
    assert any("quantile-0.5 is not a realization" in w for w in middle["warnings"])
    printed = shell("hazard", *branches, *command, "--weights", "0.5,0.3,0.2").stdout
    assert "rlz-002" in printed
    other = shell("hazard", branches[0], curve, *command[2:], expect=2).stderr
    assert "give curves of the same sites" in other


def test_drained_rates_are_of_all_branches(shell: Shell, curve: Path) -> None:
    lines = curve.read_text().splitlines()
    rows = [(level, 2.0 * float(rate)) for level, rate in (line.split(",") for line in lines[1:])]
    Path("other.csv").write_text(
        "\n".join([lines[0], *(f"{level},{rate!r}" for level, rate in rows)])
    )
    wet = ("--height", "2.4", "--width", "0.5", "--dip", "3", "--phi", "35", "--water", "0.4")
    dry = shell.json("hazard", curve, *wet[:-2], "--component", "single")["annual_rate"]
    weighted = "hazard", curve, "other.csv", "--weights", "0.25,0.75", *wet
    answer = shell.json(*weighted, "--component", "single")["drained"]
    assert answer["annual_rate"] == pytest.approx(1.75 * dry, rel=1e-9)


def test_a_rock_mass_is_one_class(shell: Shell, curve: Path) -> None:
    Path("mass.toml").write_text(
        "realisations = 300\nseed = 2\n[base]\ndip_deg = 5.0\n"
        'spacing_m = { distribution = "uniform", low = 1.0, high = 2.0 }\n'
        "[back]\ndip_deg = 85.0\nspacing_m = 0.4\n[friction]\nphi_deg = 40.0\n"
    )
    document = shell.json("hazard", curve, "--rockmass", "mass.toml", "--component", "rotd50",
                       "--out", "rates.csv")  # fmt: skip
    shell("rockmass", "mass.toml", "--out", "blocks.csv")
    with Path("blocks.csv").open() as file:
        rows = [r for r in csv.DictReader(file) if r["mode"] == "topple" and float(r["kr"]) > 0]
    with Path("each.csv").open("w") as file:
        writer = csv.writer(file)
        writer.writerow(["block_id", "p2_1_s2", "kr"])
        writer.writerows([r["block_id"], r["p2_1_s2"], r["kr"]] for r in rows)
    separate = shell.json("hazard", curve, "--blocks", "each.csv", "--component", "rotd50")[
        "blocks"
    ]
    # the mean of the rates is the rate of the mean fragility
    mean = np.mean([answer["annual_rate"] for answer in separate])
    assert document["annual_rate"] == pytest.approx(mean, rel=1e-9)
    assert (
        min(item["ci_low"] for item in separate) < document["ci_low"] < mean < document["ci_high"]
    )
    with Path("rates.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert (row["block_id"], row["kr"]) == ("rock mass", "")


def test_plot(shell: Shell, curve: Path) -> None:
    shell("hazard", curve, "--p2", "3", "--kr", "0.1", "--plot", "rate.svg")
    assert "fraction of the rate" in Path("rate.svg").read_text()


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("sa(0.5)_g,annual_rate\n0.1,0.01\n0.5,0.001\n", ("--model", "wls-pgv"),
         "model 'wls-pgv' requires --pgv"),
        ("pga_g,annual_rate\n0.1,0.01\n0.5,0.001\n", (),
         "PGA alone is biased; give a curve of PGV or SA, or the --disaggregation by"),
        ("pgv_m_s,annual_rate\n0.1,0.01\n0.5,0.001\n", ("--convert-sigma", "0.5"),
         "--convert-sigma requires --convert"),
        ("sa(1)_g,annual_rate\n0.1,0.01\n0.5,0.001\n",
         ("--convert", "newmark_hall_1982", "--convert-sigma", "0"), "give the standard deviation"),
        ("sa(2)_g,annual_rate\n0.1,0.01\n0.5,0.001\n",
         ("--convert", "newmark_hall_1982"), "is for SA(1), not for SA(2)"),
        ("pgv_m_s,annual_rate\n0.1,0.01\n0.5,0.001\n",
         ("--convert", "newmark_hall_1982"), "the curve is of PGV"),
        ("pgv_m_s,annual_rate\n0.1,0.01\n0.5,0.001\n", ("--convert", "x"), "conversion 'x'"),
        ("pgv_m_s,annual_rate\n0.1,0.01\n0.5,0.001\n", ("--component", "x"), "component 'x'"),
        ("pgv_m_s,annual_rate\n0.1,0.01\n0.5,0.001\n", ("--years", "0"), "years = 0"),
        ("pgv_m_s,annual_rate\n0.1,0.01\n0.5,0.001\n", ("--site", "4"), "no site '4'"),
        ("pgv_m_s,annual_rate\n0.1,0.01\n0.5,0.02\n", (), "the rate rises"),
    ],
)  # fmt: skip
def test_rejections(
    rejects: Callable[..., str], curve: Path, text: str, options: tuple[str, ...], words: str
) -> None:
    Path("other.csv").write_text(text)
    message = rejects("hazard", "other.csv", "--p2", "3", "--kr", "0.1", *options)
    assert words in message


def test_blocks_that_do_not_wait_are_rejected(rejects: Callable[..., str], curve: Path) -> None:
    Path("blocks.csv").write_text("block_id,p2_1_s2,kr\nA7,3,-0.1\n")
    assert "block A7" in rejects("hazard", curve, "--blocks", "blocks.csv")
    assert "--blocks cannot be combined with --p2" in rejects(
        "hazard", curve, "--blocks", "blocks.csv", "--p2", "3"
    )


@pytest.mark.parametrize(("p2", "kr"), [("0", "0.1"), ("nan", "0.1"), ("3", "-0.1"), ("3", "inf")])
def test_a_block_that_waits_for_no_earthquake_is_rejected(
    shell: Shell, curve: Path, p2: str, kr: str
) -> None:
    message = shell("hazard", curve, f"--p2={p2}", f"--kr={kr}", expect=2).stderr
    assert "above" in message or "is not a number" in message or "beyond any block" in message


def test_free_standing_blocks_with_their_restitution(shell: Shell, rejects: Rejects) -> None:
    Path("curve.csv").write_text("pgv_m_s,annual_rate\n0.05,0.02\n0.5,0.002\n2,0.0001\n")
    Path("b.csv").write_text(
        "block_id,p2_1_s2,kr,restitution,kr_sigma\nA,7,0.2,,0.1\nB,7,0.2,0.8,\n"
    )
    command = ("hazard", "curve.csv", "--component", "single", "--kind", "rocking")
    answer = shell.json(*command, "--blocks", "b.csv")
    rows = answer["blocks"]
    # what a block may be is integrated
    uncertain = ("--kr-sigma", "0.1")
    for row, value in zip(rows, (uncertain, ("--restitution", "0.8")), strict=True):
        document = shell.json(*command, "--p2", "7", "--kr", "0.2", *value)
        assert document["model"] == "rocking-pgv"
        assert row["annual_rate"] == pytest.approx(document["annual_rate"], rel=1e-6)
    assert rows[1]["annual_rate"] < rows[0]["annual_rate"]
    shape = shell.json(*command, "--height", "2", "--width", "0.5")
    kr = shell.json(*command, "--p2", repr(rbfrag.Block.rectangle(2.0, 0.5).p2), "--kr", "0.25")
    assert shape["annual_rate"] == pytest.approx(kr["annual_rate"], rel=1e-6)
    backed = ("hazard", "curve.csv", "--p2", "7", "--kr", "0.2", "--restitution", "0.8")
    assert shell.json(*backed)["model"] == "rocking-pgv"
    rejected = rejects(*backed, "--kind", "toppling")
    assert "--restitution cannot be combined with kind toppling" in rejected
    wrong = (*command, "--p2", "7", "--kr", "0.2", "--restitution", "1.2")
    assert "restitution = 1.2" in rejects(*wrong)


def test_a_standing_rock_is_uncertain_in_its_restitution_too(shell: Shell) -> None:
    Path("curve.csv").write_text("pgv_m_s,annual_rate\n0.05,0.02\n0.5,0.002\n2,0.0001\n")
    command = (
        "survival", "curve.csv", "--component", "single", "--kind", "rocking", "--p2", "7",
        "--kr", "0.2", "--restitution", "0.85", "--age", "500",
    )  # fmt: skip
    certain = shell.json(*command)
    nearly = shell.json(*command, "--restitution-sigma", "1e-6")
    assert nearly["probability_standing"] == pytest.approx(
        certain["probability_standing"], rel=1e-5
    )
    values = np.linspace(0.85 - 0.2, 0.85 + 0.15, 301)
    weight = np.exp(-0.5 * ((values - 0.85) / 0.05) ** 2)
    curve = rbfrag.read_hazard_curves("curve.csv")[0]
    standing = [
        rbfrag.survival(
            curve, 7.0, 0.2, age_years=500.0, kind="rocking", restitution=e, component="single"
        ).probability_standing
        for e in values[::10]
    ]
    mean = float(np.average(standing, weights=weight[::10]))
    document = shell.json(*command, "--restitution-sigma", "0.05")
    assert document["probability_standing"] == pytest.approx(mean, rel=2e-3)
    assert document["probability_standing"] != certain["probability_standing"]


def test_warnings_are_counted_by_kind() -> None:
    texts = ["curve 1: coarse", "of all", "curve 2: coarse", "of all", "curve 10: coarse"]
    assert merge_similar_warnings(texts) == ("curve 1: coarse (and 2 more of the kind)", "of all")


def test_several_blocks_without_a_site_are_rejected(rejects: Rejects, logic_tree: Path) -> None:
    Path("blocks.csv").write_text("block_id,p2_1_s2,kr\nA,3,0.1\nB,10,0.2\n")
    mean = logic_tree / "hazard_curve-mean-PGV_7.csv"
    message = rejects("hazard", mean, "--blocks", "blocks.csv")
    assert "2 of 2 blocks have no site" in message


def test_curves_of_several_measures_are_no_branches(rejects: Rejects) -> None:
    Path("sa.csv").write_text("sa(0.5)_g,annual_rate\n0.1,0.01\n0.5,0.001\n")
    Path("pgv.csv").write_text("pgv_m_s,annual_rate\n0.1,0.01\n0.5,0.001\n")
    block = ("--p2", "3", "--kr", "0.1", "--db", REFERENCE)
    for order in (("sa.csv", "pgv.csv"), ("pgv.csv", "sa.csv")):
        message = rejects("hazard", *order, "--weights", "0.5,0.5", *block)
        named = ", ".join("PGV" if name == "pgv.csv" else "SA(0.5)" for name in order)
        assert f"the curves are of {named}: give curves of one measure" in message


def test_a_rate_of_pga_names_a_model_of_the_kind(rejects: Rejects, shell: Shell) -> None:
    Path("pga.csv").write_text("pga_g,annual_rate\n0.1,0.01\n0.5,0.001\n")
    block = ("--p2", "3", "--kr", "0.1", "--db", REFERENCE)
    for kind, model in (("toppling", "toppling-pga"), ("rocking", "rocking-pga")):
        message = rejects("hazard", "pga.csv", *block, "--kind", kind)
        assert f"accept the bias with --model {model}" in message
        shell("hazard", "pga.csv", *block, "--kind", kind, "--model", model)
