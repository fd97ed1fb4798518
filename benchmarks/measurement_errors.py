"""Intervals with errors of measurement, against joint Monte Carlo and in simulated surveys.

    python -m benchmarks.measurement_errors [--write]

Monte Carlo draws the block and the parameters of the model together; the ends of the interval are
compared with its percentiles. A survey is a rectangle that stands, measured with errors: how often
does the interval of what was measured contain the P of the rectangle itself? Last, how much longer
tables and single answers take with three standard deviations. --write keeps the table.
"""

from __future__ import annotations

import subprocess
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

import rbfrag
from benchmarks.page import ROOT, markdown, parser, report
from benchmarks.start_up import processor_time
from rbfrag.fragility.method import arrays
from rbfrag.fragility.model_selection import find_model
from rbfrag.question.classify_arrays import classify_blocks
from rbfrag.question.measurement_draws import (
    drawn_values,
    split_sigmas,
)

FloatArray = NDArray[np.float64]

PAGE = ROOT / "docs" / "howto" / "how-sure.md"
ERRORS = {"beta_sigma_deg": 2.0, "phi_sigma_deg": 3.0}


def monte_carlo(question: dict[str, Any], draws: int, seed: int) -> tuple[float, float, float]:
    """Return mean, 2.5th and 97.5th percentile of P over blocks that stand and parameters."""
    generator = np.random.default_rng(seed)
    inputs, sigmas = split_sigmas(question, is_scenario=False)
    z = generator.standard_normal((len(sigmas), draws))
    pairs = [(arrays().ndtr(row), row) for row in z]
    block = {n: np.full(draws, v) for n, v in inputs.items() if n != "pgv_m_s"}
    block |= drawn_values(block, sigmas, pairs, arrays())
    (group,) = classify_blocks(block, draws).groups
    model = find_model(None, {**group.numbers, "pgv_m_s": 1.0}, kind=group.kind)
    covariance = np.zeros((len(model.parameters),) * 2)
    rows, columns = np.tril_indices(len(model.parameters))
    packed = np.array(model.errors.packed_covariance)
    covariance[rows, columns] = covariance[columns, rows] = np.where(
        rows == columns, packed, 0.5 * packed
    )
    size = group.indices.size if group.indices is not None else draws
    parameters = generator.multivariate_normal(model.parameters, covariance, size)
    values = {**group.numbers, "pgv_m_s": np.full(size, inputs["pgv_m_s"])}
    values = model.method.block.completed(values, model.term, arrays())
    with np.errstate(invalid="ignore"):  # of draws that mechanics decides about below
        unscaled, factor = model.form.unscaled([*parameters.T], values, arrays())
        p = model.method.link.probability(unscaled.eta * factor, arrays())
        expected = model.answer(values, None, arrays(), {}).probability
    for bound in model.bounds(values):
        p, expected = (np.where(bound.holds(values), 0.0, column) for column in (p, expected))
    low, high = np.quantile(p, [0.025, 0.975])
    return float(expected.mean()), float(low), float(high)


def cases(count: int, seed: int) -> list[dict[str, Any]]:
    """Return questions about measured rectangles with P between 2 and 95 %."""
    generator, results = np.random.default_rng(seed), []
    while len(results) < count:
        height = float(generator.uniform(0.8, 3.5))
        block = {
            "height_m": height, "width_m": float(generator.uniform(0.15, 0.4)) * height,
            "beta_deg": float(generator.uniform(-3.0, 6.0)), "phi_deg": 45.0,
            "pgv_m_s": float(np.exp(generator.uniform(np.log(0.3), np.log(2.0)))),
        }  # fmt: skip
        sigmas = {
            "height_sigma_m": "5%", "width_sigma_m": "5%",
            "beta_sigma_deg": float(generator.uniform(0.5, 2.0)),
        }  # fmt: skip
        nominal = rbfrag.predict(**block)
        if 0.02 < nominal.probability < 0.95 and nominal.kind == "toppling":
            results.append({**block, **sigmas})
    return results


def end_errors(count: int, draws: int, seed: int) -> FloatArray:
    """Return the errors of mean, low and high end of each case, in points of P."""
    rows = []
    for i, question in enumerate(cases(count, seed)):
        answer = rbfrag.predict(**question)
        ends = answer.probability, answer.ci_low, answer.ci_high
        rows.append(np.subtract(ends, monte_carlo(question, draws, seed + i)))
    return 100.0 * np.array(rows)


def surveys(count: int, seed: int) -> dict[str, float]:
    """Return the fraction of surveys whose interval contains the true P, with and without errors.

    Only blocks with a stated P of 2 to 95 % count.
    """
    generator = np.random.default_rng(seed)
    height = generator.uniform(0.5, 4.0, count)
    truth = {
        "height_m": height, "width_m": height * generator.uniform(0.15, 0.5, count),
        "beta_deg": generator.uniform(-5.0, 12.0, count),
        "phi_deg": generator.uniform(32.0, 45.0, count),
    }  # fmt: skip
    shaking = {"pgv_m_s": np.exp(generator.uniform(np.log(0.2), np.log(2.0), count))}
    actual = rbfrag.predict(**truth, **shaking)
    stands = (actual.kinds == "toppling") & (actual.reason != "unstable")
    z = generator.standard_normal((4, count))
    measured = {
        "height_m": truth["height_m"] * np.exp(0.05 * z[0]),
        "width_m": truth["width_m"] * np.exp(0.05 * z[1]),
        "beta_deg": truth["beta_deg"] + 2.0 * z[2], "phi_deg": truth["phi_deg"] + 3.0 * z[3],
    }  # fmt: skip
    nominal = rbfrag.predict(**measured, **shaking)
    is_counted = stands & (nominal.kinds == "toppling") & ~np.isnan(nominal.probability)
    is_counted &= (nominal.probability > 0.02) & (nominal.probability < 0.95)
    rows = np.flatnonzero(is_counted)
    question = {n: column[rows] for n, column in {**measured, **shaking}.items()}
    answer = rbfrag.predict(
        **question, displacement_m=0.1, height_sigma_m="5%", width_sigma_m="5%", **ERRORS
    )
    true = actual.probability[rows]
    has_answer = ~np.isnan(answer.probability)

    def coverage(low: FloatArray, high: FloatArray) -> float:
        inside = (low <= true) & (true <= high)
        return float(inside[has_answer].mean())

    return {
        "blocks": float(has_answer.sum()),
        "stated": coverage(nominal.ci_low[rows], nominal.ci_high[rows]),
        "measured": coverage(answer.ci_low, answer.ci_high),
    }


def shell_seconds(*words: str) -> float:
    """Return the least processor time of three runs of a command from the shell [s]."""
    program = "from rbfrag.cli.main import run; run()"
    command = [sys.executable, "-c", program, *words]
    run = partial(subprocess.run, command, check=True, capture_output=True)
    return min(processor_time(run) for _ in range(3))


def time_ratios(count: int, seed: int) -> tuple[float, float, float]:
    """Return the processor time with three standard deviations over that without.

    It is that of arrays of blocks, of the command for a table of them, and for one block.
    """
    generator = np.random.default_rng(seed)
    height = generator.uniform(0.8, 3.5, count)
    columns = {
        "height_m": height, "width_m": height * generator.uniform(0.15, 0.4, count),
        "dip_deg": generator.uniform(-3.0, 6.0, count), "phi_deg": np.full(count, 45.0),
        "pgv_m_s": np.exp(generator.uniform(np.log(0.3), np.log(2.0), count)),
    }  # fmt: skip
    sigmas = {"height_sigma_m": 0.1, "width_sigma_m": 0.03, "dip_sigma_deg": 2.0}
    in_process = []
    rbfrag.predict(**columns)  # loads what both need
    for errors in ({}, sigmas):
        start = process_time()
        rbfrag.predict(**columns, **errors)
        in_process.append(process_time() - start)
    options = ["--height-sigma", "0.1", "--width-sigma", "0.03", "--dip-sigma", "2"]
    with TemporaryDirectory() as folder:
        table, out = Path(folder, "blocks.csv"), Path(folder, "answers.csv")
        header, cells = ",".join(columns), np.column_stack([*columns.values()])
        np.savetxt(table, cells, delimiter=",", header=header, comments="", fmt="%.6g")
        of_table = "predict", "--blocks", f"{table}", "--out", f"{out}"
        tables = [shell_seconds(*of_table, *more) for more in ((), options)]
    block = ["predict", "--height", "2", "--width", "0.4", "--phi", "40", "--pgv", "0.9"]
    singles = [shell_seconds(*block, *more) for more in ((), options)]
    return in_process[1] / in_process[0], tables[1] / tables[0], singles[1] / singles[0]


def main() -> None:
    """Compare, print and maybe write the table of the page."""
    arguments = parser(__doc__).parse_args()
    errors = np.sqrt(np.square(end_errors(100, 200_000, 1)).mean(axis=0))
    results = surveys(3_000, 2)
    rows = [
        ("mean P, root mean square error against Monte Carlo", f"{errors[0]:.2f} points"),
        ("lower end of the interval", f"{errors[1]:.2f} points"),
        ("upper end of the interval", f"{errors[2]:.2f} points"),
        ("surveys with a stated P of 2–95 %", f"{results['blocks']:.0f}"),
        (
            "the interval of the fragility alone contains the true P",
            f"{100 * results['stated']:.0f} %",
        ),
        (
            "the interval with errors of measurement contains it",
            f"{100 * results['measured']:.0f} %",
        ),
    ]
    arrays_ratio, table_ratio, single_ratio = time_ratios(10_000, 3)
    rows += [
        (
            f"{interface}: processor time with three standard deviations over that without",
            f"{ratio:.3g}",
        )
        for interface, ratio in (
            ("10,000 blocks as arrays", arrays_ratio),
            ("`rbfrag predict --blocks`, 10,000 rows", table_ratio),
            ("`rbfrag predict`, one block", single_ratio),
        )
    ]
    table = markdown((("compared", "result"), rows))
    report("measurement errors", table, write=arguments.write, page=PAGE)


if __name__ == "__main__":
    main()
