"""Which mistakes in the solver the tests notice:  python -m benchmarks.mutations [--write].

Each row of the table makes one mistake in a copy of the package and runs the tests that should
notice it, which use no recorded motions. `--write` puts the table into the documentation.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks.page import ROOT, machine_sentence, write_table

PAGE = ROOT / "docs" / "evidence" / "verification.md"
COPIED = ("rbfrag", "tests", "benchmarks", "pyproject.toml")


class Mutation(NamedTuple):
    """One mistake.

    Args:
        mistake: in words.
        file: below `rbfrag/solver`.
        old: text that stands there once.
        new: what stands there instead.
        tests: file of tests that should notice, below `tests`.
    """

    mistake: str
    file: str
    old: str
    new: str
    tests: str


STEP, RUN = "integrator/taylor.py", "integrator/toppling_kernel.py"
ERRORS = "solver/integrator/test_step_errors.py"
TOPPLING = "solver/integrator/test_toppling_kernel.py"
MUTATIONS = (
    Mutation("truncation / 32", STEP, "return growth, truncation, rounding",
             "return growth, truncation / 32.0, rounding", ERRORS),
    Mutation("rounding / 32", STEP, "return growth, truncation, rounding",
             "return growth, truncation, rounding / 32.0", ERRORS),
    Mutation("truncation without U[N - 1]", STEP, "(abs(highest[2]) + abs(highest[1]))",
             "abs(highest[1])", ERRORS),
    Mutation("truncation without U[N - 2]", STEP, "(abs(highest[2]) + abs(highest[1]))",
             "abs(highest[2])", ERRORS),
    Mutation("truncation without the term of U[N] alone", STEP, "0.0625 * abs(highest[3]) + ",
             "", ERRORS),
    Mutation("truncation without that of U[N - 3]", STEP,
             " + 0.25 * abs(highest[0]) * (size * size)", "", ERRORS),
    Mutation("rounding of theta", STEP, "abs(state.theta + turned) + abs(state.rate)",
             "abs(state.rate)", ERRORS),
    Mutation("rounding of theta'", STEP, " + abs(state.rate) + abs(state.sin))",
             " + abs(state.sin))", ERRORS),
    Mutation("rounding of the sine", STEP, " + abs(state.sin))\n", ")\n", ERRORS),
    Mutation("rounding of k_h cos(phi)", STEP, "+ 4.0 * ph * a_size * abs(state.cos)\n", "\n",
             ERRORS),
    Mutation("growth without gravity", STEP, "stiffness = w_size * abs(state.cos)",
             "stiffness = 0.0", ERRORS),
    Mutation("growth without k_h", STEP, "stiffness += a_size * abs(state.sin)",
             "stiffness += 0.0", ERRORS),
    Mutation("growth without the turning by a wrong rate", STEP, "max(1.0, stiffness)",
             "stiffness", ERRORS),
    Mutation("drift without the error of theta'", STEP, "return ph * error + 2.0", "return 2.0",
             ERRORS),
    Mutation("drift without rounding", STEP, " + 2.0 * MACHINE_EPSILON * abs(theta_end)", "",
             ERRORS),
    Mutation("lateness of an impact / 10", RUN, "late = 2.0 * drift / impact",
             "late = 0.2 * drift / impact", ERRORS),
    Mutation("no error of a late start", RUN, "error = push * late", "error = 0.0", ERRORS),
    Mutation("no drift of a late start", RUN, "TrajectoryBounds(error, error * late, peak)",
             "TrajectoryBounds(error, 0.0, peak)", ERRORS),
    Mutation("graze without its own speed", RUN, "error += impact + math", "error += math",
             ERRORS),
    Mutation("graze without what it may have been", RUN,
             "error += impact + math.sqrt(2.0 * push * drift)", "error += impact", ERRORS),
    Mutation("an impact that may be none is none", RUN, " or impact * impact <= 4.0 * push * drift",
             "", ERRORS),
    Mutation("a graze hides nothing", RUN, "error > 0.25 * corner.theta_c", "False", ERRORS),
    Mutation("irrecoverable without what the record still brings", "integrator/events.py",
             "c * least_q - s", "-s", TOPPLING),
    Mutation("no energy left after the record", RUN, "if margin > 0.0:", "if margin > 1.0:",
             TOPPLING),
)  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    options.add_argument("--write", action="store_true", help="write the table into the page")
    chosen = options.parse_args(arguments)
    lines = ["| mistake | tests | |", "| --- | --- | --- |"]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for name in COPIED:
            copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
            copy(ROOT / name, place / name)
        for tests in sorted({mutation.tests for mutation in MUTATIONS}):
            if not passes(place, tests):
                sys.exit(f"tests/{tests} fails without a mistake")
        for mutation in MUTATIONS:
            cells = (mutation.mistake, f"`{Path(mutation.tests).name}`", result_of(place, mutation))
            line = f"| {' | '.join(cells)} |"
            print(line, flush=True)
            lines.append(line)
    text = "\n".join([*lines, "", machine_sentence()])
    if chosen.write:
        write_table(PAGE, "mutations", text)


def result_of(place: Path, mutation: Mutation) -> str:
    """Return whether the tests notice a mistake; the file is put back."""
    file = place / "rbfrag" / "solver" / mutation.file
    text = file.read_text(encoding="utf-8")
    if text.count(mutation.old) != 1:
        sys.exit(f"{mutation.mistake}: {mutation.old!r} stands {text.count(mutation.old)} times")
    file.write_text(text.replace(mutation.old, mutation.new), encoding="utf-8")
    try:
        return "not noticed" if passes(place, mutation.tests) else "noticed"
    finally:
        file.write_text(text, encoding="utf-8")


def passes(place: Path, tests: str) -> bool:
    """Return whether a file of tests passes in a copy of the project."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", f"tests/{tests}"]
    environment = {**os.environ, "PYTHONPATH": str(place)}
    process = subprocess.run(
        command, cwd=place, env=environment, capture_output=True, check=False, text=True
    )
    # 1: a test failed; everything else is a mistake of another sort
    if process.returncode not in (0, 1):
        sys.exit(process.stdout[-2000:] + process.stderr[-2000:])
    return process.returncode == 0


if __name__ == "__main__":
    main()
