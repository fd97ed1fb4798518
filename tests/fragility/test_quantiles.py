import pytest
from scipy.stats import norm, t

from rbfrag.errors import InputError
from rbfrag.fragility.model import student_half_width


@pytest.mark.parametrize("freedom", [2, 3, 4, 9, 46, 47, 300])
@pytest.mark.parametrize("level", [0.01, 0.5, 0.9, 0.95, 0.99, 0.9999])
def test_against_scipy(level, freedom):
    assert student_half_width(level, freedom) == pytest.approx(
        t.ppf(0.5 + level / 2, freedom), rel=1e-9
    )


@pytest.mark.parametrize("level", [0.5, 0.95])
def test_without_freedoms_it_is_normal(level):
    assert student_half_width(level, 0) == pytest.approx(norm.ppf(0.5 + level / 2), rel=1e-12)


@pytest.mark.parametrize("level", [0.0, 1.0, -0.1, 95, True, float("nan")])
def test_levels_that_are_none(level):
    with pytest.raises(InputError, match="between 0 and 1"):
        student_half_width(level, 46)
