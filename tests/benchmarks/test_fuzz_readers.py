"""The study of damaged files runs, repeats itself, and sees a failure when there is one."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from random import Random

import pytest

from benchmarks import fuzz_readers
from benchmarks.damage import EDITS, Damage, damaged
from benchmarks.silent_changes import change
from rbfrag.errors import MotionFileError
from rbfrag.motions import header_check
from tests.motions.test_header_check import MISTAKES, file_text


def test_it_runs_and_repeats(capsys: pytest.CaptureFixture[str]) -> None:
    outputs = []
    for _ in range(2):
        assert fuzz_readers.main(["--inputs", "160", "--seed", "7"]) == 0
        lines = capsys.readouterr().out.splitlines()
        outputs.append([line.rpartition("|")[0].rpartition("|")[0] for line in lines[:-1]])
        assert "160 inputs" in lines[-1]
        assert "0 failures" in lines[-1]
    assert outputs[0] == outputs[1]


@pytest.mark.parametrize("edit", EDITS)
def test_every_edit_takes_any_content(edit: Damage) -> None:
    for content in (b"", b"\n", b"1", b"a 1.5\n" * 500):
        for seed in range(20):
            assert isinstance(bytes(edit(bytearray(content), Random(seed))), bytes)


def test_damage_depends_on_the_seed_alone() -> None:
    content = b"# a\n0.0,1.5\n0.1,2.5\n"
    assert damaged(content, Random(3)) == damaged(content, Random(3))
    assert len({damaged(content, Random(seed)) for seed in range(50)}) > 30


@pytest.mark.parametrize(
    ("raised", "words"),
    [
        (IndexError("list index out of range"), "IndexError"),
        (MotionFileError("elsewhere", "no"), "names no file"),
    ],
)
def test_a_failure_is_seen(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    raised: Exception,
    words: str,
) -> None:
    def read(*_: object, **__: object) -> None:
        raise raised

    monkeypatch.setattr(fuzz_readers, "read_motions", read)
    assert fuzz_readers.main(["--inputs", "3"]) == 1
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("name", [name for name in MISTAKES if name != "CDMG V1 series"])
def test_a_silent_change_is_seen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    def became() -> Counter[str]:
        content, path = file_text(name).encode(), tmp_path / "record"
        results = (change(name, content, path, Random(seed), None, None) for seed in range(60))
        return Counter(became for became, kind, _ in results if kind != "other")

    assert became()["rejected"] > 5
    assert not became()["silent"]
    monkeypatch.setattr(header_check, "DURATION_REJECTED", float("inf"))
    monkeypatch.setattr(header_check, "DURATION_NOTED", float("inf"))
    monkeypatch.setattr(header_check, "PEAK_REJECTED", float("inf"))
    monkeypatch.setattr(header_check, "PEAK_NOTED", float("inf"))
    assert became()["silent"] > 0
