"""Block files: the three descriptions, both forms, and what is rejected with its line."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbfrag.errors import InputError
from rbfrag.solver.block.file import read_block
from rbfrag.solver.block.geometry import Block

EXAMPLES = Path(__file__).resolve().parents[3] / "docs" / "examples"

CSV = """\
# A block.
# gamma_deg = 90
# phi_deg = 35

x_m,y_m,contact
0,0,heel
1,0, Toe
1,2,
0,2,back
"""

TOML = """\
vertices_m = [[0, 0], [1, 0], [1, 2], [0, 2]]
heel = 0
toe = 1
back = 3
gamma_deg = 90.0
phi_deg = 35.0
"""


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_both_forms_of_an_outline(tmp_path: Path) -> None:
    expected = Block.from_polygon([(0, 0), (1, 0), (1, 2), (0, 2)], 0, 3, 1, 90.0)
    for path in (write(tmp_path, "a.csv", CSV), write(tmp_path, "a.TOML", TOML)):
        file = read_block(path)
        assert file.block == expected
        assert file.conditions == {"phi_deg": 35.0}
        assert file.path == str(path)


def test_angles_and_fractures(tmp_path: Path) -> None:
    angles = write(tmp_path, "a.toml", "alpha1_deg = -10\nalpha3_deg = 25\nr3_m = 1.5\n")
    assert read_block(angles).block == Block.from_angles(-10.0, 25.0, 1.5)
    fractures = write(
        tmp_path, "f.toml", "s1_m = 1.2\ns2_m = 0.6\ngamma_deg = 70\nback_fracture = false\n"
    )
    assert read_block(fractures).block == Block.from_fractures(1.2, 0.6, 70.0)
    assert read_block(fractures).conditions == {"back_fracture": False}


def test_examples_are_what_their_comments_say() -> None:
    outline, same = (read_block(EXAMPLES / f"block-outline.{form}") for form in ("csv", "toml"))
    assert outline.block == same.block
    assert outline.conditions == same.conditions == {"beta_deg": 12.0, "phi_deg": 35.0}
    fractures = read_block(EXAMPLES / "block-fractures.toml")
    assert fractures.block == Block.from_fractures(1.0, 0.6, 25.0)


def test_gamma_from_outside(tmp_path: Path) -> None:
    text = CSV.replace("# gamma_deg = 90\n", "")
    path = write(tmp_path, "a.csv", text)
    assert read_block(path, gamma_deg=90.0).block.gamma_deg == 90.0
    with pytest.raises(InputError, match="the file has back, heel, toe, vertices_m"):
        read_block(path)
    with pytest.raises(InputError, match="give it once"):
        read_block(write(tmp_path, "b.csv", CSV), gamma_deg=90.0)


def test_a_byte_order_mark_and_windows_lines(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xef\xbb\xbf" + CSV.replace("\n", "\r\n").encode())
    assert read_block(path).block.gamma_deg == 90.0


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.csv", "", ["a.csv", "is empty"]),
        ("a.csv", CSV.replace("1,0, Toe", "1,zero,toe"), ["line 7", "y_m", "'zero'"]),
        ("a.csv", CSV.replace("1,0, Toe", "1,0,nose"), ["line 7", "'nose'", "heel, back, toe"]),
        ("a.csv", CSV.replace("1,0, Toe", "1,0,heel"), ["line 7", "second heel"]),
        ("a.csv", CSV.replace("1,0, Toe", "1,0"), ["marked as toe"]),
        ("a.csv", CSV.replace("1,0, Toe", "1,0,toe,x"), ["line 7", "4 cells"]),
        ("a.csv", CSV.replace("1,2,", "1,nan,"), ["a.csv", "vertex 2", "nan"]),
        ("a.csv", CSV.replace("x_m,y_m", "x,y"), ["line 5", "x_m,y_m,contact"]),
        ("a.csv", CSV.replace("= 90", "= steep"), ["line 2", "gamma_deg", "steep"]),
        ("a.csv", CSV.replace("phi_deg", "fi_deg"), ["line 3", "'fi_deg'"]),
        ("a.csv", CSV.replace("phi_deg = 35", "gamma_deg = 35"), ["line 3", "twice"]),
        ("a.csv", "# back_fracture = maybe\n" + CSV, ["back_fracture", "true or false"]),
        ("a.csv", CSV.replace("= 90", "= 60"), ["a.csv", "gamma_deg = 60", "tolerance"]),
        ("a.toml", TOML.replace("heel = 0", "heel = "), ["a.toml", "TOML", "line 2"]),
        ("a.toml", TOML.replace("heel", "heal"), ["a.toml", "'heal'"]),
        ("a.toml", TOML.replace("heel = 0\n", ""), ["a.toml", "exactly"]),
        ("a.toml", TOML + "s1_m = 3.0\n", ["exactly"]),
        ("a.toml", "beta_deg = 3.0\n", ["none of them"]),
        ("a.toml", TOML.replace("[1, 0]", '["1", 0]'), ["a.toml", "vertex 1", "'1'"]),
        ("a.toml", TOML.replace("[1, 0]", f"[{10**400}, 0]"), ["a.toml", "308 digits"]),
        ("a.toml", TOML + "back_fracture = 1\n", ["back_fracture = 1"]),
        ("a.toml", "alpha1_deg = 10\nalpha3_deg = 'b'\nr3_m = 1\n", ["alpha3_deg = 'b'"]),
        ("a.txt", CSV, [".toml or .csv"]),
    ],
)
def test_files_that_are_no_block(tmp_path: Path, name: str, text: str, words: list[str]) -> None:
    path = write(tmp_path, name, text)
    with pytest.raises(InputError) as rejected:
        read_block(path)
    for word in words:
        assert word in str(rejected.value)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_block(tmp_path / "missing.toml")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        read_block(tmp_path / "folder.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfd\x00\x01")
    with pytest.raises(InputError, match="not a text file"):
        read_block(tmp_path / "binary.csv")
    (tmp_path / "large.csv").write_bytes(b" " * 1_100_000)
    with pytest.raises(InputError, match="larger"):
        read_block(tmp_path / "large.csv")
