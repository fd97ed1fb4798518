"""Types of the inputs for type checkers; what they mean stands in :mod:`rbfrag.vocabulary`."""

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
    """What says of a block all that a model of its kind reads of its shape."""

    p2: V
    kr: V
    ky: V
    ks: V
    ps2: V
    kct: V
    pct2: V


class FailureFields(TypedDict, Generic[V], total=False):
    """What a model reads of a block beside its numbers or its shape."""

    displacement_m: V
    restitution: V


class ShapeFields(TypedDict, Generic[V], total=False):
    """What describes the shape of a block."""

    height_m: V
    width_m: V
    alpha1_deg: V
    alpha3_deg: V
    r3_m: V
    s1_m: V
    s2_m: V
    gamma_deg: V


class PlaneFields(TypedDict, Generic[V], total=False):
    """What describes the planes of a block."""

    beta_deg: V
    phi_deg: V
    phi_back_deg: V


class SpaceFields(TypedDict, total=False):
    """What describes the planes of a block in space, as dip/dip direction."""

    base: str | None
    back: str | None
    face: str | None


class JointFields(TypedDict, Generic[V], total=False):
    """What ends with the first slip of a block, and what is left then."""

    water_m: V
    jrc: V
    jcs_mpa: V
    joint_length_m: V
    phi_residual_deg: V


class ScatterFields(TypedDict, Generic[V], total=False):
    """How well a block is known: what is stated is the median, and P the mean over it."""

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
    """What may be said of a block: numbers, or its sides and planes."""


class MeasureFields(TypedDict, Generic[V], total=False):
    """Measures of one horizontal component."""

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
    """How well measures are known, and what stands for them: the scenario and the site."""

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
    """What may be said of the shaking."""


class SourceFields(TypedDict, total=False):
    """What is said of the earthquake of a scenario beside numbers."""

    mechanism: str | None
    gmm: str | PathLike[str] | None


class ComponentFields(TypedDict, total=False):
    """Definition of the horizontal component that the measures are of."""

    component: str | Sequence[str | None] | None


class WholeFields(SpaceFields, total=False):
    """What holds for all blocks of a question."""

    block: Block | None
    back_fracture: bool | None
    drainage: str | None
    cohesion_pa: float | None
    density_kg_m3: float | None
    kind: str | None


class AtRestFields(TypedDict, total=False):
    """What may be said of the ground under a block that no earthquake shakes."""

    kv: float | None


class AnsweringFields(TypedDict, total=False):
    """Which model answers, and how wide its interval is."""

    model: Model | None
    level: float
    db: str | PathLike[str] | None


class RangeFields(AnsweringFields, total=False):
    """Which model answers, and what the range of one earthquake is of."""

    sites: float | None


class RequestFields(RangeFields, SourceFields, ComponentFields, total=False):
    """What is asked of blocks and their shaking."""

    rotation_deg: float | None


class RecordFields(TypedDict, Generic[V], total=False):
    """What else may be said of the shaking."""

    sa_g: Mapping[float, V] | None
    motion: MotionLike | None
    polarity: Polarity


class ArrayFields(TypedDict, total=False):
    """What is asked of arrays."""

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
    """What :func:`rbfrag.predict` may be asked."""


class RowFields(TypedDict, total=False):
    """What a row of a table says beside its block and its shaking."""

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
    """What the blocks are, as :func:`rbfrag.predict` has it; of many, each may state its kind."""

    kind: str | Sequence[str | None] | None  # type: ignore[misc]
