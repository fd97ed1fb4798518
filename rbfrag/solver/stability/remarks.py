"""What people should know about the answer of `stability`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.modes import AT_LIMIT, ModeName, StateName


@dataclass(frozen=True)
class Finding:
    """What the warnings are about; the fields are those of the answer.

    Args:
        mode: failure mode.
        state: state.
        k: yield acceleration of the mode.
        ky: yield acceleration of sliding.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg].
        back_fracture: whether there is a back plane.
        backward: whether the block turns back about its heel for want of a back plane.
        untenable: whether the back contact cannot hold the block.
        lifts: whether the bond of the base would have to bear tension at the yield.
    """

    mode: ModeName
    state: StateName
    k: float
    ky: float
    beta_deg: float
    phi_deg: float
    phi_back_deg: float
    back_fracture: bool
    backward: bool
    untenable: bool
    lifts: bool


def warnings_about(block: Block, found: Finding) -> tuple[str, ...]:
    """Return one sentence for everything that the answer takes for granted."""
    return tuple(_sentences(block, found))


def _sentences(block: Block, found: Finding) -> Iterator[str]:
    if abs(found.k) <= AT_LIMIT:
        yield "the block is stable at its limit: its yield acceleration is zero to rounding"
    if found.backward:
        yield (
            f"nothing supports the block from behind and its weight passes upslope of the heel "
            f"(beta = {found.beta_deg:.6g} is below alpha1 = {block.alpha1_deg:.6g} degrees): it "
            "turns back about the heel at rest"
        )
    elif found.untenable:
        yield "the reaction at the back contact cannot hold the block, which turns back at rest"
    elif found.state == "unstable":
        yield "the block fails at rest: its yield acceleration is negative"
    if found.state == "locked":
        yield "the block is wedged: no horizontal acceleration moves it in this mode"
    if found.lifts:
        yield (
            "the bond of the base is so strong that the toe lifts off before it slides: the "
            "acceleration given is an upper bound"
        )
    if found.back_fracture:
        yield from _about_back_plane(block, found)


def _about_back_plane(block: Block, found: Finding) -> Iterator[str]:
    corner = block.gamma_deg + found.phi_deg + found.phi_back_deg
    if found.mode in ("slide", "confined_topple") and corner > 180.0:
        yield (
            f"gamma + phi + phi_back = {corner:.6g} degrees exceeds 180: a heel wedged between the "
            "planes could hold the block at any acceleration; the answer takes the back plane to "
            "be free of pre-stress"
        )
    if found.mode == "topple" and block.gamma_deg + found.phi_back_deg > 90.0:
        yield (
            "friction on the back plane could hold the heel back above k_r; the answer takes the "
            "back plane to be free of pre-stress"
        )
    if found.mode == "slide" and found.beta_deg < block.alpha1_deg:
        yield (
            "at rest the block leans on the back plane (beta is below alpha1): after sliding it "
            "falls back, its angles grow, and it may become a slump"
        )
    if found.mode in ("slide", "slump") and found.phi_back_deg > found.phi_deg + block.gamma_deg:
        yield (
            f"phi_back = {found.phi_back_deg:.6g} degrees exceeds phi + gamma: friction on a back "
            "plane so much rougher than the base could hold the block beyond this acceleration"
        )
    dip = math.fmod(block.gamma_deg + found.beta_deg, 180.0)
    steepness = min(abs(dip), 180.0 - abs(dip))
    if steepness < abs(found.beta_deg):
        yield (
            f"the back plane dips {steepness:.6g} degrees, less than the base: the base must be "
            "the set nearer to horizontal"
        )
