"""The method ``power``: outcomes, a power of y/X(p).

    P = 1 - exp(-eta),   eta = b0 + b1 ln(X(p)/y),   0 if y >= X(p)

(9) of docs/theory/fragility.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.fragility.methods import (
    ABOVE_SPECTRUM,
    COMPLEMENT,
    OF_OUTCOME,
    TOPPLING_BLOCK,
    Eta,
    Form,
    Method,
    Numbers,
)


def _eta(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    ratio = ns.log(v["intensity_m_s"] / v["y_m_s"])
    return Eta(b[0] + b[1] * ratio, (1.0, ratio))


METHOD = Method(
    name="power",
    block=TOPPLING_BLOCK,
    link=COMPLEMENT,
    forms={"xp": Form(("b0", "b_ln_xp_over_y"), _eta, 3, (ABOVE_SPECTRUM,))},
    reads="outcomes",
    meaning=OF_OUTCOME,
    fit="rbfrag.fragility.fit.outcomes:fit_outcomes",
)
