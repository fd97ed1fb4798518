"""What a motion does to the blocks of a rock mass that slide or slump."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.predict import predict
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.solver.quantity import positive
from rbfrag.solver.stability.modes import SLIDE, SLUMP, STABLE, ModeName
from rbfrag.solver.stability.slumping_frequency import slumping_p2


def other_modes(
    made: Realisations,
    measures: Mapping[str, float],
    *,
    displacement_m: float,
    rotation_deg: float | None,
    level: float,
    db: str | PathLike[str] | None,
) -> Iterator[tuple[ModeName, str, NDArray[np.bool_], PredictionArray]]:
    """Yield, for sliding and for slumping, the model, which blocks it answers for, and how.

    Args:
        made: blocks of a rock mass.
        measures: what is known of the motion; PGV, better with PGA.
        displacement_m: how far is too far for a block that slides, down its base [m].
        rotation_deg: rotation that is failure of a block that slumps [deg]; None past recovery.
        level: confidence level of the intervals.
        db: database of the models.

    Raises:
        InputError: PGV is not known, or the displacement is not above zero.
        UnknownModelError: there is no model of a mode that has blocks.
    """
    distance = positive(displacement_m, "displacement_m", "m")
    if "pgv_m_s" not in measures:
        raise InputError("models of sliding and slumping read PGV: give pgv_m_s (--pgv) too")
    motion: dict[str, Any] = {
        name: measures[name] for name in ("pgv_m_s", "pga_g") if name in measures
    }
    found = made.stability
    stable = made.is_block & (found.state_code == STABLE)
    k = found.yield_acceleration

    slides = stable & (found.mode_code == SLIDE) & (k > 0.0)
    if slides.any():
        block = {"ky": k[slides], "beta_deg": made.beta_deg[slides]}
        answers = predict(**block, displacement_m=distance, **motion, level=level, db=db)
        assert isinstance(answers, PredictionArray)
        yield "slide", answers.model, slides, answers

    p2 = slumping_p2(
        alpha1_deg=made.blocks.alpha1_deg,
        alpha3_deg=made.blocks.alpha3_deg,
        gamma_deg=made.gamma_deg,
        r1_m=made.blocks.r1_m,
        r3_m=made.blocks.r3_m,
        beta_deg=made.beta_deg,
        phi_deg=made.phi_deg,
        phi_back_deg=made.phi_back_deg,
    )
    slumps = stable & (found.mode_code == SLUMP) & (k > 0.0) & np.isfinite(p2)
    if slumps.any():
        answers = predict(
            ks=k[slumps], ps2=p2[slumps], rotation_deg=rotation_deg, **motion, level=level, db=db
        )
        assert isinstance(answers, PredictionArray)
        yield "slump", answers.model, slumps, answers
