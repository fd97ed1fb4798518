"""What operations are asked: the parameters of a query, and a body, as pydantic models.

A parameter has the name of the command line's option without its dashes, and the same unit;
spectral accelerations are named as the columns of tables are.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictFloat

from rbfrag.errors import InputError
from rbfrag.fragility.measures import SPECTRAL

if TYPE_CHECKING:
    from rbfrag.solver.described import DescribedBlock

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Text = Annotated[str, Field(min_length=1, max_length=200)]

Column = StrictFloat | Annotated[list[StrictFloat | None], Field(min_length=1, fail_fast=True)]
"""A number that stands for every element, or a list of one an element, null where there is none."""


def _words(text: str) -> Any:
    return Field(description=text)


def _example(value: object) -> Any:
    return Field(examples=[value])


P2 = _words("Frequency parameter p² of the block [1/s²].")
KR = _words("Rocking acceleration coefficient k_r = tan(critical angle) [g].")
HEIGHT = _words("Height of a rectangle, perpendicular to its base [m], with width.")
WIDTH = _words("Width of a rectangle along its base [m], with height.")
DIP = _words("Dip of the base of a rectangle, out of the slope positive [deg]. Default: 0.")
ALPHA1 = _words("Angle of the heel [deg], with alpha3 and r3.")
ALPHA3 = _words("Angle of the toe [deg].")
R3 = _words("Distance from centroid to toe [m].")
S1 = _words("Spacing of the base fractures [m], with s2 and gamma.")
S2 = _words("Spacing of the back fractures [m].")
GAMMA = _words("Dip of the back plane less dip of the base [deg].")
BETA = _words("Dip of the base, out of the slope positive [deg].")
PHI = _words("Friction angle of the base [deg]; only a rectangle is taken to topple without.")
PHI_BACK = _words("Friction angle of the back plane [deg]. Default: phi.")
KIND = _words("How the block fails. Default: what it is given by.")
KY = _words("Sliding: yield acceleration coefficient tan(phi - beta).")
DISPLACEMENT = _words("Sliding: the displacement that is too far [m].")
KS = _words("Slumping: yield acceleration coefficient k_s.")
PS2 = _words("Slumping: frequency parameter p_s² at rest [1/s²].")
LEAVES = _words("Slumping: acceleration at which the block leaves its back plane [g].")
ROTATION = _words("Slumping: rotation that is too far [deg]. Default: failure past recovery.")
RESTITUTION = _words(
    "Rocking: speed after an impact over that before it, above 0 and up to 1. Default: what "
    "angular momentum leaves."
)
P2_SIGMA, KR_SIGMA, KY_SIGMA, KS_SIGMA, PS2_SIGMA, RESTITUTION_SIGMA = (
    _words(f"Standard deviation of {symbol} of what the block may be: P is the mean over it.")
    for symbol in ("ln p²", "ln k_r", "ln k_y", "ln k_s", "ln p_s²", "the restitution")
)
PGV = _words("Peak ground velocity [m/s].")
PGA = _words("Peak ground acceleration [g].")
TM = _words("Mean period [s].")
PGD = _words("Peak ground displacement [m].")
SA03, SA10, SA20, SA30 = (
    _words(f"Spectral acceleration at {period:g} s, 5 % damping [g].") for period in SPECTRAL
)
LEVEL = Field(
    gt=0.0, lt=1.0, description="Level of the interval of P, and of the range of one earthquake."
)
MODEL = _words(
    "Name of a stored model. Default: the database's default if the given measures suffice for "
    "it, else the best that they suffice for."
)

# keywords of rbfrag.predict and rbfrag.stability by the names of the parameters
MEASURES = {
    "pgv": "pgv_m_s", "pga": "pga_g", "tm": "tm_s", "pgd": "pgd_m",
    **{name: name for name in SPECTRAL.values()},
}  # fmt: skip
NUMBERS = {
    "p2": "p2", "kr": "kr", "ky": "ky", "ks": "ks", "ps2": "ps2", "leaves_g": "leaves_g",
}  # fmt: skip
SLIDING = {"displacement": "displacement_m", "beta": "beta_deg"}
UNCERTAIN = {
    name: name
    for name in (
        "p2_sigma", "kr_sigma", "ky_sigma", "ks_sigma", "ps2_sigma", "restitution",
        "restitution_sigma",
    )
}  # fmt: skip
PLANES = {
    "beta": "beta_deg", "phi": "phi_deg", "phi_back": "phi_back_deg", "cohesion": "cohesion_pa",
    "density": "density_kg_m3", "kv": "kv",
}  # fmt: skip

OF_ROWS = {
    "height": "height_m", "width": "width_m", "alpha1": "alpha1_deg", "alpha3": "alpha3_deg",
    "r3": "r3_m", "s1": "s1_m", "s2": "s2_m", "gamma": "gamma_deg", "phi": "phi_deg",
    "phi_back": "phi_back_deg",
}  # fmt: skip

_SHAPES = ("height", "width", "dip", "alpha1", "alpha3", "r3", "s1", "s2", "gamma")
SHAPES = dict(zip(_SHAPES, _SHAPES, strict=True))
OF_A_SHAPE = ("beta", "phi", "phi_back", "no_back")
WAYS = "height and width, or by alpha1, alpha3 and r3, or by s1, s2 and gamma"


class Parameters(BaseModel):
    """Named values; a name that is not known is refused."""

    model_config = ConfigDict(
        extra="forbid", allow_inf_nan=False, protected_namespaces=(), use_attribute_docstrings=True
    )

    def given(self, names: Mapping[str, str]) -> dict[str, Any]:
        """Return those of some parameters that were given, by their keywords."""
        values = self.__dict__
        return {
            keyword: value
            for name, keyword in names.items()
            if (value := values.get(name)) is not None
        }


class Shape(Parameters):
    """A block by its shape, and the planes that it stands on."""

    height: Annotated[Positive | None, HEIGHT] = None
    width: Annotated[Positive | None, WIDTH] = None
    dip: Annotated[float | None, DIP] = None
    alpha1: Annotated[float | None, ALPHA1] = None
    alpha3: Annotated[float | None, ALPHA3] = None
    r3: Annotated[Positive | None, R3] = None
    s1: Annotated[Positive | None, S1] = None
    s2: Annotated[Positive | None, S2] = None
    gamma: Annotated[float | None, GAMMA] = None
    beta: Annotated[float | None, BETA] = None
    phi: Annotated[float | None, PHI] = None
    phi_back: Annotated[float | None, PHI_BACK] = None
    no_back: bool = False
    """There is no fracture behind the block."""

    def described(self) -> DescribedBlock | None:
        """Return the block; None where nothing is said of its shape."""
        shape = self.given(SHAPES)
        if not shape:
            return None
        from rbfrag.solver.described import describe

        conditions = self.given(PLANES)
        if self.no_back:
            conditions["back_fracture"] = False
        return describe(shape, conditions)

    def block_fields(self) -> dict[str, Any]:
        """Return what is stated of the block, by keyword, numbers or a shape.

        Raises:
            InputError: a shape that is stated in part, or planes without one.
        """
        described, values = self.described(), self.given(NUMBERS)
        if described is not None:
            return {"block": described.block, **described.conditions, **values}
        # the dip of the base is also that of a block that slides
        base = self.given({"beta": "beta_deg"})
        for name in ("phi", "phi_back", "no_back") if "ky" in values else OF_A_SHAPE:
            if (value := getattr(self, name)) is not None and value is not False:
                raise InputError(f"{name} goes with the shape of a block, by {WAYS}")
        return values | base

    def toppling(
        self, *names: str, kind: str | None = None
    ) -> tuple[str | None, dict[str, Any], tuple[str, ...]]:
        """Return the kind, what answers about blocks that topple or rock read of one, and warnings.

        Args:
            names: what must be given.
            kind: how it fails; None for toppling, or rocking where nothing backs its shape.
        """
        described, values = self.described(), self.block_fields()
        if described is not None:
            if numbers := self.given(NUMBERS):
                raise InputError(
                    f"{next(iter(numbers))} does not go with a shape: give one of them"
                )
            from rbfrag.question.blocks import toppling_block

            blocks = toppling_block(described, {}, kind)
            (group,) = blocks.groups
            return group.kind, {**group.numbers}, blocks.remarks
        for name in names:
            if name not in values:
                raise InputError(
                    f"{name} is missing: a block is given by {' and '.join(names)}, or by {WAYS}"
                )
        return kind, values, ()


class _Weight(Parameters):
    cohesion: float | None = None
    """Cohesion of the base [Pa], with density."""
    density: float | None = None
    """Density of the rock [kg/m3]."""
    kv: float | None = None
    """Vertical acceleration of the ground, up positive [g]."""


class BlockQuery(_Weight, Shape):
    """Parameters of `/v1/block`."""

    s1: Annotated[Positive | None, S1, _example(1.0)] = None
    s2: Annotated[Positive | None, S2, _example(0.6)] = None
    gamma: Annotated[float | None, GAMMA, _example(25.0)] = None
    beta: Annotated[float | None, BETA, _example(20.0)] = None
    phi: Annotated[float | None, PHI, _example(40.0)] = None


class _Numbers(Parameters):
    p2: Annotated[Positive | None, P2, _example(3.0)] = None
    kr: Annotated[Positive | None, KR, _example(0.1)] = None


class TopplingBlock(Shape, _Numbers):
    """A block that topples: two numbers, or a shape."""


class DrawingQuery(_Weight, TopplingBlock):
    """Parameters of `/v1/drawing`."""


class Motion(Parameters):
    """What is known of a motion, and what answers."""

    pgv: Annotated[NotNegative | None, PGV, _example(0.6)] = None
    pga: Annotated[NotNegative | None, PGA] = None
    tm: Annotated[Positive | None, TM] = None
    pgd: Annotated[NotNegative | None, PGD] = None
    sa03_g: Annotated[NotNegative | None, SA03] = None
    sa10_g: Annotated[NotNegative | None, SA10] = None
    sa20_g: Annotated[NotNegative | None, SA20] = None
    sa30_g: Annotated[NotNegative | None, SA30] = None
    model: Annotated[Text | None, MODEL] = None


class AnyBlock(TopplingBlock):
    """A block that fails in any way: numbers, or a shape."""

    kind: Annotated[Text | None, KIND] = None
    ky: Annotated[Positive | None, KY] = None
    displacement: Annotated[Positive | None, DISPLACEMENT] = None
    ks: Annotated[Positive | None, KS] = None
    ps2: Annotated[Positive | None, PS2] = None
    restitution: Annotated[Positive | None, RESTITUTION] = None


class PredictQuery(Motion, AnyBlock):
    """Parameters of `GET /v1/predict`."""

    p2_sigma: Annotated[NotNegative | None, P2_SIGMA] = None
    kr_sigma: Annotated[NotNegative | None, KR_SIGMA] = None
    ky_sigma: Annotated[NotNegative | None, KY_SIGMA] = None
    ks_sigma: Annotated[NotNegative | None, KS_SIGMA] = None
    ps2_sigma: Annotated[NotNegative | None, PS2_SIGMA] = None
    restitution_sigma: Annotated[NotNegative | None, RESTITUTION_SIGMA] = None
    rotation: Annotated[float | None, ROTATION] = None
    level: Annotated[float, LEVEL] = 0.95


class PredictRows(Parameters):
    """Numbers, which stand for every element, and lists of one length."""

    p2: Annotated[Column | None, P2] = None
    kr: Annotated[Column | None, KR] = None
    height: Annotated[Column | None, HEIGHT] = None
    width: Annotated[Column | None, WIDTH] = None
    dip: Annotated[Column | None, DIP] = None
    alpha1: Annotated[Column | None, ALPHA1] = None
    alpha3: Annotated[Column | None, ALPHA3] = None
    r3: Annotated[Column | None, R3] = None
    s1: Annotated[Column | None, S1] = None
    s2: Annotated[Column | None, S2] = None
    gamma: Annotated[Column | None, GAMMA] = None
    phi: Annotated[Column | None, PHI] = None
    phi_back: Annotated[Column | None, PHI_BACK] = None
    no_back: bool = False
    """There is no fracture behind the blocks."""
    ky: Annotated[Column | None, KY] = None
    displacement: Annotated[Column | None, DISPLACEMENT] = None
    beta: Annotated[Column | None, BETA] = None
    ks: Annotated[Column | None, KS] = None
    ps2: Annotated[Column | None, PS2] = None
    leaves_g: Annotated[Column | None, LEAVES] = None
    restitution: Annotated[Column | None, RESTITUTION] = None
    p2_sigma: Annotated[Column | None, P2_SIGMA] = None
    kr_sigma: Annotated[Column | None, KR_SIGMA] = None
    ky_sigma: Annotated[Column | None, KY_SIGMA] = None
    ks_sigma: Annotated[Column | None, KS_SIGMA] = None
    ps2_sigma: Annotated[Column | None, PS2_SIGMA] = None
    restitution_sigma: Annotated[Column | None, RESTITUTION_SIGMA] = None
    pgv: Annotated[Column | None, PGV] = None
    pga: Annotated[Column | None, PGA] = None
    tm: Annotated[Column | None, TM] = None
    pgd: Annotated[Column | None, PGD] = None
    sa03_g: Annotated[Column | None, SA03] = None
    sa10_g: Annotated[Column | None, SA10] = None
    sa20_g: Annotated[Column | None, SA20] = None
    sa30_g: Annotated[Column | None, SA30] = None
    kind: Annotated[Text | None, KIND] = None
    rotation: Annotated[StrictFloat | None, ROTATION] = None
    model: Annotated[Text | None, MODEL] = None
    level: Annotated[StrictFloat, LEVEL] = 0.95

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"p2": 3.0, "kr": [0.1, 0.2, 0.3], "pgv": [0.6, 0.6, 1.2]}]}
    )


class Reading(Parameters):
    """How an accelerogram is read that does not say it itself."""

    trace: Annotated[int, Field(ge=0)] | None = None
    """Number of the trace in the file, from 0; where there are several."""
    units: Literal["g", "m/s2", "cm/s2", "mm/s2"] | None = None
    """Unit of acceleration of a text file that does not state it."""
    dt: Positive | None = None
    """Sampling interval [s] of a text file that holds accelerations only."""


MOST_SIZES = 100
"""Most values of p² in one request for a spectrum."""

_NUMBER = r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?"


class SpectrumQuery(Reading):
    """Parameters of `/v1/spectrum`."""

    p2: Annotated[str, Field(pattern=f"^{_NUMBER}(,{_NUMBER})*$")] = "30,10,3,1,0.3,0.1"
    """Frequency parameters p² [1/s²], separated by commas."""
    polarity: Literal["forward", "reverse", "both"] = "forward"
    """forward: positive samples drive forward; reverse: negative ones; both."""

    def sizes(self) -> list[float]:
        """Return the values of p² [1/s²]."""
        sizes = [float(each) for each in self.p2.split(",")]
        if len(sizes) > MOST_SIZES:
            raise InputError(f"p2 has {len(sizes)} values; one request may ask for {MOST_SIZES}")
        return sizes


class CriticalQuery(Reading, Shape):
    """Parameters of `/v1/critical`."""

    p2: Annotated[Positive | None, P2, _example(3.0)] = None
    reverse: bool = False
    """Positive samples drive backward: k_h(t) = -a(t)."""
    map: bool = False
    """Map the toppling and safe intervals of k_r/PGA down to 0.01, borders to 1e-4."""


class RockmassQuery(Motion):
    """Parameters of `/v1/rockmass`."""

    pgv: Annotated[NotNegative | None, PGV] = None
    n: Annotated[int, Field(ge=1)] | None = None
    """Number of realisations. Default: that of the body, else 20000."""
    seed: Annotated[int, Field(ge=0)] | None = None
    """Seed of the random numbers. Default: that of the body, else 1."""
    level: Annotated[float | None, LEVEL] = None


class HazardQuery(AnyBlock):
    """Parameters of `/v1/hazard`."""

    years: Positive = 50.0
    """Period of the probability [years]."""
    imt: Text | None = None
    """Intensity measure of the curve: PGV, PGA, SA(1.0)."""
    site: Text | None = None
    """Site of the file: its number from 1 on, or its name."""
    convert: Text | None = None
    """Published conversion of a spectral acceleration to PGV: newmark_hall_1982 (SA(1)) or
    bommer_alarcon_2006 (SA(0.5)); its scatter is integrated."""
    convert_sigma: Positive | None = None
    """Standard deviation of ln PGV about the conversion. Default: that of the reference's
    motions."""
    component: Text | None = None
    """What the curve's horizontal component means: single, geometric_mean, rotd50 or larger."""
    model: Annotated[Text | None, MODEL] = None
    level: Annotated[float, LEVEL] = 0.95
