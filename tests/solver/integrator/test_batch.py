"""Many blocks in one call: the same numbers as one at a time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.batch import simulate_many
from rbfrag.solver.toppling_run import simulate
from tests.solver.search.test_critical import shaking


@pytest.mark.parametrize("with_vertical", [False, True])
def test_every_block_of_a_batch_has_the_numbers_of_its_single_run(with_vertical: bool) -> None:
    vertical = shaking(60, pga_g=0.4) if with_vertical else None
    excited = excitation(shaking(11), vertical, "reverse")
    kr = np.geomspace(0.02, 1.1 * excited.max_q, 23)
    p2 = np.array([30.0, 3.0, 0.1])[:, None]
    runs = simulate_many(excited, p2=p2, kr=kr)
    outcomes = set()
    for i in range(3):
        for j in range(23):
            alone = simulate(excited, p2=float(p2[i, 0]), kr=float(kr[j]))
            local = (
                runs.outcome[i, j], runs.peak_rad[i, j], runs.started_s[i, j],
                runs.verdict_s[i, j], runs.steps[i, j], runs.samples_moved[i, j],
            )  # fmt: skip
            *rest, error, steps, samples = alone[:7]
            np.testing.assert_array_equal(np.array(local), np.array([*rest, steps, samples]))
            # two compilations may round the estimate in its last bit (numba 0.60 does)
            assert runs.error_rad[i, j] == pytest.approx(error, rel=1e-15, abs=0.0, nan_ok=True)
            outcomes.add(alone.outcome)
    assert len(outcomes) > 1
    np.testing.assert_array_equal(runs.theta_n, runs.peak_rad / np.arctan(kr))


def test_a_batch_does_not_depend_on_its_company_or_order() -> None:
    excited = excitation(shaking(3))
    kr = np.geomspace(0.03, 0.5, 40)
    together = simulate_many(excited, p2=10.0, kr=kr)
    backwards = simulate_many(excited, p2=10.0, kr=kr[::-1])
    few = simulate_many(excited, p2=10.0, kr=kr[7:9])
    np.testing.assert_array_equal(together.theta_n, backwards.theta_n[::-1])
    np.testing.assert_array_equal(together.theta_n[7:9], few.theta_n)
    assert together.outcome.shape == (40,)


def test_a_batch_of_none_is_empty() -> None:
    runs = simulate_many(excitation(shaking(3)), p2=np.empty(0), kr=np.empty(0))
    assert runs.outcome.shape == (0,)


@pytest.mark.parametrize(
    ("p2", "kr", "words"),
    [
        ([1.0, 2.0], [0.1, 0.2, 0.3], "compatible shapes"),
        ([1.0, -2.0], 0.1, "p2 must be positive finite numbers, not -2"),
        (1.0, [0.1, math.nan], "kr must be positive finite numbers, not nan"),
        ("x", 0.1, "must be numbers"),
    ],
)
def test_bad_blocks_are_named(p2: object, kr: object, words: str) -> None:
    excited = excitation(GroundMotion(np.array([0.0, 0.2, 0.0]), 0.1))
    with pytest.raises(InputError, match=words):
        simulate_many(excited, p2=p2, kr=kr)  # type: ignore[arg-type]
