"""Types of the inputs for type checkers; :mod:`rbfrag.vocabulary` has their meaning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Generic, Literal, TypedDict, TypeVar

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import ArrayLike

    from rbfrag.fragility.model import Model
    from rbfrag.fragility.prediction_motion import Polarity
    from rbfrag.motions.readers import MotionLike
    from rbfrag.solver.block.geometry import Block

V = TypeVar("V")
"""A number, or an array of numbers."""


class BlockFields(TypedDict, Generic[V], total=False):
    """Inputs of a block: parameters, or geometry and planes."""

    # parameters by kind of failure, which replace the geometry
    p2: V
    kr: V
    ky: V
    ks: V
    ps2: V
    kct: V
    pct2: V

    # model inputs in addition to parameters or geometry
    displacement_m: V
    restitution: V

    # dimensions and angles
    height_m: V
    width_m: V
    alpha1_deg: V
    alpha3_deg: V
    r3_m: V
    s1_m: V
    s2_m: V
    gamma_deg: V

    # dips and friction angles of the planes
    beta_deg: V
    phi_deg: V
    phi_back_deg: V

    # joint properties, and the residual friction after the first slip
    water_m: V
    jrc: V
    jcs_mpa: V
    joint_length_m: V
    phi_residual_deg: V

    # block uncertainty: the values are medians, and P is the mean over the distribution
    p2_sigma: V
    kr_sigma: V
    ky_sigma: V
    ks_sigma: V
    ps2_sigma: V
    kct_sigma: V
    pct2_sigma: V
    restitution_sigma: V


class MeasureFields(TypedDict, Generic[V], total=False):
    """Intensity measures of one horizontal component."""

    pgv_m_s: V
    pga_g: V
    tm_s: V
    pgd_m: V
    sa_g: Mapping[float, V] | None
    arias_m_s: V
    magnitude: V


class ShakingFields(MeasureFields[V], total=False):
    """Intensity measures, their uncertainty, scenario and site."""

    pgv_sigma: V
    pga_sigma: V
    sa_sigma: Mapping[float, V] | None
    pgv_tau: V
    rjb_km: V
    vs30_m_s: V
    amplification: V
    amplification_sigma: V


class SourceFields(TypedDict, total=False):
    """Mechanism and ground-motion model of a scenario earthquake."""

    mechanism: str | None
    gmm: str | PathLike[str] | None


class WholeFields(TypedDict, total=False):
    """Inputs that hold for all blocks."""

    # planes in space, as dip/dip direction
    base: str | None
    back: str | None
    face: str | None

    block: Block | None
    back_fracture: bool | None
    drainage: str | None
    cohesion_pa: float | None
    density_kg_m3: float | None
    kind: str | None


class AnsweringFields(TypedDict, total=False):
    """Model and confidence level."""

    model: Model | None
    level: float
    db: str | PathLike[str] | None


class RangeFields(AnsweringFields, total=False):
    """Model, confidence level and number of sites of the prediction interval."""

    sites: float | None


class QuestionFields(
    BlockFields[V], WholeFields, ShakingFields[V], RangeFields, SourceFields, total=False
):
    """Keywords of :func:`rbfrag.predict`."""

    # standard deviations of measured fields; lengths also in per cent, as a text ("5%")
    height_sigma_m: V | str
    width_sigma_m: V | str
    alpha1_sigma_deg: V
    alpha3_sigma_deg: V
    r3_sigma_m: V | str
    s1_sigma_m: V | str
    s2_sigma_m: V | str
    gamma_sigma_deg: V
    beta_sigma_deg: V
    phi_sigma_deg: V
    phi_back_sigma_deg: V
    base_sigma_deg: V
    back_sigma_deg: V
    water_sigma_m: V | str
    cohesion_sigma_pa: V | str
    density_sigma_kg_m3: V | str
    gmm_sigma: V

    # ground motions
    motion: MotionLike | None
    polarity: Polarity

    # the request
    component: str | Sequence[str | None] | None
    rotation_deg: float | None
    target_probability: float | None
    solve_for: str | None

    # options of arrays
    nan: Literal["propagate", "raise"]
    interval: bool
    sensitivity: bool
    weights: ArrayLike | None


class BlockKeywords(BlockFields[V], WholeFields, total=False):
    """Inputs of blocks, as in :func:`rbfrag.predict`; of several blocks, each may have its kind."""

    kind: str | Sequence[str | None] | None  # type: ignore[misc]
