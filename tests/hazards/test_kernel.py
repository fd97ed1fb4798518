"""The kernel of rates: mass, and how a rate changes with the model's parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbfrag.fragility.model import FragilityModel
from rbfrag.hazards.curve import HazardCurve, hazard_curve
from rbfrag.hazards.kernel import KernelBlocks, rates
from rbfrag.hazards.mass import Grid, curve_mass, under
from rbfrag.hazards.shaking import LevelShaking
from rbfrag.question.keywords import model_for

NUMBERS = {"p2": np.array([1.0, 3.0, 10.0]), "kr": np.array([0.06, 0.15, 0.3])}


def curve(measure: str = "pgv_m_s") -> HazardCurve:
    x = np.geomspace(0.01, 5.0, 25)
    return hazard_curve(measure, x, 1e-2 * x**-1.5 * np.exp(-x))


def blocks(measure: str, component: str) -> tuple[KernelBlocks, LevelShaking]:
    shaking = LevelShaking.of(curve(measure), component=component)
    model = model_for({}, ("p2", "kr", measure), "toppling")
    ((_, own),) = KernelBlocks.of(model, shaking.median, NUMBERS, np.zeros(3, dtype=np.intp))
    return own, shaking


def moved(model: FragilityModel, place: int, step: float) -> FragilityModel:
    values = list(model.parameters)
    values[place] += step
    return replace(model, parameters=tuple(values))


@pytest.mark.parametrize("component", ["single", "rotd50"])
@pytest.mark.parametrize("measure", ["pgv_m_s", "pga_g"])
def test_gradients_are_those_of_differences(measure: str, component: str) -> None:
    own, shaking = blocks(measure, component)
    mass = curve_mass([[curve(measure)]], np.ones(1), shaking)
    found = rates(own, mass, 0.95).gradient
    for place in range(found.shape[0]):
        step = 1e-5
        high, low = (
            rates(replace(own, model=moved(own.model, place, side * step)), mass, 0.95).rate
            for side in (1.0, -1.0)
        )
        np.testing.assert_allclose(found[place], (high - low) / (2.0 * step), rtol=1e-5)


def test_the_mass_is_the_rate_of_the_first_level_with_scatter_and_without() -> None:
    for component in ("single", "rotd50"):
        shaking = LevelShaking.of(curve(), component=component)
        mass = curve_mass([[curve()]], np.ones(1), shaking)
        assert mass.mass.sum() == pytest.approx(curve().annual_rate[0], rel=1e-6)
    # and of any level on, half of the node that stands on it
    grid = Grid.over(0.005, np.log(0.01), np.log(5.0))
    node = grid.size // 2
    beyond = under([curve()], grid)[0][node:]
    level = float(np.exp(grid.u[node]))
    assert beyond.sum() - 0.5 * beyond[0] == pytest.approx(float(curve().rate_at(level)), rel=1e-4)
