"""The exact interval of a counted share."""

from __future__ import annotations

import pytest
from scipy.stats import binom
from statsmodels.stats.proportion import proportion_confint

from rbfrag.errors import InputError
from rbfrag.rockmasses.counts import exact_interval


@pytest.mark.parametrize("count", [0, 1, 5, 19, 20])
@pytest.mark.parametrize("level", [0.5, 0.95, 0.999])
def test_the_ends_are_where_the_tails_of_the_binomial_distribution_are(
    count: int, level: float
) -> None:
    low, high = exact_interval(count, 20, level)
    tail = 0.5 * (1.0 - level)
    if count > 0:
        assert binom.sf(count - 1, 20, low) == pytest.approx(tail, rel=1e-9)
    else:
        assert low == 0.0
    if count < 20:
        assert binom.cdf(count, 20, high) == pytest.approx(tail, rel=1e-9)
    else:
        assert high == 1.0
    theirs = proportion_confint(count, 20, alpha=1.0 - level, method="beta")
    assert (low, high) == pytest.approx(theirs, rel=1e-9, abs=1e-12)


def test_none_of_many() -> None:
    # 1 - (α/2)^(1/n), by hand
    assert exact_interval(0, 100, 0.95)[1] == pytest.approx(1.0 - 0.025**0.01, rel=1e-12)


@pytest.mark.parametrize("level", [0.0, 1.0, -1.0, float("nan")])
def test_rejected(level: float) -> None:
    with pytest.raises(InputError, match="level"):
        exact_interval(1, 2, level)
