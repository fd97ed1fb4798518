"""The answer for one block of which there is something to say: a refusal, a rule or a doubt."""

from __future__ import annotations

import math

from rbfrag.errors import InputError
from rbfrag.fragility import formulas
from rbfrag.fragility.answers import Prediction
from rbfrag.fragility.checks import (
    BOUNDS,
    Finding,
    doubts,
    not_lifted,
    outside_domain,
    refusals,
    unstable,
)
from rbfrag.fragility.functions import SCALAR
from rbfrag.fragility.measures import toppling_velocity_m_s
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction_values import NEUTRAL, derived


def predict_with_words(
    model: FragilityModel, values: dict[str, float], level: float, half_width: float
) -> Prediction:
    """Return the answer with its warnings.

    Args:
        model: the model that answers.
        values: p2, kr and measures of the motion by name.
        level: confidence level of the interval.
        half_width: the quantile that belongs to it.

    Raises:
        InputError: a value that cannot be used.
    """
    for refusal in refusals(values, values):
        if refusal.holds:
            raise InputError(refusal.about(refusal.value))
    falls = unstable(values)
    if falls.holds:
        raise InputError(falls.about(falls.value))

    x = model.term.intensity_m_s(values)
    y = max(toppling_velocity_m_s(values["p2"], values["kr"], SCALAR), formulas.LEAST_Y_M_S)
    probability = low = high = 0.0
    in_domain, warnings = True, []
    gate = not_lifted(model, values)
    if values[model.term.inputs[0]] == 0.0:
        warnings.append("no shaking: P = 0 by definition, not by the model")
        values = {**values, "intensity_m_s": x, "y_m_s": y}
    else:
        least = formulas.LEAST_Y_M_S
        p, shaking = math.sqrt(values["p2"]), max(x, least)
        pga = max(values.get("pga_g", NEUTRAL["pga_g"]), least)
        bound = formulas.bound(model.shape, y, p, shaking, pga)
        values = derived({**values, "pga_g": pga} if "pga_g" in values else dict(values))
        values = {**values, "intensity_m_s": x, "y_m_s": y}
        if gate is not None and gate.holds:
            warnings.append(gate.about(gate.value))
        elif bound != formulas.FREE:
            name, text = BOUNDS[bound]
            warnings.append(Finding(True, name, values[name], text).about(values[name]))
        else:
            probability, low, high = formulas.answer(
                model.shape,
                model.link,
                model.padded,
                model.packed_covariance,
                model.floor,
                half_width,
                y,
                p,
                shaking,
                pga,
                values.get("tm_s", NEUTRAL["tm_s"]),
            )
            outside = [f.about(f.value) for f in outside_domain(model, values) if f.holds]
            in_domain, warnings = not outside, outside
        warnings += [f.about(f.value) for f in doubts(model, values, SCALAR) if f.holds]
    return Prediction(
        probability=probability,
        ci_low=low,
        ci_high=high,
        level=level,
        model=model.name,
        term=model.term.name,
        method=model.row.method,
        y_m_s=y,
        intensity_m_s=x,
        in_domain=in_domain,
        warnings=(*model.notes, *warnings),
        pgv_over_pga_s=values.get("pgv_over_pga_s"),
    )
