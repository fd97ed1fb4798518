"""The method ``power``: outcomes, a power of y/X(p).

    P = 1 - exp(-eta),   eta = h(p) [b0 + b1 ln(X(p)/y)],   h(p) = p^.30,   0 if y >= X(p)

On the reference h lowers the held-out log loss from .1121 to .0978. (9) of
docs/theory/fragility.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.fragility import methods
from rbfrag.fragility.methods import Eta, Form, Method, Numbers, SizeFactor


def _eta(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    ratio = ns.log(v["intensity_m_s"] / v["y_m_s"])
    return Eta(b[0] + b[1] * ratio, (1.0, ratio))


METHOD = Method(
    name="power",
    block=methods.TOPPLING_BLOCK,
    link=methods.COMPLEMENT,
    forms={
        "xp": Form(
            ("b0", "b_ln_xp_over_y"),
            _eta,
            3,
            (methods.ABOVE_SPECTRUM,),
            size_factor=SizeFactor(0.30),
            terms=("1", r"\ln(x/y)"),
        )
    },
    reads="outcomes",
    meaning=methods.OF_OUTCOME,
    fit="rbfrag.fragility.fit.outcomes:fit_outcomes",
)
