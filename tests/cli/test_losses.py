"""`rbfrag losses` as people and scripts call it."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest

from rbfrag.cli.options import runner
from rbfrag.db.engine import opened_database
from rbfrag.db.models import save_model
from rbfrag.exchange.event_losses import losses
from rbfrag.hazards.event_counts import count_years
from tests.cli.conftest import Rejects, Shell
from tests.exchange.openquake_job import write_job
from tests.fragility.conftest import model_row

BLOCKS = """\
block_id,site_id,p2_1_s2,kr,count,loss,loss_sigma
a,0012,4,0.08,1,100,0.3
b,007,4,0.07,2,50,
c,Z9,4,0.06,,200,0
"""


@pytest.fixture
def job(shell: Shell) -> Path:
    """A job, a table of blocks and a model in the current folder."""
    Path("blocks.csv").write_text(BLOCKS)
    with opened_database("rbfrag.db", create=True) as engine, engine.begin() as connection:
        save_model(connection, model_row())
    return write_job(Path("job"))


def test_the_contract(shell: Shell, job: Path) -> None:
    answer = shell.json("losses", job, "--blocks", "blocks.csv", "--component", "single")
    assert answer["events"] == 5
    assert answer["events_with_shaking"] == 4
    assert answer["samples"] == 100
    rows = answer["blocks"]
    assert [(row["block_id"], row["site_id"]) for row in rows] == [
        ("a", "0012"), ("b", "007"), ("c", "Z9"),
    ]  # fmt: skip
    total = sum(row["average_annual_failures"] for row in rows)
    assert answer["average_annual_failures"] == pytest.approx(total)
    loss = sum(row["average_annual_loss"] for row in rows)
    assert answer["average_annual_loss"] == pytest.approx(loss)
    curve = answer["exceedance"]
    assert [row["count"] for row in curve] == [1.0, 2.0, 3.0]
    assert curve[0]["annual_rate"] == pytest.approx(answer["annual_rate_any"])
    assert 0.0 < answer["annual_rate_any"] < answer["average_annual_failures"]
    intervals = {
        (row["quantity"], row["source"]): (row["low"], row["high"]) for row in answer["uncertainty"]
    }
    # the rate of any failure is that of one or more, and so is its interval
    for source, key in (("event-set sampling", "event_set_sampling"), ("fragility", "fragility")):
        ends = curve[0][f"{key}_low"], curve[0][f"{key}_high"]
        assert intervals["annual_rate_any", source] == pytest.approx(ends)
    low, high = (
        answer["bounds"][law]["annual_rate_any"] for law in ("fully_dependent", "independent")
    )
    assert low <= high
    assert answer["average_annual_failures_error"] > 0.0
    assert answer["average_annual_loss_error"] > 0.0


def test_the_same_in_python(shell: Shell, job: Path) -> None:
    answer = shell.json("losses", job, "--blocks", "blocks.csv", "--samples", "20", "--seed", "4")
    same = losses(job, "blocks.csv", samples=20, seed=4).as_dict()
    assert answer == same
    assert any("assumed to be RotD50" in text for text in answer["warnings"])


def test_table_of_events_and_plot(shell: Shell, job: Path) -> None:
    files = ("--out", "events.csv", "--plot", "curve.svg")
    printed = shell("losses", job, "--blocks", "blocks.csv", *files).stdout
    assert "/yr    4 blocks, 263-year event set" in printed
    assert "Annual rate of events with at least so many failures" in printed
    assert "Annual rate of events with at least such a loss" in printed
    assert "(beyond: rarer than the 263-year event set resolves)" in printed
    assert re.search(r"\d \(beyond\) +\S+–", printed)
    with Path("events.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [
        "event_id", "rlz_id", "year", "annual_weight", "expected_failures", "probability_any",
        "expected_loss", "loss_variance",
    ]  # fmt: skip
    assert [row["event_id"] for row in rows] == ["0", "1", "2", "3", "4"]
    assert float(rows[2]["expected_failures"]) == 0.0
    assert "<svg" in Path("curve.svg").read_text()
    shell("losses", job, "--blocks", "blocks.csv", "--out", "events.parquet", "--expected")


def test_files_by_name_and_time_by_option(shell: Shell, job: Path) -> None:
    complete = shell.json("losses", job, "--blocks", "blocks.csv", "--expected")
    files = [
        part
        for name in ("gmf-data", "events", "sitemesh", "realizations")
        for part in (f"--{name}", str(job / f"{name}_5.csv"))
    ]
    time = ("--investigation-time", "50", "--ses", "2")
    named = shell.json("losses", *files, "--blocks", "blocks.csv", "--expected", *time)
    assert named == complete


def test_what_is_rejected(rejects: Rejects, job: Path) -> None:
    blocks = ("--blocks", "blocks.csv")
    assert "there is no file of gmf-data" in rejects("losses", *blocks)
    assert "is not a folder" in rejects("losses", "nowhere", *blocks)
    assert "no column gmv_PGA" in rejects("losses", job, *blocks, "--imt", "PGA")
    assert "--samples" in rejects("losses", job, *blocks, "--expected", "--samples", "5")
    assert "--plot cannot be combined with" in rejects(
        "losses", job, *blocks, "--expected", "--plot", "a.svg"
    )
    assert "--jobs" in rejects("losses", job, *blocks, "--jobs", "0")
    Path("blocks.csv").write_text("".join(BLOCKS.replace("0012", "12").splitlines(True)[:2]))
    assert "stands at site '12'" in rejects("losses", job, *blocks)


def test_a_scenario(shell: Shell, job: Path) -> None:
    events = [(i, 0, 0) for i in range(4)]
    shaking = [(i, 40.0 + 10.0 * i, "0012") for i in range(4)]
    folder = write_job(
        Path("scenario"), events=events, shaking=shaking, weights=(1.0,), ruptures=False
    )
    answer = shell.json("losses", folder, "--blocks", "blocks.csv")
    assert answer["scenario"]
    assert answer["average_annual_failures"] is None
    assert 0.0 < answer["expected_failures"] < 1.0
    printed = shell("losses", folder, "--blocks", "blocks.csv", "--plot", "curve.png").stdout
    assert "Expected failures           0.5 of 4 blocks" in printed


def test_bounds_are_printed_and_drawn(shell: Shell, job: Path) -> None:
    with opened_database("other.db", create=True) as engine, engine.begin() as connection:
        save_model(connection, model_row(dependence=None))
    about = ("--blocks", "blocks.csv", "--db", "other.db", "--plot", "curve.svg")
    printed = shell("losses", job, *about).stdout
    assert re.search(r"Bounds    at least one failure: return period [\d,]+ years \(ind", printed)
    every = shell("losses", job, *about, "--verbose").stdout
    assert "seed" in every
    assert "seed" not in printed


def test_workers_give_the_same_answer(
    shell: Shell, job: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rbfrag.hazards.losses.PAIRS_AT_ONCE", 1)  # a part for each year
    alone = losses(job, "blocks.csv", samples=30)
    two = losses(job, "blocks.csv", samples=30, run=runner(count_years, 2, None))
    assert two.as_dict() == alone.as_dict()
    assert two.loss_variance.tolist() == alone.loss_variance.tolist()


@pytest.mark.filterwarnings("default::ResourceWarning", "default::DeprecationWarning")
def test_a_cluster_gives_the_same_answer(
    shell: Shell, job: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = pytest.importorskip("distributed")
    alone = shell.json("losses", job, "--blocks", "blocks.csv", "--samples", "30")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as cluster:
        url = ("--scheduler", cluster.scheduler_address)
        assert shell.json("losses", job, "--blocks", "blocks.csv", "--samples", "30", *url) == alone
