"""The benchmarks still run, and what they judge by is right."""

from __future__ import annotations

import csv
import importlib
import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from benchmarks import (
    campaign_scale,
    critical_search,
    cvode,
    page,
    search_times,
    start_up,
    work_precision,
)
from benchmarks.critical_search import choose_combinations, compare_searches, search_runs
from benchmarks.page import RECORDS_VARIABLE, find_records
from benchmarks.reference import reference
from benchmarks.rocking_peer import RESTITUTION, rocking_methods, rocking_reference
from benchmarks.work_precision import methods
from rbfrag.bench.peers import PeerAnswer, Records, choose_cases
from rbfrag.bench.work_precision import (
    BenchMethod,
    measure,
    ratio,
    refined_run,
    seconds,
    taylor_run,
)
from rbfrag.cli.commands import bench
from rbfrag.cli.main import app
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.sample_motions import reversal_pulse
from tests.solver.reference import integrate
from tests.solver.rocking_reference import FreeStandingBlock
from tests.solver.rocking_reference import integrate as integrate_rocking
from tests.synthetic import shaking, write_at2

FILES = 4


@pytest.fixture
def records() -> Records:
    motions = tuple(GroundMotion(shaking(seed, npts=400), 0.02) for seed in range(3))
    return Records((*motions, reversal_pulse(0.4, 0.65, 0.5, 0.02)), "made up")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    place = tmp_path / "records"
    place.mkdir()
    for seed in range(FILES):
        event = f"PLACE {seed} 01/02/7{seed}"
        write_at2(place / f"{seed}.AT2", shaking(seed, npts=400), event=event)
    return place


def test_reference_agrees_with_the_independent_integrator(records: Records) -> None:
    seen = set()
    for case in choose_cases(records, 10):
        ours = reference(case)
        other = integrate(case.excitation.time_s, case.excitation.k_h, None, p2=case.p2, kr=case.kr)
        seen.add(other.outcome)
        assert ours.outcome == other.outcome
        if other.peak_rad is not None:
            assert ours.peak_rad == pytest.approx(other.peak_rad, rel=2e-12)
    assert seen == {"stable", "toppled"}


def test_finer_steps_judge_as_extended_precision_does(records: Records) -> None:
    for case in choose_cases(records, 10):
        finer, truth = refined_run(case), reference(case)
        assert finer.outcome == truth.outcome
        assert finer.peak_rad == pytest.approx(truth.peak_rad, rel=1e-12, nan_ok=True)


def test_every_method_solves_the_same_problem(records: Records) -> None:
    cases = choose_cases(records, 4)
    rows = measure(cases, methods(), judge=reference)
    assert [row.of_use for row in rows].count(True) == 1
    for row in rows:
        assert row.cases == len(cases)
        assert row.wrong == 0, row
        assert row.error_median is not None
        assert row.error_worst is not None
        if "Euler" not in row.family:
            assert row.error_worst < 1e-2, row
        if row.of_use:
            assert row.error_worst < 1e-12
            assert row.slower == row.slower_least == 1.0


def test_the_reference_of_free_blocks_agrees_with_the_independent_integrator(
    records: Records,
) -> None:
    seen = set()
    for case in choose_cases(records, 8):
        ours = rocking_reference(case)
        block = FreeStandingBlock(
            c=dict.fromkeys((1, -1), math.atan(case.kr)),
            p2=dict.fromkeys((1, -1), case.p2),
            e=dict.fromkeys((1, -1), RESTITUTION),
        )
        excited = case.excitation
        other = integrate_rocking(excited.time_s, excited.k_h, excited.w, block)
        seen.add(ours.outcome)
        assert ours.outcome == ("toppled" if other.toppled else "stable")
        if not other.toppled:
            assert ours.peak_rad == pytest.approx(max(other.peak.values()), rel=1e-8)
    assert seen == {"stable", "toppled"}


def test_every_method_rocks_the_same_blocks(records: Records) -> None:
    cases = choose_cases(records, 4)
    rows = measure(cases, rocking_methods(), judge=rocking_reference)
    assert [row.setting for row in rows if row.of_use] == ["order 8"]
    for row in rows:
        assert row.wrong == 0, row
        assert row.error_worst is not None
        assert row.error_worst < (1e-9 if row.of_use else 1e-2)


def test_a_wrong_outcome_and_an_error_are_seen(records: Records) -> None:
    cases = choose_cases(records, 6)
    truth = [reference(case) for case in cases]
    stays = [answer.outcome == "stable" for answer in truth]
    assert len(set(stays)) == 2

    def off(case: object) -> PeerAnswer:
        return PeerAnswer("stable", 1.25 * truth[[c is case for c in cases].index(True)].peak_rad)

    base = BenchMethod("right", "", taylor_run, of_use=True)
    right, wrong = measure(cases, (base, BenchMethod("wrong", "", off)), judge=reference)
    assert right.wrong == 0
    assert wrong.wrong == stays.count(False)
    assert wrong.error_median == pytest.approx(0.25)


def test_without_the_peer_it_is_left_out(records: Records, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cvode, "CVODE_PACKAGE", "a_package_that_is_nowhere")
    assert not [m for m in methods() if "CVODE" in m.family]
    rows = compare_searches(choose_combinations(records, 1))
    assert [row.name for row in rows] == [
        "critical search", "23 runs, rbfrag, side by side", "23 runs, rbfrag, one by one",
    ]  # fmt: skip
    assert rows[0].over_search == rows[1].over_runs == 1.0


def test_with_the_peer_it_runs_the_same_values(records: Records) -> None:
    installed = cvode.cvode_is_installed()
    motion, polarity, p2 = choose_combinations(records, 1)[0]
    assert len(search_runs(motion, polarity, p2)) == 23
    rows = compare_searches([(motion, polarity, p2)], tolerances=(1e-6,))
    assert len(rows) == (4 if installed else 3)
    for row in rows[3:]:
        assert row.wrong is not None
        assert row.wrong <= 3  # the last bisections lie closer to critical than its error


def test_cases_are_drawn_alike_and_lift_off(records: Records) -> None:
    first, again = choose_cases(records, 8, seed=3), choose_cases(records, 8, seed=3)
    assert [(c.p2, c.kr, c.polarity) for c in first] == [(c.p2, c.kr, c.polarity) for c in again]
    assert first[0].kr != choose_cases(records, 8, seed=4)[0].kr
    assert all(c.excitation.max_q > c.kr for c in first)


def test_records_are_found_or_rejected(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "notes.txt").write_text("no accelerogram\n")
    assert len(find_records(folder).motions) == FILES
    monkeypatch.setenv(RECORDS_VARIABLE, str(folder))
    assert len(find_records().motions) == FILES
    monkeypatch.delenv(RECORDS_VARIABLE)
    monkeypatch.setattr("rbfrag.bench.peers.sample_folder", lambda: None)
    assert "pulses" in find_records().source
    empty = tmp_path / "empty"
    empty.mkdir()
    for wrong in (empty, tmp_path / "nowhere"):
        with pytest.raises(InputError, match=wrong.name):
            find_records(wrong)


def test_command_prints_the_table_and_json(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "CASES", 2)
    arguments = ["bench", "--records", str(folder)]
    shown = CliRunner().invoke(app, arguments)
    assert shown.exit_code == 0, shown.output
    for word in ("as used", "forward Euler", "scipy DOP853", "0 of 2"):
        assert word in shown.stdout
    document = json.loads(CliRunner().invoke(app, [*arguments, "--json"]).stdout)
    assert set(document) == {"machine", "records", "seconds", "work_precision"}
    assert {row["cases"] for row in document["work_precision"]} == {2}
    rejected = CliRunner().invoke(app, ["bench", "--records", str(folder / "nowhere")])
    assert rejected.exit_code == 2


@pytest.mark.parametrize(
    ("script", "arguments", "tables"),
    [
        (
            work_precision.main,
            ["--cases", "2", "--only", "order", "Euler"],
            ["work-precision", "work-precision-rocking"],
        ),
        (critical_search.main, ["--combinations", "1", "--rtol", "1e-5"], ["critical-search"]),
        (start_up.main, ["--repeat", "1", "--no-cold"], ["start-up", "shell-start"]),
        (search_times.main, ["--every", "9"], ["search-times"]),
        (campaign_scale.main, ["--motions", "2"], ["campaign-default"]),
    ],
    ids=lambda value: value.__module__ if callable(value) else "",
)
def test_scripts_run_and_fill_their_places_in_the_page(
    script: Callable[[list[str]], None],
    arguments: list[str],
    tables: list[str],
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    module = importlib.import_module(script.__module__)
    monkeypatch.setattr(page, "RESULTS", tmp_path / "results")
    if hasattr(module, "FIGURE"):
        monkeypatch.setattr(module, "FIGURE", tmp_path / "figure.svg")
    script([*arguments, "--records", str(folder), "--out", str(tmp_path), "--write"])
    if script is work_precision.main:
        names = {"work-precision.csv", "work-precision-rocking.csv", "work-precision.png"}
        assert names <= {path.name for path in tmp_path.iterdir()}
        assert (tmp_path / "figure.svg").exists()
        with (tmp_path / "work-precision.csv").open() as file:
            assert {row["cases"] for row in csv.DictReader(file)} == {"2"}
    files = list((tmp_path / "results" / "performance").iterdir())
    assert {path.stem for path in files} == set(tables)
    assert all(path.read_text(encoding="utf-8").startswith("|") for path in files)


def test_a_table_goes_to_its_place_in_the_page_or_to_the_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page, "RESULTS", tmp_path / "results")
    shown = tmp_path / "shown.md"
    shown.write_text("a\n<!-- x -->\nold\n<!-- end -->\nb", encoding="utf-8")
    for name in ("x", "y"):
        page.write_table(shown, name, "new")
    assert shown.read_text(encoding="utf-8") == "a\n<!-- x -->\n\nnew\n\n<!-- end -->\nb"
    assert (tmp_path / "results" / "shown" / "y.md").read_text(encoding="utf-8") == "new\n"


def test_numbers_are_short() -> None:
    assert [seconds(t) for t in (2.0, 0.0123, 999.7e-6, 1.24e-5, 3e-8)] == [
        "2 s", "12 ms", "1 ms", "12 µs", "30 ns",
    ]  # fmt: skip
    assert [ratio(r) for r in (0.351, 9.96, 1234.0)] == ["0.35×", "10×", "1,200×"]
