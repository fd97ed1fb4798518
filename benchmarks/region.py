"""Rates of a region, how fast, how lean and how exact:  python -m benchmarks.region [--write]

Blocks at random at random sites, under hazard curves and event sets. A case of the first table is a
process of its own, whose processor time and peak memory are given. Rates are compared with a dense
sum over P as `rbfrag.predict` gives it, intervals with draws of the model's parameters.
"""

from __future__ import annotations

import multiprocessing
import resource
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.page import markdown, parser, report
from rbfrag.fragility.model import FragilityModel
from rbfrag.hazards.curve import HazardCurve, hazard_curve
from rbfrag.hazards.event_means import event_means
from rbfrag.hazards.event_set import Duration, EventSet
from rbfrag.hazards.losses import event_losses
from rbfrag.hazards.portfolio import Portfolio
from rbfrag.hazards.rate_density import curve_mass
from rbfrag.hazards.rate_integration import KernelBlocks, rates
from rbfrag.hazards.shaking import HazardLevel
from rbfrag.hazards.standing_blocks import failure_rate
from rbfrag.question.components import component_named
from rbfrag.question.keywords import model_for
from rbfrag.question.question import predict
from rbfrag.solver.results import FloatArray

LEVELS = np.geomspace(0.005, 5.0, 40)
KINDS: dict[str, tuple[str, float | None, dict[str, tuple[float, float]]]] = {
    "toppling, PGV": ("pgv_m_s", None, {"p2": (0.3, 20.0), "kr": (0.03, 0.6)}),
    "toppling, SA(1)": ("sa_g", 1.0, {"p2": (0.3, 20.0), "kr": (0.03, 0.6)}),
    "toppling, PGA": ("pga_g", None, {"p2": (0.3, 20.0), "kr": (0.03, 0.6)}),
    "rocking, PGV": ("pgv_m_s", None, {"p2": (0.3, 20.0), "kr": (0.03, 0.6)}),
    "sliding, PGV": ("pgv_m_s", None, {"ky": (0.03, 0.4), "displacement_m": (0.02, 0.5)}),
}


BLOCKS = 20


def bending(n: int) -> HazardCurve:
    """Return a curve that bends down in log-log, by n levels of PGV from 0.01 to 4 m/s."""
    x = np.geomspace(0.01, 4.0, n)
    return hazard_curve("pgv_m_s", x, 0.02 / (1.0 + (x / 0.03) ** 1.5) * np.exp(-x / 0.8))


def curve_of(
    measure: str = "pgv_m_s", period_s: float | None = None, at: float = 1.2
) -> HazardCurve:
    """Return a hazard curve of 40 levels."""
    rate = 0.2 * (LEVELS / 0.005) ** -1.0 * np.exp(-((LEVELS / at) ** 1.2))
    return hazard_curve(measure, LEVELS, rate, period_s=period_s)


def toppling(n: int, random: np.random.Generator) -> dict[str, FloatArray]:
    """Return blocks at random."""
    return {"p2": random.uniform(0.3, 20.0, n), "kr": random.uniform(0.03, 0.6, n)}


def of_curves(blocks: int, sites: int) -> None:
    """Rates with intervals under the curve of each site."""
    random = np.random.default_rng(1)
    curves = [curve_of(at=at) for at in random.uniform(0.5, 1.5, sites).tolist()]
    shaking = HazardLevel.of(curves[0], component="rotd50")
    numbers = toppling(blocks, random)
    model = model_for({}, (*numbers, shaking.name), "toppling")
    site = random.integers(0, sites, blocks)
    mass = curve_mass([curves], np.ones(1), shaking)
    for _, kernel_blocks in KernelBlocks.of(model, shaking.median, numbers, site):
        rates(kernel_blocks, mass, 0.95)


def event_set(events: int, sites: int, blocks: int) -> tuple[EventSet, Portfolio]:
    """Return an event set that shakes every site, and blocks at them."""
    random = np.random.default_rng(1)
    event, site = np.repeat(np.arange(events), sites), np.tile(np.arange(sites), events)
    u = random.normal(np.log(0.08), 1.0, events)[:, None] + random.normal(0, 0.5, (events, sites))
    names = tuple(f"s{i}" for i in range(sites))
    number = np.arange(events)
    event_set_of_rows = EventSet(
        number, np.zeros_like(number), number // 3 + 1, np.full(events, 1e-4), names, event, site,
        {"pgv_m_s": np.exp(u).ravel()}, Duration(1e4, 1), {0: 1.0},
    )  # fmt: skip
    numbers = toppling(blocks, random)
    columns: dict[str, Any] = {
        "block_id": np.array([f"b{i}" for i in range(blocks)], dtype=object),
        "kind": np.full(blocks, "toppling", dtype=object),
        "p2_1_s2": numbers["p2"], "kr": numbers["kr"],
        "site_id": np.array([names[i] for i in random.integers(0, sites, blocks)], dtype=object),
    }  # fmt: skip
    model = model_for({}, ("p2", "kr", "pgv_m_s"), "toppling")
    return event_set_of_rows, Portfolio.of(
        columns, names, {"toppling": model}, component_named("rotd50")
    )


def of_events(events: int, sites: int, blocks: int) -> None:
    """Expected failures of an event set, with what is not known of them."""
    event_means(*event_set(events, sites, blocks), 0.95)


CASES: tuple[tuple[str, Callable[..., None], tuple[int, ...]], ...] = (
    ("hazard, 1e4 blocks at 1e3 sites", of_curves, (10_000, 1000)),
    ("hazard, 1e5 blocks at 1e4 sites", of_curves, (100_000, 10_000)),
    ("losses, 1e6 pairs in 1e5 rows", of_events, (1000, 100, 1000)),
    ("losses, 1e7 pairs in 1e6 rows", of_events, (10_000, 100, 1000)),
    ("losses, 1e8 pairs in 1e6 rows", of_events, (10_000, 100, 10_000)),
)


def speed() -> list[list[str]]:
    """Return processor time and peak memory of each case."""
    context = multiprocessing.get_context("spawn")
    rows = []
    for name, work, numbers in CASES:
        receiver, sender = context.Pipe(duplex=False)
        process = context.Process(target=_measured, args=(sender, work, numbers))
        process.start()
        first, used, peak = receiver.recv()
        process.join()
        rows.append([name, f"{used:.1f} s", f"{first:.1f} s", f"{peak:.0f} MB"])
    return rows


def _measured(sender: Any, work: Callable[..., None], numbers: tuple[int, ...]) -> None:
    small = {of_curves: (2, 1), of_events: (2, 1, 2)}[work]
    start = time.process_time()
    work(*small)  # compiles, or loads what is compiled
    first, start = time.process_time() - start, time.process_time()
    work(*numbers)
    used = time.process_time() - start
    sender.send((first, used, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3))


def exactness() -> list[list[str]]:
    """Return how far rates above 1e-8 are from a dense sum, by kind and component."""
    rows = []
    for name, (measure, period, ranges) in KINDS.items():
        kind = name.partition(",")[0]
        random = np.random.default_rng(2)
        numbers = {n: random.uniform(*ends, BLOCKS) for n, ends in ranges.items()}
        curve = curve_of(measure, period)
        row = [name]
        for component in ("single", "rotd50"):
            shaking = HazardLevel.of(curve, component=component)
            model = model_for({}, (*numbers, shaking.name), kind)
            mass = curve_mass([[curve]], np.ones(1), shaking)
            ((_, kernel_blocks),) = KernelBlocks.of(
                model, shaking.median, numbers, np.zeros(BLOCKS, np.intp)
            )
            result = rates(kernel_blocks, mass, 0.95)
            dense = by_predict(curve, shaking, model, numbers)
            seen = dense > 1e-8
            row += [
                f"{np.abs(result.rate[seen] / dense[seen] - 1.0).max():.0e}",
                f"{(result.error[seen] / dense[seen]).max():.0e}",
            ]
        rows.append(row)
    return rows


def by_predict(
    curve: HazardCurve, shaking: HazardLevel, model: FragilityModel, numbers: dict[str, FloatArray]
) -> FloatArray:
    """Return rates by a dense sum of predictions over the curve."""
    low, high = np.log(curve.levels[[0, -1]]).tolist()
    u = np.linspace(low, high, 6001)
    rate = curve.rate_at(np.clip(np.exp(u), *curve.levels[[0, -1]]))
    middle = np.append(0.5 * (u[1:] + u[:-1]), u[-1])
    mass = np.append(-np.diff(rate), rate[-1])
    total = np.zeros(next(iter(numbers.values())).size)
    for shift, weight in zip(shaking.shift, shaking.weight, strict=True):
        columns = {name: value[:, None] for name, value in numbers.items()}
        question: Any = {**columns, shaking.name: np.exp(middle) * shift, "model": model.row}
        total += weight * (predict(interval=False, **question).probability @ mass)
    return total


DRAWS = 500


def drawn_models(model: FragilityModel, n: int, seed: int) -> list[FragilityModel]:
    """Return the model by draws of its parameters."""
    random = np.random.default_rng(seed)
    drawn = random.multivariate_normal(model.parameters, np.array(model.row.covariance), n)
    return [replace(model, parameters=tuple(draw)) for draw in drawn.tolist()]


def intervals() -> list[list[str]]:
    """Return the interval of rates against draws of the parameters."""
    curve = curve_of()
    shaking = HazardLevel.of(curve, component="rotd50")
    numbers = toppling(109, np.random.default_rng(3))
    model = model_for({}, (*numbers, shaking.name), "toppling")
    mass = curve_mass([[curve]], np.ones(1), shaking)
    ((_, kernel_blocks),) = KernelBlocks.of(
        model, shaking.median, numbers, np.zeros(109, dtype=np.intp)
    )
    result = rates(kernel_blocks, mass, 0.95)
    rates_of_draws = np.array([
        rates(replace(kernel_blocks, model=drawn), mass, 0.95).rate
        for drawn in drawn_models(model, 1000, 4)
    ])  # fmt: skip
    variance = np.einsum("km,kl,lm->m", result.gradient, model.row.covariance, result.gradient)
    with np.errstate(divide="ignore"):
        sd = np.log(rates_of_draws).std(axis=0)
    rows = []
    for low, high in ((1e-5, np.inf), (1e-7, 1e-5)):
        seen = (result.rate > low) & (result.rate <= high)
        ratio = (np.sqrt(variance) / result.rate / sd)[seen]
        rows.append([
            f"{low:g} to {high:g}" if high < np.inf else f"above {low:g}", str(int(seen.sum())),
            f"{np.median(ratio):.3f}", f"{ratio.min():.3f} to {ratio.max():.3f}",
        ])  # fmt: skip
    return rows


COUNTS = (1, 2, 5, 10, 20)


def of_sums() -> list[list[str]]:
    """Return standard errors of ln of sums and exceedances by shifts, and by draws."""
    events, portfolio = event_set(500, 12, 120)
    event_losses(events, portfolio, samples=1)  # the first call loads and compiles
    start = time.process_time()
    answer = event_losses(events, portfolio, samples=100, level=0.6826894921370859)
    used = time.process_time() - start
    (curve,) = answer.exceedance.values()
    by_count = {drawn_model.value: drawn_model for drawn_model in curve}
    model = portfolio.answering[0]
    total, reached = [], []
    with patch("rbfrag.hazards.losses.shifted_portfolios", return_value=()):
        start = time.process_time()
        event_losses(events, portfolio, samples=100)
        alone = time.process_time() - start
        for drawn_model in drawn_models(model, DRAWS, 7):
            values = dict(zip(model.row.coefficients, drawn_model.parameters, strict=True))
            moved = replace(portfolio, models=(replace(model.row, coefficients=values),))
            samples_answer = event_losses(events, moved, samples=100)
            total.append(samples_answer.average_annual_failures)
            (drawn,) = samples_answer.exceedance.values()
            rate_by_count = {point.value: point.annual_rate for point in drawn}
            reached.append([rate_by_count.get(count, np.nan) for count in COUNTS])
    low, high = answer.uncertainty["average_annual_failures"].fragility or (np.nan, np.nan)
    names = ["failures a year", *(f"{count} or more fail" for count in COUNTS)]
    ends = [(low, high), *(by_count[count].fragility for count in COUNTS)]
    sds = [np.log(total).std(), *np.nanstd(np.log(reached), axis=0)]
    rows = [
        [name, f"{0.5 * np.log(end[1] / end[0]):.3f}", f"{sd:.3f}"]
        for name, end, sd in zip(names, ends, sds, strict=True)
    ]
    return [*rows, ["processor time, and without what the parameters leave open",
                    f"{used:.1f} s", f"{alone:.1f} s"]]  # fmt: skip


def thinned() -> list[list[str]]:
    """Return how far rates under few levels are from those under 1,000."""
    from scipy.special import ndtr

    rows = []
    for n in (9, 13, 17, 25):
        row = [str(n)]
        for median in (0.4, 1.5):

            def p(x: FloatArray, m: float = median) -> FloatArray:
                return np.asarray(ndtr(np.log(x / m) / 0.4))

            rates_of_curves = [
                failure_rate(curve, p).annual_rate[0] for curve in (bending(1000), bending(n))
            ]
            row.append(f"{100.0 * (rates_of_curves[1] / rates_of_curves[0] - 1.0):+.2f} %")
        rows.append(row)
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and report."""
    chosen = parser(__doc__).parse_args(arguments)
    head = ["case", "processor time", "of a first, small one", "peak memory"]
    report("region-speed", markdown((head, speed())), write=chosen.write)
    head = ["kind", "single", "its estimate", "rotd50", "its estimate"]
    report("region-exactness", markdown((head, exactness())), write=chosen.write)
    head = ["rates", "blocks", "sd of ln rate over that of 1,000 draws", "least to most"]
    report("region-intervals", markdown((head, intervals())), write=chosen.write)
    head = ["sum", "standard error of its ln by shifts", "by draws of the parameters"]
    report("region-sums", markdown((head, of_sums())), write=chosen.write)
    head = ["levels", "median 0.4 m/s", "median 1.5 m/s"]
    report("hazard-thinned", markdown((head, thinned())), write=chosen.write)


if __name__ == "__main__":
    main()
