"""The study of damaged files runs, repeats itself, and sees a failure when there is one."""

from __future__ import annotations

from random import Random

import pytest

from benchmarks import fuzz_readers
from benchmarks.damage import EDITS, Damage, damaged
from rbfrag.errors import MotionFileError


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
