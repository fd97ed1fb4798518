"""Messages name the option that was typed: `--dip` where that stands for `--beta`."""

from __future__ import annotations

import subprocess
import sys

import pytest

RUN = "import sys; sys.argv[0] = 'rbfrag'; from rbfrag.cli.main import run; run()"


@pytest.mark.parametrize("word", ["--beta", "--dip", "--dip="])
def test_an_angle_out_of_range(word: str) -> None:
    value = [f"{word}100"] if word.endswith("=") else [word, "100"]
    shape = ["--height", "2", "--width", "0.4", "--phi", "40", "--pgv", "0.9"]
    command = [sys.executable, "-c", RUN, "predict", *shape, *value]
    process = subprocess.run(command, capture_output=True, text=True, check=False)
    assert process.returncode == 2
    assert process.stderr.startswith(f"rbfrag: {word.removesuffix('=')} must be between")
