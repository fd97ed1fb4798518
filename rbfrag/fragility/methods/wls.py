"""The method ``wls``: the models of the dissertation, a straight line with normal dispersion.

    y* = c0 + c1 x + ε,   ε normal with variance  v(x) = v0 + v1 x (+ v2 x²)
    P  = P(y* >= y | x) = Φ(eta),   eta = (c0 + c1 x - y)/sqrt(v(x))

Equations (4.28)-(4.31) of Gibson's dissertation; (1) and (2) of docs/theory/fragility.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rbfrag.fragility import method
from rbfrag.fragility.method import ArrayNamespace, LinearPredictor, Parameters, Values
from rbfrag.results.numbers import exact_percent

NEGATIVE_LIMIT = 0.025
"""Probability of a negative critical velocity above which a straight line is doubted."""


def mean_m_s(b: Parameters, x: Any) -> Any:
    """Return the mean critical toppling velocity c0 + c1 x [m/s] at intensity x [m/s]."""
    return x * b[1] + b[0]


def variance_m2_s2(b: Parameters, x: Any) -> Any:
    """Return the variance v(x) [m²/s²] of the critical toppling velocity at intensity x [m/s]."""
    if len(b) > 4:
        return (x * b[4] + b[3]) * x + b[2]
    return x * b[3] + b[2]


def negative_probability(b: Parameters, x: Any, ns: ArrayNamespace) -> Any:
    """Return the model's probability of negative critical velocities at x."""
    return ns.ndtr(-(mean_m_s(b, x) / ns.sqrt(variance_m2_s2(b, x))))


def rise(b: Parameters, x: Any, y: Any) -> Any:
    """Return v^(3/2) deta/dx, negative where P would decrease with increasing intensity."""
    slope = b[3] + 2.0 * b[4] * x if len(b) > 4 else b[3]
    return variance_m2_s2(b, x) * b[1] - (mean_m_s(b, x) - y) * slope * 0.5


def _eta(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
    x = v["intensity_m_s"]
    variance = variance_m2_s2(b, x)
    per = 1.0 / ns.sqrt(variance)
    eta = (mean_m_s(b, x) - v["y_m_s"]) * per
    by_v = eta / (variance * -2.0)
    slopes = (per, x * per, by_v, by_v * x)
    return LinearPredictor(eta, slopes if len(b) == 4 else (*slopes, by_v * x * x))


def _doubts(b: Parameters, v: Values, ns: ArrayNamespace) -> Iterator[tuple[Any, str, str]]:
    outside = "is outside the range where the straight-line normal model makes sense"
    yield (
        negative_probability(b, v["intensity_m_s"], ns) > NEGATIVE_LIMIT,
        "intensity_m_s",
        f"{outside}: there it gives more than {exact_percent(NEGATIVE_LIMIT)} probability "
        "to negative critical velocities",
    )
    yield (
        rise(b, v["intensity_m_s"], v["y_m_s"]) < 0.0,
        "y_m_s",
        f"{outside}: there the probability falls with growing intensity",
    )


_LINE = method.Form(
    ("c0", "c1", "v0", "v1"), _eta,
    terms=("1", "x", "", ""), equation=r"(<sum> - y)/\sigma", where=r"\sigma^2 = <v0><+v1>\,x",
)  # fmt: skip
_QUADRATIC = method.Form(
    ("c0", "c1", "v0", "v1", "v2"), _eta,
    terms=("1", "x", "", "", ""), equation=r"(<sum> - y)/\sigma",
    where=r"\sigma^2 = <v0><+v1>\,x<+v2>\,x^2",
)  # fmt: skip

METHOD = method.Method(
    name="wls",
    block=method.TOPPLING_BLOCK,
    link=method.NORMAL,
    forms={"pgv": _LINE, "pga_tm": _LINE, "pgd_tm": _QUADRATIC, "xp": _LINE},
    meaning=method.OF_CRITICAL,
    fit="line",
    doubts=_doubts,
)
