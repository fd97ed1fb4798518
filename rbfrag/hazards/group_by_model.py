"""Blocks grouped by the model that predicts their failure under hazard curves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, UnknownModelError
from rbfrag.fragility.model import FragilityModel
from rbfrag.hazards.curve import CurveKeywords
from rbfrag.hazards.shaking import HazardLevel
from rbfrag.question.fields import AnsweringFields, BlockKeywords, V
from rbfrag.question.keywords import model_for
from rbfrag.question.predict_arrays import block_reasons_of, blocks_of_arrays
from rbfrag.solver.results import FloatArray


class RateKeywords(BlockKeywords[V], CurveKeywords, AnsweringFields, total=False):
    """Keywords of blocks, hazard curves and models for annual rates."""


class ModelPart(NamedTuple):
    """Blocks of one model.

    Args:
        indices: where they stand among all, shape (m,).
        numbers: what the model reads of them, by field, shape (m,) each.
    """

    indices: NDArray[np.intp]
    numbers: Mapping[str, FloatArray]
    model: FragilityModel


def parts_by_model(
    inputs: Mapping[str, Any], shaking: HazardLevel, answering: AnsweringFields
) -> tuple[list[ModelPart], tuple[str, ...], NDArray[np.object_]]:
    """Return the blocks grouped by model.

    Returns:
        The parts, warnings about the blocks, and of each why it cannot be used, empty for
        those that can.

    Raises:
        InputError: blocks that are described twice or in part, or are of one kind without a model.
        UnknownModelError: no model of that name, or of the one kind that there is.
    """
    blocks, size = blocks_of_arrays(inputs)
    reason = block_reasons_of(blocks, size)
    parts = []
    for group in blocks.groups:
        indices = np.arange(size) if group.indices is None else group.indices
        try:
            chosen = model_for(answering, (*group.numbers, shaking.name), group.kind)
        except (InputError, UnknownModelError) as error:
            if len(blocks.groups) == 1:
                raise
            reason[indices] = np.where(reason[indices] == "", str(error), reason[indices])
            continue
        accepted = np.flatnonzero(reason[indices] == "")
        if accepted.size:
            values = {
                n: np.broadcast_to(v, indices.shape)[accepted] for n, v in group.numbers.items()
            }
            _reject_unknown_magnitudes(values[chosen.method.block.strength], shaking)
            parts.append(ModelPart(indices[accepted], values, chosen))
    return parts, blocks.remarks, reason


def _reject_unknown_magnitudes(strength: FloatArray, shaking: HazardLevel) -> None:
    """Reject blocks that may fail at a PGA below the range of the disaggregation."""
    start, weakest = shaking.magnitudes_from_g, float(strength.min())
    if start is not None and start > weakest:
        raise InputError(
            f"Disaggregation levels must start at or below k_r: they, or those of the curve, start "
            f"at {start:.3g} g, and a block fails from {weakest:.3g} g on: disaggregate at higher "
            "probabilities, too (poes_disagg)",
            fields=("disaggregation",),
        )
