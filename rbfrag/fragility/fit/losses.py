"""Loss of a model with a completed spectral velocity on earthquakes held out, by the measures.

Each earthquake is left out of the coefficients of the model, of the regression and of its scatter
at once, by the steps that are stored with both.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from rbfrag.errors import ModelError
from rbfrag.fragility.completion import key_of
from rbfrag.fragility.fit.completions import MotionTable, stored_inputs
from rbfrag.fragility.fit.data import FitData
from rbfrag.fragility.fit.result import log_loss
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import arrays
from rbfrag.fragility.model import FragilityModel
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S, spectral_name


def held_out_probabilities(
    model: FragilityModel, data: FitData, spectra: FloatArray, names: Sequence[str]
) -> FloatArray:
    """Return P of the blocks of a fit from some measures, each earthquake predicted by the model
    and the regression without it, shape (n, m); NaN where a measure is unknown.

    Args:
        model: the fitted model.
        data: what it was fitted to, with the measures that are used.
        spectra: ordinates of the motion of each row [g], shape (n, 21).
        names: the measures.
    """
    completed = model.for_inputs(names)
    used = completed.term.inputs
    motions = MotionTable(
        {**{name: column[:, 0] for name, column in data.blocks.items() if column.shape[1] == 1},
         **dict(zip(map(spectral_name, SPECTRUM_PERIODS_S), spectra.T, strict=True))},
        data.event, data.motion, data.events,
    )  # fmt: skip
    columns = {name: motions.measure(name)[:, None] for name in used}
    read = {*model.method.block.names, *model.method.block.options, "p", *used}
    blocks = {name: value for name, value in data.blocks.items() if name in read} | columns
    result = np.zeros(data.failed.shape)
    fitted_events = cast("list[str]", model.row.diagnostics["fitted_events"])
    place = {name: i for i, name in enumerate(fitted_events)}
    ns, errors = arrays(), completed.errors
    with np.errstate(all="ignore"):
        for number, name in enumerate(data.event_names):
            rows = np.flatnonzero(data.event == number)
            values = {name: value[rows] for name, value in blocks.items()}
            without = completed
            if (e := place.get(name)) is not None:
                without = completed.moved(errors.all_steps[e])
            values = without.completed(values, ns)
            predictor, factor = without.linear_predictor(values, ns)
            p = model.method.link.probability(predictor.eta * factor, ns)
            for bound in model.form.bounds:
                p = np.where(bound.holds(values), 0.0, p)
            result[rows] = p
    return result


def losses_by_inputs(
    model: FragilityModel, data: FitData, spectra: FloatArray
) -> dict[str, dict[str, float]]:
    """Return the log losses on earthquakes held out by the measures that an answer may be given.

    Arguments as for :func:`held_out_probabilities`.
    """
    assert model.form.velocity is not None
    term = TERMS[model.row.term]
    spectrum = (*term.inputs, *map(spectral_name, SPECTRUM_PERIODS_S))
    result = {}
    for used in (*stored_inputs(term, model.form.velocity), spectrum):
        try:
            p = held_out_probabilities(model, data, spectra, used)
        except ModelError:  # of few motions T_m or the magnitude is known
            continue
        losses = {}
        for name, judged in (("log_loss", data.judged), ("log_loss_kr05", data.judged_real)):
            assert judged is not None
            losses[name] = log_loss(p, judged.failed, judged.is_known & np.isfinite(p))
        result[key_of(used)] = losses
    return result
