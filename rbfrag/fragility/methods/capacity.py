"""The method ``capacity``: outcomes of slumping blocks under scaled records, probit; and
``confined``.

    P = Φ(eta), 0 from r = 1 on

    pgv_pga_m   eta = b0 + b1 ln((1 - r)/r) + b2 ln z + b3 ln k_s + b4 (M - 6.5)
    pgv_pga     the same without M

r = k_s/PGA, z = p_s PGV/(PGA g). P falls with k_s where b3 < b1: the slope of eta by ln k_s is
b3 - b1/(1 - r). It rises where all measures rise together: z stays and r falls. Of confined
toppling (:mod:`rbfrag.fragility.methods.confined`) k_ct and p_ct stand for k_s and p_s.
"""

from __future__ import annotations

from rbfrag.fragility import method
from rbfrag.fragility.method import ArrayNamespace, LinearPredictor, Parameters, Values, linear
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.vocabulary.quantities import QUANTITIES

MIDDLE_MAGNITUDE = 6.5


def _failure(_: Values, rotation: float | None) -> str:
    if rotation is None:
        return "failure past recovery"
    return f"a rotation of {rotation:g} degrees or failure past recovery"


_PARAMETERS = ("b0", "b_ln_excess", "b_ln_z", "b_ln_k")


def capacity_method(
    name: str, kind: str, numbers: tuple[str, str], moves: str, *, criterion: str | None = None
) -> method.Method:
    """Return the method for blocks of a kind that are simulated under scaled records.

    Args:
        numbers: names of the yield acceleration coefficient and of p² at rest [1/s²].
        moves: what such a block does that fails.
        criterion: name of the criterion of failure, if there are several.
    """
    strength, size = numbers
    at_rest = method.MechanicalBound(
        lambda v: v[strength] >= v["pga_g"],
        strength,
        f"{QUANTITIES[strength].symbol}{{{strength}}} is not below PGA{{pga_g}}: "
        "the block does not move",
    )

    def pgv_pga(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
        r = v[strength] / v["pga_g"]
        z = v["p"] * v["pgv_m_s"] / (v["pga_g"] * STANDARD_GRAVITY_M_S2)
        return linear(b, 1.0, ns.log((1.0 - r) / r), ns.log(z), ns.log(v[strength]))

    def pgv_pga_m(b: Parameters, v: Values, ns: ArrayNamespace) -> LinearPredictor:
        return linear(b, *pgv_pga(b, v, ns).slopes, v["magnitude"] - MIDDLE_MAGNITUDE)

    return method.Method(
        name=name,
        block=method.BlockParameters(
            numbers, kind, strength, size, at_rest, criterion=criterion, points="scaled_records"
        ),
        link=method.NORMAL,
        forms={
            "pgv_pga_m": method.Form((*_PARAMETERS, "b_m"), pgv_pga_m, (at_rest,)),
            "pgv_pga": method.Form(_PARAMETERS, pgv_pga, (at_rest,)),
        },
        meaning=f"probability that the block {moves}",
        fit="outcomes",
        failure=_failure,
    )


METHOD = capacity_method(
    "capacity",
    "slumping",
    ("ks", "ps2"),
    "slumps past recovery, or by the rotation asked for",
    criterion="rotation_deg",
)
