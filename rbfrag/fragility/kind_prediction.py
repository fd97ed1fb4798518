"""The probability that a block slumps, or slides further than a stated distance.

For single numbers neither numpy nor any other library is loaded.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from os import PathLike

from rbfrag.db.rows import ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility.kind_formulas import SINGLE
from rbfrag.fragility.kind_model import KindModel, find_kind_model
from rbfrag.fragility.quantiles import student_half_width
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2


@dataclass(frozen=True)
class KindPrediction:
    """Probability that one block fails in one motion.

    Args:
        kind: ``sliding`` or ``slumping``.
        probability: P, between 0 and 1.
        ci_low: lower end of the confidence interval of P.
        ci_high: upper end of it.
        level: confidence level of the interval.
        model: name of the model that answered.
        term: its intensity term.
        method: how it was fitted.
        failure: what the probability is one of, in words.
        in_domain: True when block and motion lie in the ranges that were fitted.
        y_m_s: slumping: k_s g/p_s of the block [m/s]; None for sliding.
        median_displacement_m: sliding: the displacement that is exceeded with P = 1/2 [m]; None
            for slumping, and where the block does not move.
        warnings: sentences about suspicious input or an answer to be doubted.
    """

    kind: str
    probability: float
    ci_low: float
    ci_high: float
    level: float
    model: str
    term: str
    method: str
    failure: str
    in_domain: bool
    y_m_s: float | None = None
    median_displacement_m: float | None = None
    warnings: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, object]:
        """Return the answer under the keys of the JSON contract."""
        return {**asdict(self), "warnings": list(self.warnings)}


def predict_sliding(
    ky: float,
    displacement_m: float,
    *,
    pgv_m_s: float,
    pga_g: float | None = None,
    beta_deg: float = 0.0,
    model: KindModel | ModelRow | str | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
) -> KindPrediction:
    """Return the probability that a block slides further than a distance.

    P = Φ(eta), eta = [c + b1 ln(PGV²/(k_y g)) + b2 ln(1 - k_y/PGA) - ln d]/σ on a level plane; on
    a base that dips, d is divided by cos(φ - β)/cos φ. P is 0 where k_y >= PGA: the block does not
    move. The interval is Φ(eta ± t s), s by the delta method from the clustered covariance.

    Args:
        ky: yield acceleration coefficient tan(φ - β) [-], above zero.
        displacement_m: the distance down the base [m], above zero.
        pgv_m_s: peak ground velocity of the horizontal component [m/s].
        pga_g: its peak ground acceleration [g]; without it the answer is less sure.
        beta_deg: dip of the base, out of the slope positive [deg].
        model: a model, the name of a stored one, or None for the best that is suited.
        level: confidence level of the interval.
        db: database, as for :func:`rbfrag.fragility.predict.predict`.

    Raises:
        InputError: a value that cannot be used.
        UnknownModelError: no such model.
        DatabaseError: the database cannot be read.
    """
    _refuse({"ky": (ky, True), "displacement_m": (displacement_m, True)})
    _refuse_motion(pgv_m_s, pga_g)
    level_m = displacement_m / dip_factor(ky, beta_deg)
    found = find_kind_model("sliding", with_pga=pga_g is not None, model=model, db=db)
    values = _values(ky=ky, displacement_m=level_m, pgv_m_s=pgv_m_s, pga_g=pga_g)
    still = pgv_m_s == 0.0 or (pga_g is not None and ky >= pga_g)
    probability, low, high, eta, sigma = answer(found, values, level, still=still)
    median = None if still else displacement_m * math.exp(eta * sigma)
    outside = [] if still else found.outside(_domain_values(values))
    warnings = [*found.notes, *outside]
    if still:
        warnings.append(_still("k_y", ky, pga_g))
    return KindPrediction(
        kind="sliding",
        probability=probability,
        ci_low=low,
        ci_high=high,
        level=level,
        model=found.name,
        term=found.row.term,
        method=found.row.method,
        failure=f"permanent displacement above {displacement_m:g} m",
        in_domain=not outside,
        median_displacement_m=median,
        warnings=tuple(warnings),
    )


def predict_slumping(
    ks: float,
    ps2: float,
    *,
    pgv_m_s: float,
    pga_g: float | None = None,
    rotation_deg: float | None = None,
    leaves_g: float | None = None,
    model: KindModel | ModelRow | str | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
) -> KindPrediction:
    """Return the probability that a block slumps past recovery, or by a stated rotation.

    P = Φ(eta), eta = [ln((1 - r)/r) - c + b ln z]/σ with r = k_s/PGA and z = p_s PGV/(PGA g);
    without PGA eta = [ln PGV - c - b ln(k_s g/p_s)]/σ. P is 0 where k_s >= PGA. k_s and p_s² at
    rest do not fix a slump; the scatter between blocks that share them is part of σ.

    Args:
        ks: yield acceleration coefficient of slumping [-], above zero.
        ps2: frequency parameter p_s² at rest [1/s²], above zero.
        pgv_m_s: peak ground velocity of the horizontal component [m/s].
        pga_g: its peak ground acceleration [g]; without it the answer is less sure.
        rotation_deg: rotation that counts as failure [deg]; None for failure past recovery. There
            must be a model of it.
        leaves_g: acceleration at which the block leaves its back plane [g], if known: above it
            the answer warns.
        model: a model, the name of a stored one, or None for the best that is suited.
        level: confidence level of the interval.
        db: database, as for :func:`rbfrag.fragility.predict.predict`.

    Raises:
        InputError: a value that cannot be used.
        UnknownModelError: no such model.
        DatabaseError: the database cannot be read.
    """
    _refuse({"ks": (ks, True), "ps2": (ps2, True)})
    _refuse_motion(pgv_m_s, pga_g)
    found = find_kind_model(
        "slumping", with_pga=pga_g is not None, rotation_deg=rotation_deg, model=model, db=db
    )
    values = _values(ks=ks, ps2=ps2, pgv_m_s=pgv_m_s, pga_g=pga_g)
    still = pgv_m_s == 0.0 or (pga_g is not None and ks >= pga_g)
    probability, low, high, _, _ = answer(found, values, level, still=still)
    y_m_s = ks * STANDARD_GRAVITY_M_S2 / math.sqrt(ps2)
    outside = [] if still else found.outside({**_domain_values(values), "y_m_s": y_m_s})
    warnings = [*found.notes, *outside]
    if still:
        warnings.append(_still("k_s", ks, pga_g))
    if leaves_g is not None and pga_g is not None and pga_g > leaves_g:
        warnings.append(
            f"PGA {pga_g:.4g} g exceeds {leaves_g:.4g} g, at which the block leaves its back "
            "plane: the model takes it to stay there"
        )
    return KindPrediction(
        kind="slumping",
        probability=probability,
        ci_low=low,
        ci_high=high,
        level=level,
        model=found.name,
        term=found.row.term,
        method=found.row.method,
        failure="failure past recovery"
        if rotation_deg is None
        else f"a rotation of {rotation_deg:g} degrees or failure past recovery",
        in_domain=not outside,
        y_m_s=y_m_s,
        warnings=tuple(warnings),
    )


def answer(
    model: KindModel, values: Mapping[str, float], level: float, *, still: bool
) -> tuple[float, float, float, float, float]:
    """Return P, its interval, eta and σ of one block.

    Args:
        model: the model.
        values: what its formula reads.
        level: confidence level.
        still: True where mechanics says that the block does not move.
    """
    reach = student_half_width(level, model.degrees_of_freedom)
    if still:
        return 0.0, 0.0, 0.0, -math.inf, 0.0
    eta, log_sigma, slopes, _ = model.formula.eta(model.parameters, values, SINGLE)
    off = reach * model.standard_error(slopes)
    return _normal(eta), _normal(eta - off), _normal(eta + off), eta, math.exp(log_sigma)


def dip_factor(ky: float, beta_deg: float) -> float:
    """Return cos(φ - β)/cos φ of a base whose yield is tan(φ - β).

    Raises:
        InputError: no friction angle below 90 degrees gives that yield.
    """
    slope_rad = math.radians(beta_deg)
    phi_rad = slope_rad + math.atan(ky)
    if not abs(beta_deg) < 90.0 or not 0.0 <= phi_rad < 0.5 * math.pi:
        raise InputError(
            f"ky = {ky:g} on a base of beta_deg = {beta_deg:g} means a friction angle of "
            f"{math.degrees(phi_rad):.4g} degrees: it must be from 0 to below 90"
        )
    return math.cos(math.atan(ky)) / math.cos(phi_rad)


def _normal(z: float) -> float:
    return 0.5 * math.erfc(-z * math.sqrt(0.5))


def _values(**given: float | None) -> dict[str, float]:
    return {name: float(value) for name, value in given.items() if value is not None}


def _domain_values(values: Mapping[str, float]) -> dict[str, float]:
    found = {name: value for name, value in values.items() if name not in ("ks", "ky")}
    k = values["ky"] if "ky" in values else values["ks"]
    if "pga_g" in values:
        found["k_over_pga"] = k / values["pga_g"]
        found["pgv_over_pga_s"] = values["pgv_m_s"] / (values["pga_g"] * STANDARD_GRAVITY_M_S2)
    return found


def _refuse(given: Mapping[str, tuple[object, bool]]) -> None:
    for name, (value, above_zero) in given.items():
        if isinstance(value, bool | str | bytes) or not isinstance(value, int | float):
            raise InputError(f"{name} = {value!r} is not a number")
        if not math.isfinite(value) or value < 0.0 or (above_zero and value == 0.0):
            least = "above zero" if above_zero else "zero or more"
            raise InputError(f"{name} = {value!r}: it must be finite and {least}")


def _refuse_motion(pgv_m_s: float, pga_g: float | None) -> None:
    _refuse({"pgv_m_s": (pgv_m_s, False)})
    if pga_g is not None:
        _refuse({"pga_g": (pga_g, False)})
        if (pgv_m_s == 0.0) != (pga_g == 0.0):
            raise InputError(
                f"pgv_m_s = {pgv_m_s:g} with pga_g = {pga_g:g}: both are zero, or neither is"
            )


def _still(name: str, k: float, pga_g: float | None) -> str:
    if pga_g is None or pga_g == 0.0:
        return "the ground does not move: P is 0"
    return f"{name} = {k:.4g} is not below PGA = {pga_g:.4g} g: the block does not move, P is 0"
