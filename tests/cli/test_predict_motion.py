"""`rbfrag predict --motion` from the shell: a file, a stored record, what is not measures of it."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import pytest

import rbfrag
from rbfrag.db.location import REFERENCE
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S
from tests.cli.conftest import Rejects, Shell

BLOCK = ("--p2", "3", "--kr", "0.05")


def test_unknown_polarity_gives_both_and_their_mean(shell: Shell, record: Path) -> None:
    both = shell.json("predict", *BLOCK, "--motion", record)
    single = {
        polarity: shell.json("predict", *BLOCK, "--motion", record, "--polarity", polarity)
        for polarity in ("forward", "reverse")
    }
    assert set(both["polarities"]) == {"forward", "reverse"}
    for polarity, answer in single.items():
        assert both["polarities"][polarity]["probability"] == answer["probability"]
        assert answer["term"] == "xp"
        assert "polarities" not in answer
    mean = 0.5 * (single["forward"]["probability"] + single["reverse"]["probability"])
    assert both["probability"] == mean
    assert single["forward"]["intensity_m_s"] != single["reverse"]["intensity_m_s"]
    table = shell("predict", *BLOCK, "--motion", record).stdout
    assert "forward" in table
    assert "reverse" in table


def test_the_shell_has_the_bits_of_python(shell: Shell, record: Path) -> None:
    motion = rbfrag.read_motions(record)[0]
    for kr in (0.02, 0.05, 0.3):
        document = shell.json("predict", "--p2", "3", "--kr", kr, "--motion", record)
        answer = rbfrag.predict(3.0, kr, motion=motion, db=REFERENCE)
        for name in ("probability", "ci_low", "ci_high", "y_m_s"):
            assert document[name] == getattr(answer, name)
    spectrum = shell.json("spectrum", record, "--p2", "3", "--polarity", "forward")
    forward = shell.json("predict", *BLOCK, "--motion", record, "--polarity", "forward")
    values = spectrum if isinstance(spectrum, dict) else spectrum[0]
    assert forward["intensity_m_s"] == pytest.approx(values["x_m_s"][0], rel=1e-12)


def test_a_model_that_does_not_read_the_toppling_spectrum_reads_the_response_spectrum(
    record: Path,
) -> None:
    motion = rbfrag.read_motions(record)[0]
    measures = {"pga_g": motion.pga_g, "pgv_m_s": motion.pgv_m_s}
    measures["sa_g"] = dict(zip(SPECTRUM_PERIODS_S, motion.spectrum_g, strict=True))
    for options in ({"kind": "rocking"}, {"model": "toppling-pgv_pga"}):
        kr = 0.3 * motion.pga_g
        answer = rbfrag.predict(3.0, kr, motion=motion, db=REFERENCE, **options)
        exact = rbfrag.predict(3.0, kr, **measures, db=REFERENCE, **options)
        assert (answer.model, answer.probability) == (exact.model, exact.probability)
        bare = {name: measures[name] for name in ("pga_g", "pgv_m_s")}
        uncertain = rbfrag.predict(3.0, kr, **bare, db=REFERENCE, **options)
        assert 0.0 < answer.probability < 1.0
        assert answer.probability != uncertain.probability


def test_a_stored_record_by_its_number(shell: Shell, record: Path, tmp_path: Path) -> None:
    shutil.copy(REFERENCE, tmp_path / "rbfrag.db")
    shell("db", "upgrade")
    shell("motions", "add", record, "--raw")
    number = max(row["id"] for row in shell.json("motions", "list"))
    stored = shell.json("predict", *BLOCK, "--motion", number)
    of_file = shell.json("predict", *BLOCK, "--motion", record)
    assert stored["probability"] == of_file["probability"]
    assert stored["polarities"] == of_file["polarities"]
    assert math.isfinite(stored["ci_low"])


def test_what_cannot_be_answered_is_rejected(
    rejects: Rejects, record: Path, tmp_path: Path
) -> None:
    assert "record.AT2" in rejects("predict", *BLOCK, "--motion", f"{record}#7")
    assert "pgv" in rejects("predict", *BLOCK, "--motion", record, "--pgv", "0.3").lower()
    assert "up" in rejects("predict", *BLOCK, "--motion", record, "--polarity", "up")
    assert "none.AT2" in rejects("predict", *BLOCK, "--motion", tmp_path / "none.AT2")


def test_a_reference_without_samples_says_so(rejects: Rejects, tmp_path: Path) -> None:
    shutil.copy(REFERENCE, tmp_path / "rbfrag.db")
    assert "samples" in rejects("predict", *BLOCK, "--motion", "1")
