"""Logarithm and exponential against those of the C library, and compiled against plain."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rbfrag.fragility import elementary
from rbfrag.fragility.compiled_formulas import exponentials, logarithms


@settings(deadline=None)
@given(st.floats(1e-300, 1e300))
def test_logarithm_within_one_unit_of_the_last_place(x):
    assert abs(elementary.ln(x) - math.log(x)) <= math.ulp(math.log(x))


@settings(deadline=None)
@given(st.floats(-700.0, 700.0))
def test_exponential_within_one_unit_of_the_last_place(x):
    assert abs(elementary.exponential(x) - math.exp(x)) <= math.ulp(math.exp(x))


def test_exact_values():
    assert elementary.ln(1.0) == 0.0
    assert elementary.exponential(0.0) == 1.0
    assert elementary.ln(2.0) == math.log(2.0)
    for k in range(-300, 300, 7):
        assert elementary.ln(2.0**k) == math.log(2.0**k)
    assert elementary.exponential(1e9) == elementary.exponential(700.0)
    assert elementary.exponential(-1e9) == elementary.exponential(-700.0)


def test_compiled_ones_have_the_same_bits():
    random = np.random.default_rng(5)
    x = np.concatenate([
        np.exp(random.uniform(-700, 700, 3000)),
        np.exp(random.uniform(-1e-3, 1e-3, 1000)),
        np.geomspace(1e-320, 1e-300, 100),  # the smallest numbers have fewer bits
        [math.sqrt(0.5), np.nextafter(math.sqrt(0.5), 0.0), 1.0],
    ])  # fmt: skip
    out = np.empty_like(x)
    logarithms(x, out)
    assert out.tolist() == [elementary.ln(value) for value in x.tolist()]
    z = np.concatenate([random.uniform(-750, 750, 3000), random.uniform(-1e-3, 1e-3, 1000)])
    out = np.empty_like(z)
    exponentials(z, out)
    assert out.tolist() == [elementary.exponential(value) for value in z.tolist()]


def test_neighbouring_numbers_keep_their_order():
    random = np.random.default_rng(6)
    x = np.exp(random.uniform(-9, 2, 200_000))
    for of, column in ((logarithms, x), (exponentials, np.log(x)), (exponentials, -x)):
        here, above = np.empty_like(column), np.empty_like(column)
        of(column, here)
        of(np.nextafter(column, np.inf), above)
        assert (above >= here).all()
