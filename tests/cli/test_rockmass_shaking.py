"""`rbfrag rockmass --motion`: the shell says what the library says."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from rbfrag.motions.readers import read_motion
from rbfrag.rockmasses.counts import failures
from rbfrag.rockmasses.file import read_rock_mass
from rbfrag.rockmasses.shaking import FailureLimits, plan_shaking, run_blocks
from tests.block_tables import read_columns
from tests.cli.conftest import Rejects, Shell
from tests.synthetic import shaking, write_at2

EXAMPLE = Path(__file__).resolve().parent.parent.parent / "docs" / "examples" / "rockmass.toml"


@pytest.fixture
def record(tmp_path: Path) -> Path:
    shutil.copy(EXAMPLE, tmp_path / "mass.toml")
    return write_at2(tmp_path / "record.AT2", shaking(3))


def test_shares_table_and_figure(shell: Shell, record: Path, tmp_path: Path) -> None:
    command = (
        "rockmass", "mass.toml", "--n", "60", "--motion", record, "--reverse",
        "--scales", "2,0.5,1", "--displacement", "0.02", "--rotation", "1", "--level", "0.9",
    )  # fmt: skip
    answer = shell.json(*command, "--out", "blocks.csv", "--plot", "shares.png")
    assert answer["scenario"] is None
    document = answer["shaking"]
    assert document["polarity"] == "reverse"
    assert (document["displacement_limit_m"], document["rotation_limit_deg"]) == (0.02, 1.0)
    assert [scale["scale"] for scale in document["scales"]] == [0.5, 1.0, 2.0]
    plan = plan_shaking(
        read_rock_mass(EXAMPLE).realise(60),
        read_motion(record),
        scales=[0.5, 1.0, 2.0],
        polarity="reverse",
        limits=FailureLimits(0.02, 1.0),
    )
    outcomes = plan.gathered(map(run_blocks, plan.work()))
    for scale, result in zip(document["scales"], failures(outcomes, 0.9), strict=True):
        assert set(scale["modes"]) == {"slide", "slump"}
        for mode, counted in result.modes.items():
            assert scale["modes"][mode]["fails"] == counted.fails
            assert scale["modes"][mode]["fails_of_all"]["ci_high"] == counted.of_all.high
        assert scale["all"]["fails_of_mode"]["share"] == scale["all"]["fails"] / 60
    assert document["scales"][2]["all"]["fails"] > 0
    assert not any("not followed" in warning for warning in answer["warnings"])
    rows = read_columns(tmp_path / "blocks.csv", ("scale", "displacement_m"))
    assert rows["scale"].tolist() == [0.5] * 60 + [1.0] * 60 + [2.0] * 60
    assert (tmp_path / "shares.png").stat().st_size > 10_000
    # the same again, and without a figure of the time that it took
    assert shell.json(*command) == answer


def test_the_printed_table(shell: Shell, record: Path) -> None:
    result = shell("rockmass", "mass.toml", "--n", "40", "--motion", record)
    lines = result.stdout.splitlines()
    (header,) = [i for i, line in enumerate(lines) if line.startswith("scale")]
    end = lines.index("", header)
    assert [line.split()[2] for line in lines[header + 1 : end]] == ["slide", "slump", "all"]
    assert any(line.startswith("Limits    a slide fails beyond 0.05 m") for line in lines)
    assert "rockmass: " in result.stderr


def test_a_stored_motion_by_its_number(shell: Shell, record: Path) -> None:
    shell("motions", "add", record, "--raw")
    command = ("rockmass", "mass.toml", "--n", "30", "--motion")
    by_number, by_file = (shell.json(*command, name)["shaking"] for name in ("1", record))
    assert by_number["scales"] == by_file["scales"]
    assert by_number["scales"][0]["all"]["moved"] > 0


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--scales", "1,2"), "--scales requires --motion"),
        (("--jobs", "2"), "--jobs requires --motion"),
        (("--displacement", "0.1"), "--displacement requires --motion"),
        (("--reverse",), "--reverse requires --motion"),
        (("--motion", "record.AT2", "--pgv", "0.5"), "cannot be combined with --pgv"),
        (("--motion", "record.AT2", "--model", "x"), "--model requires an intensity measure"),
        (("--motion", "none.AT2"), "none.AT2"),
        (("--motion", "record.AT2", "--vertical", "none.AT2"), "none.AT2"),
        (("--motion", "record.AT2", "--scales", "1,x"), "--scales"),
        (("--motion", "record.AT2", "--scales", "0"), "scale 0"),
        (("--motion", "record.AT2", "--displacement", "0"), "displacement"),
        (("--motion", "record.AT2", "--rotation", "-2"), "rotation"),
        (("--motion", "record.AT2", "--level", "1.5"), "level"),
        (("--motion", "record.AT2", "--jobs", "0"), "--jobs"),
        (("--motion", "record.AT2", "--plot", "shares.bmp"), "shares.bmp"),
        (("--motion", "record.AT2", "--out", "blocks.txt"), "blocks.txt"),
    ],
)
def test_rejected(
    rejects: Rejects, record: Path, tmp_path: Path, options: tuple[str, ...], word: str
) -> None:
    assert word in rejects("rockmass", "mass.toml", "--n", "20", *options)
    assert {path.name for path in tmp_path.iterdir()} == {"mass.toml", "record.AT2"}
