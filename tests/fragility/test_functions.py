import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from rbfrag.errors import InputError
from rbfrag.fragility.functions import SCALAR, array_functions, normal_half_width


def test_normal_cdf_against_scipy_in_both_tails():
    z = np.linspace(-37.0, 9.0, 4001)
    ours = array_functions().normal_cdf(z)
    # erfc of a rounded z/√2 carries a relative error of z² ulp; that is the whole of it.
    assert np.all(np.abs(ours / norm.cdf(z) - 1.0) < 5e-16 * (8.0 + z * z))


def test_normal_cdf_of_arrays_has_the_bits_of_scalars():
    z = np.concatenate([np.linspace(-45.0, 45.0, 70001), [0.0, -0.0, np.inf, -np.inf]])
    assert array_functions().normal_cdf(z).tolist() == [SCALAR.normal_cdf(v) for v in z.tolist()]


def test_shape_is_kept():
    assert array_functions().normal_cdf(np.zeros((2, 0, 3))).shape == (2, 0, 3)
    assert array_functions().normal_cdf(np.zeros((4, 5)).T).shape == (5, 4)


@given(st.floats(1e-6, 1.0 - 1e-12))
def test_half_width_is_the_normal_quantile(level):
    assert normal_half_width(level) == pytest.approx(norm.isf((1.0 - level) / 2.0), rel=1e-11)


@pytest.mark.parametrize("level", [0.0, 1.0, -0.5, 95.0, math.nan, "0.95", None])
def test_a_level_outside_zero_and_one_is_refused(level):
    with pytest.raises(InputError, match="level"):
        normal_half_width(level)
