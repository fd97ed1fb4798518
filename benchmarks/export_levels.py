"""How far chords between the levels of exported functions are from P, relative to it.

    python -m benchmarks.export_levels [--write]

For every shipped model of one measure and 200 blocks: the largest error above P = 1e-5 of 80 and 40
levels as exported, and of as many with equal ratios over the same range. --write draws
docs/figures/export-levels.svg.
"""

from __future__ import annotations

import argparse

import numpy as np

from benchmarks.page import ROOT
from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import read_models
from rbfrag.exchange.block_fragility import FLOOR, block_functions
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction import array_answer
from rbfrag.solver.results import FloatArray

FIGURE = ROOT / "docs" / "figures" / "export-levels.svg"
RANDOM = np.random.default_rng(2)
BLOCKS = {
    "p2": 10.0 ** RANDOM.uniform(-0.5, 1.3, 200),
    "kr": 10.0 ** RANDOM.uniform(-1.5, -0.5, 200),
    "ky": 10.0 ** RANDOM.uniform(-1.5, -0.5, 200),
    "beta_deg": RANDOM.uniform(0.0, 30.0, 200),
    "displacement_m": 10.0 ** RANDOM.uniform(-2.0, 0.0, 200),
}


def errors(model: FragilityModel, measure: str, levels: int) -> tuple[FloatArray, FloatArray]:
    """Return the largest relative errors of each block, as exported and with equal ratios."""
    numbers = {name: BLOCKS[name] for name in model.method.block.names if name in BLOCKS}
    names = [str(i) for i in range(200)]
    functions = block_functions(
        names, numbers, measure, model.row.kind, model=model, levels=levels
    ).functions
    both = []
    for i, function in enumerate(functions):
        if function.levels is None:  # lognormal: exact
            both.append([0.0, 0.0])
            continue
        block = {name: values[i] for name, values in numbers.items()}
        x = np.geomspace(function.levels[1], function.levels[-1], 4000)[:-1]
        grid = np.geomspace(function.levels[1], function.levels[-1], levels)
        p, on_grid = (
            array_answer(model, {**block, measure: levels}, interval=False).probability
            for levels in (x, grid)
        )
        seen = p > FLOOR
        shown = function.at(x), np.interp(x, grid, on_grid)
        both.append([np.abs(levels[seen] / p[seen] - 1.0).max() for levels in shown])
    exported, equal = np.array(both).T
    return exported, equal


def main() -> None:
    """Measure, print and draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--write", action="store_true", help="draw the figure")
    options = parser.parse_args()
    drawn: dict[str, tuple[FloatArray, FloatArray]] = {}
    for row in read_models(REFERENCE):
        inputs = TERMS[row.term].inputs
        measure = inputs[0] if inputs else "sa(1)"
        if len(inputs) > 1 or measure not in ("pgv_m_s", "sa(1)", "pga_g"):
            continue
        for levels in (80, 40):
            exported, equal = errors(FragilityModel.from_row(row), measure, levels)
            print(
                f"{row.name:16} {levels} levels: {exported.max():.2%}, "
                f"of equal ratios {equal.max():.0%}", flush=True,
            )  # fmt: skip
            if levels == 80 and exported.max() > 0.0:
                drawn[row.name] = exported, equal
    if options.write:
        draw(drawn)


def draw(drawn: dict[str, tuple[FloatArray, FloatArray]]) -> None:
    """Draw the figure."""
    from matplotlib.figure import Figure

    from rbfrag.plots.canvas import save_figure

    figure = Figure(figsize=(6.3, 3.0), layout="constrained")
    axes = figure.add_subplot()
    for i, (exported, equal) in enumerate(drawn.values()):
        for values, colour, at in ((equal, "0.55", i - 0.12), (exported, "C0", i + 0.12)):
            axes.plot(
                [at, at], np.quantile(values, (0.0, 1.0)), color=colour, lw=5, solid_capstyle="butt"
            )
    axes.axhline(0.01, color="C3", lw=0.8)
    axes.text(len(drawn) - 0.55, 0.0108, "1 %", color="C3", ha="right", va="bottom")
    axes.plot([], [], lw=5, color="0.55", label="levels of equal ratio")
    axes.plot([], [], lw=5, color="C0", label="as exported")
    axes.set(yscale="log", ylabel="largest relative error", xlim=(-0.5, len(drawn) - 0.5))
    axes.set_xticks(range(len(drawn)), list(drawn), rotation=30, ha="right", fontsize=8)
    axes.legend(fontsize=8, loc="upper right")
    save_figure(figure, FIGURE)


if __name__ == "__main__":
    main()
