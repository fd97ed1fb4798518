"""The study of the certificate still runs, and would see a wrong verdict."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.certify import __main__ as certify
from benchmarks.certify import borders, islands
from benchmarks.certify.checking import Count
from benchmarks.certify.recordings import Recording, recordings
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import excitation
from rbfrag.solver.results import OutcomeIntervals
from rbfrag.solver.search.critical import critical

FEW = [
    "--combinations", "2", "--vertical", "1", "--islands", "1", "--values", "200",
    "--intervals", "200", "--borders", "1", "--strengths", "1", "--every", "90",
    "--digits", "2",
]  # fmt: skip


@pytest.fixture(scope="module")
def all_recordings(records_dir: Path) -> list[Recording]:
    return recordings(records_dir)


def test_all_parts_run_and_find_nothing_wrong(
    all_recordings: list[Recording],
    records_dir: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(certify, "recordings", lambda folder: all_recordings)
    result = certify.main(
        ["--records", str(records_dir), *FEW, "--out", str(tmp_path / "found.json")]
    )
    assert json.loads((tmp_path / "found.json").read_text())["records"] == result["records"] == 265
    assert result["with_vertical"] == 152
    assert result["combinations"]["horizontal"]["combinations"] == 2
    assert result["combinations"]["with vertical"]["of_these_not_certified"] == []
    assert result["islands"]["with_islands"] == 1
    assert result["islands"]["contradictions"] == []
    assert result["intervals"]["intervals"] >= 200
    assert result["intervals"]["contradictions"] == []
    assert result["borders"]["wrong"] == []
    assert result["borders"]["by_distance"]["1e-10"]["other"] == 0
    assert result["accuracy"]["wrong_outcomes"] == 0
    assert result["accuracy"]["peak_error_relative"]["greatest"] < 1e-9
    assert result["digits"]["change_of_kr_over_pga_greatest"] < 1e-2
    assert result["accuracy"]["estimates_that_are_no_bound"] == 0


def test_the_same_seed_draws_the_same(all_recordings: list[Recording]) -> None:
    first, other = (
        [c.name for c in certify._mixed(all_recordings, np.random.default_rng(3), 50)]
        for _ in range(2)
    )
    assert first == other
    assert len(set(first)) == len(first) == 66


PULSE = GroundMotion.from_nodes([0.0, 0.2, 0.4], [0.0, 0.5, 0.0])


def test_a_wrong_verdict_is_seen() -> None:
    result = critical(PULSE, p2=5.0)
    assert result.kr is not None
    excited = excitation(PULSE)
    low, high = 0.9 * result.kr, 1.1 * result.kr
    count = Count()
    wrong = count.check(excited, 5.0, low, high, True, np.linspace(low, high, 10))
    assert len(wrong) == count.contradictions == 5
    assert count.check(excited, 5.0, low, result.kr, True, np.linspace(low, result.kr, 10)) == []


def test_a_border_that_is_not_there_is_no_border() -> None:
    result = critical(PULSE, p2=5.0)
    assert result.kr is not None
    excited = excitation(PULSE)
    outcome = borders.border(excited, 5.0, result.kr, result.kr * (1.0 + 1e-9))
    assert outcome is not None
    assert outcome[0] + outcome[1] == pytest.approx(result.kr, rel=1e-8)
    assert borders.border(excited, 5.0, 1.1 * result.kr, 1.1 * result.kr * (1.0 + 1e-9)) is None


def test_safe_islands_are_runs_between_two_that_topple() -> None:
    words = ("topples", "undecided", "safe", "undecided", "safe", "topples", "undecided", "safe")
    edges = np.array([0.0, 0.1, 0.2, 0.3, 0.3, 0.4, 0.5, 0.6, 1.0])

    class Result:
        intervals = OutcomeIntervals(edges[:-1], edges[1:], words)  # type: ignore[arg-type]

    result: CriticalResult = Result()  # type: ignore[assignment]
    assert islands.safe_islands(result) == pytest.approx([0.2])
