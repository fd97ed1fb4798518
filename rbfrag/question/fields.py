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


class NumberFields(TypedDict, Generic[V], total=False):
    """Parameters of a block by kind of failure, which replace its geometry."""

    p2: V
    kr: V
    ky: V
    ks: V
    ps2: V
    kct: V
    pct2: V


class FailureFields(TypedDict, Generic[V], total=False):
    """Model inputs of a block in addition to its parameters or its geometry."""

    displacement_m: V
    restitution: V


class ShapeFields(TypedDict, Generic[V], total=False):
    """Dimensions and angles of a block."""

    height_m: V
    width_m: V
    alpha1_deg: V
    alpha3_deg: V
    r3_m: V
    s1_m: V
    s2_m: V
    gamma_deg: V


class PlaneFields(TypedDict, Generic[V], total=False):
    """Dips and friction angles of the planes under and behind a block."""

    beta_deg: V
    phi_deg: V
    phi_back_deg: V


class SpaceFields(TypedDict, total=False):
    """Planes of a block in space, as dip/dip direction."""

    base: str | None
    back: str | None
    face: str | None


class JointFields(TypedDict, Generic[V], total=False):
    """Joint properties of a block, and its residual friction after the first slip."""

    water_m: V
    jrc: V
    jcs_mpa: V
    joint_length_m: V
    phi_residual_deg: V


class ScatterFields(TypedDict, Generic[V], total=False):
    """Block uncertainty: standard deviations; the value is the median, and P the mean over the
    distribution.
    """

    p2_sigma: V
    kr_sigma: V
    ky_sigma: V
    ks_sigma: V
    ps2_sigma: V
    kct_sigma: V
    pct2_sigma: V
    restitution_sigma: V


class BlockFields(
    NumberFields[V],
    FailureFields[V],
    ShapeFields[V],
    PlaneFields[V],
    JointFields[V],
    ScatterFields[V],
    total=False,
):
    """Inputs of a block: parameters, or geometry and planes."""


class MeasureFields(TypedDict, Generic[V], total=False):
    """Intensity measures of one horizontal component."""

    pgv_m_s: V
    pga_g: V
    tm_s: V
    pgd_m: V
    sa03_g: V
    sa10_g: V
    sa30_g: V
    arias_m_s: V
    magnitude: V


class SceneFields(TypedDict, Generic[V], total=False):
    """Uncertainty of intensity measures, scenario and site."""

    pgv_sigma: V
    pga_sigma: V
    sa03_sigma: V
    sa10_sigma: V
    sa30_sigma: V
    pgv_tau: V
    rjb_km: V
    vs30_m_s: V
    amplification: V
    amplification_sigma: V


class ShakingFields(MeasureFields[V], SceneFields[V], total=False):
    """Inputs of the shaking."""


class SourceFields(TypedDict, total=False):
    """Mechanism and ground-motion model of a scenario earthquake."""

    mechanism: str | None
    gmm: str | PathLike[str] | None


class ComponentFields(TypedDict, total=False):
    """Definition of the horizontal component of the intensity measures."""

    component: str | Sequence[str | None] | None


class WholeFields(SpaceFields, total=False):
    """Inputs that hold for all blocks."""

    block: Block | None
    back_fracture: bool | None
    drainage: str | None
    cohesion_pa: float | None
    density_kg_m3: float | None
    kind: str | None


class AtRestFields(TypedDict, total=False):
    """Static inputs of a block without an earthquake."""

    kv: float | None


class AnsweringFields(TypedDict, total=False):
    """Model and confidence level."""

    model: Model | None
    level: float
    db: str | PathLike[str] | None


class RangeFields(AnsweringFields, total=False):
    """Model, confidence level and number of sites of the prediction interval."""

    sites: float | None


class RequestFields(RangeFields, SourceFields, ComponentFields, total=False):
    """Options of a prediction."""

    rotation_deg: float | None


class RecordFields(TypedDict, Generic[V], total=False):
    """Spectral accelerations and ground motions."""

    sa_g: Mapping[float, V] | None
    motion: MotionLike | None
    polarity: Polarity


class ArrayFields(TypedDict, total=False):
    """Options of arrays."""

    nan: Literal["propagate", "raise"]
    interval: bool
    weights: ArrayLike | None


class QuestionFields(
    BlockFields[V],
    WholeFields,
    ShakingFields[V],
    RecordFields[V],
    RequestFields,
    ArrayFields,
    total=False,
):
    """Keywords of :func:`rbfrag.predict`."""


class RowFields(TypedDict, total=False):
    """Columns of a table in addition to block and shaking."""

    block_id: str
    site_id: str
    kind: str
    mode: str
    lon: float
    lat: float
    x: float
    y: float
    z: float
    crs: str
    strike_length_m: float
    count: float
    weight: float
    loss: float
    loss_sigma: float


class BlockKeywords(BlockFields[V], WholeFields, total=False):
    """Inputs of blocks, as in :func:`rbfrag.predict`; of several blocks, each may have its kind."""

    kind: str | Sequence[str | None] | None  # type: ignore[misc]
