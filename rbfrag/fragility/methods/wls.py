"""The method ``wls``: the models of the dissertation, a straight line with normal dispersion.

    y* = c0 + c1 x + ε,   ε normal with variance  v(x) = v0 + v1 x (+ v2 x²)
    P  = P(y* >= y | x) = Φ(eta),   eta = (c0 + c1 x - y)/sqrt(v(x))

Equations (4.28)-(4.31) of Gibson's dissertation; (1) and (2) of docs/theory/fragility.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rbfrag.fragility import fits, method
from rbfrag.fragility.method import ArrayNamespace, FittedVariance, Form, LinearPredictor, Method
from rbfrag.fragility.straight_line import (
    NEGATIVE_LIMIT,
    mean_m_s,
    negative_probability,
    rise,
    variance_m2_s2,
)
from rbfrag.results.numbers import exact_percent


def _eta(b: Sequence[float], v: Mapping[str, Any], ns: ArrayNamespace) -> LinearPredictor:
    x = v["intensity_m_s"]
    variance = variance_m2_s2(b, x)
    per = 1.0 / ns.sqrt(variance)
    eta = (mean_m_s(b, x) - v["y_m_s"]) * per
    by_v = eta / (variance * -2.0)
    slopes = (per, x * per, by_v, by_v * x)
    return LinearPredictor(eta, slopes if len(b) == 4 else (*slopes, by_v * x * x))


def _doubts(
    b: Sequence[float], v: Mapping[str, Any], ns: ArrayNamespace
) -> Iterator[tuple[Any, str, str]]:
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


_LINE = Form(
    ("c0", "c1", "v0", "v1"), _eta, 6,
    terms=("1", "x", "", ""), equation=r"(<sum> - y)/\sigma", where=r"\sigma^2 = <v0><+v1>\,x",
)  # fmt: skip
_QUADRATIC = Form(
    ("c0", "c1", "v0", "v1", "v2"), _eta, 6,
    terms=("1", "x", "", "", ""), equation=r"(<sum> - y)/\sigma",
    where=r"\sigma^2 = <v0><+v1>\,x<+v2>\,x^2",
)  # fmt: skip

METHOD = Method(
    name="wls",
    block=method.TOPPLING_BLOCK,
    link=method.NORMAL,
    forms={"pgv": _LINE, "pga_tm": _LINE, "pgd_tm": _QUADRATIC, "xp": _LINE},
    reads="critical",
    meaning=method.OF_CRITICAL,
    fit=fits.line,
    doubts=_doubts,
    fitted_variance=FittedVariance(mean_m_s, variance_m2_s2),
)
