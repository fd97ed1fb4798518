"""What a motion does to the blocks of a rock mass that slide or slump."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.kind_arrays import KindAnswers, kind_answers
from rbfrag.fragility.kind_model import find_kind_model
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.solver.quantity import positive
from rbfrag.solver.stability.arrays import slumping_p2
from rbfrag.solver.stability.modes import SLIDE, SLUMP, STABLE, ModeName


def other_modes(
    made: Realisations,
    measures: Mapping[str, float],
    *,
    displacement_m: float,
    rotation_deg: float | None,
    level: float,
    db: str | PathLike[str] | None,
) -> Iterator[tuple[ModeName, str, NDArray[np.bool_], KindAnswers]]:
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
    pgv, pga = measures["pgv_m_s"], measures.get("pga_g")
    found = made.stability
    stable = made.is_block & (found.state_code == STABLE)
    k = found.yield_acceleration

    slides = stable & (found.mode_code == SLIDE) & (k > 0.0)
    if slides.any():
        phi, beta = np.radians(made.phi_deg[slides]), np.radians(made.beta_deg[slides])
        level_m = distance * np.cos(phi) / np.cos(phi - beta)
        model = find_kind_model("sliding", with_pga=pga is not None, db=db)
        block = {"ky": k[slides], "displacement_m": level_m}
        answers = kind_answers(model, block, pgv_m_s=pgv, pga_g=pga, level=level)
        yield "slide", model.name, slides, answers

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
        model = find_kind_model(
            "slumping", with_pga=pga is not None, rotation_deg=rotation_deg, db=db
        )
        block = {"ks": k[slumps], "ps2": p2[slumps]}
        answers = kind_answers(model, block, pgv_m_s=pgv, pga_g=pga, level=level)
        yield "slump", model.name, slumps, answers
