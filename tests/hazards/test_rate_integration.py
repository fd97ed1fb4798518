"""The kernel of rates: mass, and how a rate changes with the model's parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbfrag.fragility.model import FragilityModel
from rbfrag.hazards.curve import HazardCurve, hazard_curve
from rbfrag.hazards.rate_density import Grid, curve_mass, under
from rbfrag.hazards.rate_integration import KernelBlocks, rates
from rbfrag.hazards.shaking import HazardLevel
from rbfrag.question.keywords import model_for

NUMBERS = {"p2": np.array([1.0, 3.0, 10.0]), "kr": np.array([0.06, 0.15, 0.3])}


def curve(measure: str = "pgv_m_s") -> HazardCurve:
    x = np.geomspace(0.01, 5.0, 25)
    return hazard_curve(measure, x, 1e-2 * x**-1.5 * np.exp(-x))


def blocks(measure: str, component: str) -> tuple[KernelBlocks, HazardLevel]:
    shaking = HazardLevel.of(curve(measure), component=component)
    model = model_for({}, ("p2", "kr", measure), "toppling")
    ((_, expected),) = KernelBlocks.of(model, shaking.median, NUMBERS, np.zeros(3, dtype=np.intp))
    return expected, shaking


def moved(model: FragilityModel, place: int, step: float) -> FragilityModel:
    steps = [0.0] * model.errors.size
    steps[place] = step
    return model.moved(steps)


@pytest.mark.parametrize("component", ["single", "rotd50"])
@pytest.mark.parametrize("measure", ["pgv_m_s", "pga_g"])
def test_gradients_are_those_of_differences(measure: str, component: str) -> None:
    expected, shaking = blocks(measure, component)
    mass = curve_mass([[curve(measure)]], np.ones(1), shaking)
    result = rates(expected, mass, 0.95).gradient
    for place in range(result.shape[0]):
        step = 1e-5
        high, low = (
            rates(
                replace(expected, model=moved(expected.model, place, side * step)), mass, 0.95
            ).rate
            for side in (1.0, -1.0)
        )
        expected_slope = (high - low) / (2.0 * step)
        np.testing.assert_allclose(result[place], expected_slope, rtol=1e-5, atol=1e-12)


def test_the_mass_is_the_rate_of_the_first_level_with_scatter_and_without() -> None:
    for component in ("single", "rotd50"):
        shaking = HazardLevel.of(curve(), component=component)
        mass = curve_mass([[curve()]], np.ones(1), shaking)
        assert mass.mass.sum() == pytest.approx(curve().annual_rate[0], rel=1e-6)
    # and of any level on, half of the node that stands on it
    grid = Grid.over(0.005, np.log(0.01), np.log(5.0))
    node = grid.size // 2
    beyond = under([curve()], grid)[0][node:]
    level = float(np.exp(grid.u[node]))
    assert beyond.sum() - 0.5 * beyond[0] == pytest.approx(float(curve().rate_at(level)), rel=1e-4)


def random_curve(rng: np.random.Generator, measure: str) -> HazardCurve:
    """A curve of random ends, steps and slopes, flat in parts, steep in others."""
    n = int(rng.integers(2, 15))
    steps = rng.uniform(0.1, 0.8, n)
    x = np.exp(np.cumsum(steps) + rng.uniform(-7.0, -1.0))
    falls = rng.exponential(rng.uniform(0.01, 3.0), n) * (rng.random(n) > 0.2)
    return hazard_curve(measure, x, 10.0 ** rng.uniform(-4.0, 0.0) * np.exp(-np.cumsum(falls)))


def test_rates_of_random_pairs_are_bounded_and_monotone() -> None:
    """10,000 pairs of curve and block: 0 <= rate <= that of the first level, falling with k_r."""
    rng, pairs = np.random.default_rng(45), 100
    site = np.zeros(pairs, dtype=np.intp)
    for turn in range(100):
        measure, component = ("pgv_m_s", "pga_g")[turn % 2], ("single", "rotd50")[turn // 2 % 2]
        drawn = random_curve(rng, measure)
        shaking = HazardLevel.of(drawn, component=component)
        p2 = np.exp(rng.uniform(np.log(0.1), np.log(30.0), pairs))
        kr = np.exp(rng.uniform(np.log(0.02), np.log(3.0), pairs))

        def annual(
            curve: HazardCurve, kr: np.ndarray, shaking: HazardLevel = shaking,
            measure: str = measure, p2: np.ndarray = p2,
        ) -> np.ndarray:  # fmt: skip
            model = model_for({}, ("p2", "kr", measure), "toppling")
            numbers = {"p2": p2, "kr": kr}
            ((_, expected),) = KernelBlocks.of(model, shaking.median, numbers, site)
            return rates(expected, curve_mass([[curve]], np.ones(1), shaking), 0.95).rate

        rate = annual(drawn, kr)
        assert (rate >= 0.0).all()
        assert (rate <= drawn.annual_rate[0]).all()
        assert (annual(drawn, 1.05 * kr) <= rate).all()
        higher = hazard_curve(measure, drawn.levels, 1.3 * drawn.annual_rate)
        assert (annual(higher, kr) >= rate).all()
