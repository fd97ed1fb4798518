"""The answers as OpenAPI describes them; the packages below write them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field


class _Document(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, protected_namespaces=())


Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
"""Two numbers that belong together."""


class Problem(_Document):
    """Problem details (RFC 9457); `traces` are those of a file of which one is to be named."""

    type: str
    title: str
    status: int
    detail: str
    traces: list[str] | None = None


class _Fitted(_Document):
    model: str
    term: str
    method: str


class ModelAnswer(_Fitted):
    """The answer of one model that the measures suffice for."""

    probability: float
    ci_low: float
    ci_high: float
    event_low: float | None
    event_high: float | None
    in_domain: bool
    recommended: bool


class PredictAnswer(_Document):
    """Probability that one block fails: what `rbfrag predict --json` prints, in its order.

    `probability` is the share of such blocks that fail over all earthquakes and sites with these
    measures, `ci_low` and `ci_high` the interval of that share as far as the data tell it,
    `event_low` and `event_high` between which shares fail in one single earthquake; null where that
    is not known. `block_sd` is the standard deviation of P over what an uncertain block may be;
    null where it is certain.
    """

    kind: str
    mode: str
    probability: float
    ci_low: float
    ci_high: float
    event_low: float | None
    event_high: float | None
    level: float
    model: str
    term: str
    method: str
    failure: str
    y_m_s: float | None
    intensity_m_s: float
    in_domain: bool
    warnings: list[str]
    pgv_over_pga_s: float | None
    median_displacement_m: float | None
    unknown_share: float | None
    block_sd: float | None
    data: str | None
    answers: list[ModelAnswer]


class PredictArrays(_Fitted):
    """Probabilities of many blocks or motions; null where the input cannot be used."""

    probability: list[float | None]
    ci_low: list[float | None]
    ci_high: list[float | None]
    event_low: list[float | None]
    event_high: list[float | None]
    block_sd: list[float | None] | None
    in_domain: list[bool]
    reason: list[str]
    kind: str
    kinds: list[str]
    modes: list[str]
    level: float
    data: str | None
    warnings: list[str]


class Margin(_Document):
    """By how much an angle may change before another mode governs."""

    variable: str
    change_deg: float
    mode: str


class Cohesion(_Document):
    """What cohesion of the base adds."""

    ratio: float
    ky: float | None
    phi_equivalent_deg: float | None
    ky_equivalent: float | None


class BlockAnswer(_Document):
    """How a block fails: what `rbfrag block --json` prints; null where it does not apply."""

    mode: str
    state: str
    p2: float
    kr: float | None
    ky: float | None
    ks: float | None
    kct: float | None
    yield_acceleration: float | None
    alpha1_deg: float | None
    alpha3_deg: float | None
    gamma_deg: float | None
    r1_m: float | None
    r2_m: float | None
    r3_m: float | None
    s1_m: float | None
    s2_m: float | None
    area_m2: float
    shape_factor: float
    delta_deg: float | None
    margins: list[Margin]
    cohesion: Cohesion | None
    warnings: list[str]


class DrawingAnswer(_Document):
    """A block to scale; points are (out of the slope, up) from the centroid [m].

    `kind` is how it fails, `numbers` what predictions of that kind read of it, null where no
    earthquake decides about it or no model answers. A rectangle whose friction is not known is
    taken to be rough: its `ky` means nothing.
    """

    kind: str
    numbers: dict[str, float] | None
    block: BlockAnswer
    rectangle_r3_m: float
    outline_m: list[Pair]
    contacts_m: dict[str, Pair]
    planes_m: list[Pair]
    rock_m: list[Pair]
    resultant_m: Pair


class ModelListed(_Document):
    """A stored model: what `rbfrag models list --json` prints.

    `log_loss` is that of outcomes of earthquakes left out, the smaller the better among models of a
    kind; `sensitive_share` is the share of the simulated outcomes behind it that a change of the
    motion by a millionth changes; null of kinds of which that is not asked.
    """

    name: str
    kind: str
    term: str
    method: str
    is_default: bool
    n: int | None
    log_loss: float | None
    events: int | None
    sensitive_share: float | None
    domain: dict[str, Pair]
    created: str


class Health(_Document):
    """The service answers."""

    status: str
    version: str


class SpectrumAnswer(_Document):
    """The toppling spectrum of a motion in one polarity: what `rbfrag spectrum --json` prints."""

    motion: str
    name: str
    polarity: str
    pgv_m_s: float
    p2: list[float]
    x_m_s: list[float]
    warnings: list[str]


class MapRow(_Document):
    """An interval of k_r/PGA with one outcome."""

    k_lo: float
    k_hi: float
    outcome: str


class CriticalAnswer(_Document):
    """The largest k_r/PGA that topples: what `rbfrag critical --json` prints."""

    kr_over_pga: float | None
    lower: float | None
    upper: float | None
    kr: float | None
    y_m_s: float | None
    status: str
    search_limit: float
    certified: bool
    k_up_over_pga: float | None
    undecided: float | None
    island_width: float | None
    kr_over_pga_resolved: float | None
    reentrant: bool | None
    n_runs: int
    p2: float
    polarity: str
    pga_g: float
    warnings: list[str]
    map: list[MapRow] | None = None


class RockmassAnswer(_Document):
    """Blocks by mode: what `rbfrag rockmass --json` prints."""

    realisations: int
    blocks: int
    seed: int
    impossible: dict[str, int]
    variables: dict[str, str]
    back_fracture: bool
    modes: dict[str, dict[str, Any]]
    crossings: list[dict[str, Any]]
    scenario: dict[str, Any] | None
    shaking: dict[str, Any] | None
    warnings: list[str]


class Contribution(_Document):
    """The part of a rate that comes from an interval of the shaking [1/a]."""

    from_: float = Field(alias="from")
    to: float
    annual_rate: float


class SiteRate(_Document):
    """The rate at one of several sites."""

    site: str | None
    block_id: str | None
    annual_rate: float
    ci_low: float
    ci_high: float
    numerical_error: float
    probability: float


class HazardAnswer(_Fitted):
    """Annual rates of toppling [1/a]: what `rbfrag hazard --json` prints."""

    years: float
    level: float
    imt: str
    curve_kind: str | None
    warnings: list[str]
    site: str | None = None
    annual_rate: float | None = None
    ci_low: float | None = None
    ci_high: float | None = None
    numerical_error: float | None = None
    probability: float | None = None
    contributions: list[Contribution] | None = None
    answers: list[SiteRate] | None = None
