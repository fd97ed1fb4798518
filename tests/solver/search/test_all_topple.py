"""K_low: below it every block topples, whatever it did before."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.batch import simulate_many
from rbfrag.solver.integrator.block_excitation import block_excitation
from rbfrag.solver.integrator.toppling_kernel import TOPPLED
from rbfrag.solver.search.borders import all_topple_below, least_rate
from rbfrag.solver.toppling_run import respond
from tests.solver.search.test_critical import shaking


@pytest.mark.parametrize("with_vertical", [False, True])
def test_every_block_below_topples(with_vertical: bool) -> None:
    rng = np.random.default_rng(3)
    result = 0
    for seed in range(12):
        vertical = shaking(seed + 70, pga_g=0.3) if with_vertical else None
        excited = excitation(shaking(seed), vertical)
        for p2 in (30.0, 4.0, 0.5):
            g = block_excitation(excited, p2=p2)
            low = all_topple_below(g, 1e-3, 0.5, 1e-9, np.empty(excited.q.size))
            if low > 1e-3:
                result += 1
                runs = simulate_many(excited, p2=p2, kr=rng.uniform(1e-3, low, 60))
                assert (runs.outcome == TOPPLED).all()
    assert result > 20


def test_no_block_that_stays_falls_back_faster_than_the_bound() -> None:
    compared = 0
    for seed in range(6):
        excited = excitation(shaking(seed))
        for p2, kr in ((30.0, 0.2), (4.0, 0.1), (0.5, 0.05)):
            g = block_excitation(excited, p2=p2)
            bound = np.empty(excited.q.size)
            least_rate(g, kr, bound)
            history = respond(shaking(seed), p2=p2, kr=1.2 * kr, history=True).history
            assert history is not None
            run = respond(shaking(seed), p2=p2, kr=0.9 * kr, history=True)
            assert run.history is not None
            if run.outcome != "stable":
                continue
            phi = np.arctan(0.9 * kr) - run.history.theta_rad
            x = run.history.theta_dot_rad_s / g.p + 2.0 * np.sin(0.5 * phi)
            at_nodes = np.interp(run.history.time_s, excited.time_s, bound)
            nodes = np.isin(run.history.time_s, excited.time_s)
            assert (x >= at_nodes - 1e-12)[nodes].all()
            compared += 1
    assert compared > 0


def test_one_long_push_topples_all_that_it_lifts() -> None:
    push = GroundMotion.from_nodes([0.0, 0.0, 20.0, 20.0], [0.0, 0.3, 0.3, 0.0])
    g = block_excitation(excitation(push), p2=1.0)
    bound = np.empty(g.q.size)
    low = all_topple_below(g, 0.001, 0.3, 1e-9, bound)
    # the linear estimate is half of what is to come: the worst block is falling from balance
    assert 0.14 < low < 0.15
    assert all_topple_below(g, 0.2, 0.3, 1e-9, bound) == 0.2
