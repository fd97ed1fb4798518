"""The figure of the other kinds' models is drawn, and shows its data."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks.other_kinds import (
    RATIOS,
    class_lines,
    coefficient_lines,
    dependence_table,
    plot_other_kinds,
)
from rbfrag.errors import InputError
from rbfrag.fragility.fit.fitting import fit_source
from rbfrag.fragility.measures import TERMS
from tests.fragility.kind_draws import METHOD_OF, drawn
from tests.fragility.test_prediction_kinds import row_of


def test_the_figure_is_written(tmp_path: Path) -> None:
    fits = [
        fit_source(drawn(kind, "pgv_pga", 400), TERMS["pgv_pga"], METHOD_OF[kind])
        for kind in ("sliding", "slumping")
    ]
    both = [part for fit in fits for part in (fit.report.model, fit.data)]
    path = plot_other_kinds(*both, tmp_path / "kinds.svg").path
    text = path.read_text(encoding="utf-8")
    assert text.count("<g id=") > 20
    with pytest.raises(InputError, match="suffix"):
        plot_other_kinds(*both, tmp_path / "kinds.txt")


def test_classes_are_judged_by_their_own_outcomes() -> None:
    fit = fit_source(drawn("sliding", "pgv_pga", 2000), TERMS["pgv_pga"], METHOD_OF["sliding"])
    lines = class_lines("m", fit.result.held_out, fit.data, "k/PGA", RATIOS)
    assert [line[1] for line in lines] == [
        "k/PGA 0 to 0.1", "k/PGA 0.1 to 0.3", "k/PGA 0.3 to 0.6", "k/PGA 0.6 to 1",
    ]  # fmt: skip
    shares = np.array([[float(line[3]), float(line[4])] for line in lines])
    assert shares[:, 0] == pytest.approx(shares[:, 1], abs=0.05)
    assert shares[0, 1] > shares[-1, 1] + 0.1
    # one class of everything
    full = class_lines("m", fit.result.held_out, fit.data, "d [m]", (0.0, math.inf))
    assert float(full[0][4]) == pytest.approx(fit.data.failed.mean(), abs=5e-4)


def test_coefficients_stand_below_their_names() -> None:
    fits = [
        fit_source(drawn("slumping", term, 400), TERMS[term], METHOD_OF["slumping"])
        for term in ("pgv_pga_m", "pgv_pga")
    ]
    lines = [line.split("|") for line in coefficient_lines(fits).splitlines()]
    assert lines[0][6].strip() == "`b_m`"
    assert float(lines[2][6].partition("±")[0]) == pytest.approx(0.5, abs=0.4)
    assert not lines[3][6].strip()


def test_what_blocks_share_is_listed() -> None:
    shares = {"rho_e": 0.4, "rho_s": 0.3, "rho_v": 0.2, "rho_o": 0.1}
    with_errors = row_of("sliding", dependence={**shares, "errors": dict.fromkeys(shares, 0.04)})
    table = dependence_table([with_errors, row_of("slumping", dependence=None)])
    lines = [line for line in table.splitlines() if "`" in line]
    assert lines == [
        "| `sliding-pgv_pga` | 0.40 ± 0.04 | 0.30 ± 0.04 | 0.20 ± 0.04 | 0.10 ± 0.04 |"
    ]
