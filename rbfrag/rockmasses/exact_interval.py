"""Exact interval of a share that was counted in a sample."""

from __future__ import annotations

from rbfrag.errors import InputError


def exact_interval(count: int, of: int, level: float) -> tuple[float, float]:
    """Return the interval of Clopper and Pearson for the share behind a count.

    It covers the true share with at least the stated probability, whatever the share is, because
    it is made of the tails of the binomial distribution itself.

    Args:
        count: how many of the sample.
        of: size of the sample, above 0.
        level: confidence level, between 0 and 1.

    Raises:
        InputError: the level is not between 0 and 1.

    References:
        Clopper and Pearson (1934), Biometrika 26(4), 404-413.
    """
    from scipy.special import betaincinv

    tail = 0.5 * (1.0 - checked_level(level))
    low = float(betaincinv(count, of - count + 1, tail)) if count > 0 else 0.0
    high = float(betaincinv(count + 1, of - count, 1.0 - tail)) if count < of else 1.0
    return low, high


def checked_level(level: float) -> float:
    """Return a confidence level, or refuse what is none."""
    if not isinstance(level, int | float) or not 0.0 < level < 1.0:
        raise InputError(
            f"level = {level!r}: a confidence level lies between 0 and 1, such as 0.95"
        )
    return level
