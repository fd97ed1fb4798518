"""What may be said of a block and of its shaking, and what is asked: every field once.

A field is a key of one of the classes; its annotation says what else there is to know of it.
Options of the shell, columns of tables, parameters of requests, keywords and their documentation
are made from these declarations. No physics here, and no library is loaded.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from textwrap import wrap
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Generic,
    Literal,
    TypedDict,
    TypeVar,
    get_type_hints,
)

from rbfrag.errors import InputError

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import ArrayLike

    from rbfrag.fragility.model import Model
    from rbfrag.fragility.prediction_motion import Polarity
    from rbfrag.motions.recognise import MotionLike
    from rbfrag.solver.block.geometry import Block

V = TypeVar("V")
"""A number, or an array of numbers."""


@dataclass(frozen=True)
class Field:
    """One thing that may be said.

    Args:
        help: what it is, as a sentence; fields in braces stand for their names at each door.
        unit: its unit; empty for a pure number or a text.
        others: what else its column may be called, in small letters and without a unit.
        column: its column in tables that are written; empty for its own name.
        word: what people call it; empty for its name without the unit.
        is_text: whether it is a text.
        is_flag: whether it is a truth value that is true unless something is said.
        above: what it is above; None for no such limit.
        least: the least that it may be.
        below: what it is below.
        most: the most that it may be.
    """

    help: str
    unit: str = ""
    others: tuple[str, ...] = ()
    column: str = ""
    word: str = ""
    is_text: bool = False
    is_flag: bool = False
    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None

    def usable(self, value: Any) -> Any:
        """Return whether a number, or which of many, may be used; NaN may not."""
        fine = value == value
        for limit, holds in (
            (self.above, operator.gt),
            (self.least, operator.ge),
            (self.below, operator.lt),
            (self.most, operator.le),
        ):
            if limit is not None:
                fine = fine & holds(value, limit)
        return fine

    @property
    def wanted(self) -> str:
        """The range in words."""
        above, least, below, most = (
            None if each is None else f"{each:g}"
            for each in (self.above, self.least, self.below, self.most)
        )
        if above is not None and below is not None:
            return f"between {above} and {below}"
        low = (
            f"above {above}" if above is not None else f"from {least}" if least is not None else ""
        )
        high = (
            f"up to {most}" if most is not None else f"below {below}" if below is not None else ""
        )
        if low and high:
            return (
                f"{low} and {high}"
                if above is not None
                else f"{low} to {high.removeprefix('up to ')}"
            )
        return (f"at least {least}" if least is not None else low) or high

    @property
    def what(self) -> str:
        """What it is, in a few words that go on a sentence: "dip of the base"."""
        text = re.split("[,;(]", self.help)[0].rpartition(": ")[2].strip()
        return f"{text[:1].lower()}{text[1:]}".removeprefix("the ")

    def sentence(self, spell: Callable[[str], str]) -> str:
        """Return what it is, with its unit and other fields as a door spells them."""
        text = self.help.format_map(_Spelled(spell))
        return f"{text} [{self.unit}]." if self.unit else f"{text}."


class _Spelled(dict[str, str]):
    """Fields as a door spells them, made when they are asked for."""

    def __init__(self, spell: Callable[[str], str]) -> None:
        super().__init__()
        self._spell = spell

    def __missing__(self, name: str) -> str:
        return self._spell(name)


def _length(help: str, *others: str) -> Field:
    return Field(help, "m", others, above=0.0)


def _angle(help: str, *others: str, column: str = "") -> Field:
    return Field(help, "deg", others, column, above=-90.0, below=90.0)


def _friction(help: str, *others: str) -> Field:
    return Field(help, "deg", others, least=0.0, below=90.0)


def _scatter(of: str) -> Field:
    return Field(f"Standard deviation of {of} of what the block may be", least=0.0)


def _spectral(period: str) -> Field:
    code = f"sa{period.replace('.', '')}"
    return Field(
        f"Spectral acceleration at {period} s, 5 % damping",
        "g",
        (code, f"sa({period})", f"sa_{period}"),
        least=0.0,
    )


class NumberFields(TypedDict, Generic[V], total=False):
    """What says of a block all that a model of its kind reads of its shape."""

    p2: Annotated[
        V,
        Field(
            "Frequency parameter p² of the block",
            "1/s²",
            ("p²", "p^2"),
            "p2_1_s2",
            above=0.0,
        ),
    ]
    kr: Annotated[
        V,
        Field(
            "Rocking acceleration coefficient k_r = tan(critical angle), with {p2}", "", ("k_r",)
        ),
    ]
    ky: Annotated[
        V,
        Field(
            "Sliding: yield acceleration coefficient tan(phi - beta), with {beta_deg}",
            "",
            ("k_y",),
        ),
    ]
    ks: Annotated[
        V, Field("Slumping: yield acceleration coefficient k_s, with {ps2}", "", ("k_s",))
    ]
    ps2: Annotated[
        V, Field("Slumping: frequency parameter p_s² at rest", "1/s²", (), "ps2_1_s2", above=0.0)
    ]
    kct: Annotated[
        V,
        Field("Confined toppling: yield acceleration coefficient k_ct, with {pct2}", "", ("k_ct",)),
    ]
    pct2: Annotated[
        V,
        Field(
            "Confined toppling: frequency parameter p_ct² at rest", "1/s²", (), "pct2_1_s2",
            above=0.0,
        ),
    ]  # fmt: skip


class FailureFields(TypedDict, Generic[V], total=False):
    """What a model reads of a block beside its numbers or its shape."""

    displacement_m: Annotated[
        V, _length("Sliding: the displacement that is too far", "displacement")
    ]
    restitution: Annotated[
        V,
        Field(
            "Rocking: speed after an impact over that before it, above 0 and up to 1; default: "
            "what angular momentum leaves",
            above=0.0, most=1.0,
        ),
    ]  # fmt: skip


class ShapeFields(TypedDict, Generic[V], total=False):
    """What describes the shape of a block."""

    height_m: Annotated[
        V,
        _length("Height of a rectangle, perpendicular to its base, with {width_m}", "height", "h"),
    ]
    width_m: Annotated[
        V, _length("Width of a rectangle along its base, with {height_m}", "width", "w", "b")
    ]
    alpha1_deg: Annotated[
        V,
        _angle(
            "Angle from the normal of the base to the line centroid-heel, with {alpha3_deg} and "
            "{r3_m}",
            "alpha1", "α1",
        ),
    ]  # fmt: skip
    alpha3_deg: Annotated[V, _angle("The same angle of the toe", "alpha3", "α3")]
    r3_m: Annotated[V, _length("Distance from centroid to toe", "r3")]
    s1_m: Annotated[V, _length("Spacing of the base fractures, with {s2_m} and {gamma_deg}", "s1")]
    s2_m: Annotated[V, _length("Spacing of the back fractures", "s2")]
    gamma_deg: Annotated[
        V,
        Field(
            "Dip of the back plane less dip of the base", "deg", ("gamma",), above=0.0, below=180.0
        ),
    ]


class PlaneFields(TypedDict, Generic[V], total=False):
    """What describes the planes of a block."""

    beta_deg: Annotated[
        V,
        _angle(
            "Dip of the base, out of the slope positive; a rectangle's is 0 if not given",
            "beta", "dip", "dip_deg", "dip_angle", "β", "base_dip", column="dip_deg",
        ),
    ]  # fmt: skip
    phi_deg: Annotated[
        V,
        _friction(
            "Friction angle of the base; only a rectangle is assumed to topple without",
            "phi", "φ", "friction", "friction_angle",
        ),
    ]  # fmt: skip
    phi_back_deg: Annotated[
        V, _friction("Friction angle of the back plane; default: that of the base", "phi_back")
    ]


class SpaceFields(TypedDict, total=False):
    """What describes the planes of a block in space, as dip/dip direction."""

    base: Annotated[
        str | None,
        Field(
            "Plane of the base as dip/dip direction in deg, 25/102, with {face}, instead of "
            "{beta_deg}",
            is_text=True,
        ),
    ]
    back: Annotated[
        str | None,
        Field(
            "Plane of the back likewise, with {s1_m} and {s2_m} along the normals of the planes, "
            "instead of {gamma_deg}",
            is_text=True,
        ),
    ]
    face: Annotated[
        str | None,
        Field("Plane of the slope's face likewise: its dip direction is the section", is_text=True),
    ]


class JointFields(TypedDict, Generic[V], total=False):
    """What ends with the first slip of a block, and what is left then."""

    water_m: Annotated[
        V,
        Field(
            "Height of the water in the back fracture above the heel, with {density_kg_m3}",
            "m", ("water", "water_level"), least=0.0,
        ),
    ]  # fmt: skip
    jrc: Annotated[
        V,
        Field(
            "Joint roughness coefficient of the base, of samples of 10 cm, with {jcs_mpa} and "
            "{density_kg_m3}; {phi_deg} is then the residual friction angle",
            least=0.0, most=20.0,
        ),
    ]  # fmt: skip
    jcs_mpa: Annotated[
        V,
        Field(
            "Compressive strength of the walls of the base, of samples of 10 cm", "MPa", ("jcs",),
            word="jcs", above=0.0,
        ),
    ]  # fmt: skip
    joint_length_m: Annotated[
        V,
        _length(
            "Length of the joint that shears as one; default: that of the base", "joint_length"
        ),
    ]
    phi_residual_deg: Annotated[
        V,
        _friction(
            "Friction angle of base and back that is left after the first slip, which ends "
            "cohesion and roughness",
            "phi_residual",
        ),
    ]


class ScatterFields(TypedDict, Generic[V], total=False):
    """How well a block is known: what is stated is the median, and P the mean over it."""

    p2_sigma: Annotated[V, _scatter("ln p²")]
    kr_sigma: Annotated[V, _scatter("ln k_r")]
    ky_sigma: Annotated[V, _scatter("ln k_y")]
    ks_sigma: Annotated[V, _scatter("ln k_s")]
    ps2_sigma: Annotated[V, _scatter("ln p_s²")]
    kct_sigma: Annotated[V, _scatter("ln k_ct")]
    pct2_sigma: Annotated[V, _scatter("ln p_ct²")]
    restitution_sigma: Annotated[V, _scatter("the restitution")]


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

    pgv_m_s: Annotated[
        V, Field("Peak ground velocity", "m/s", ("pgv", "peak_ground_velocity"), least=0.0)
    ]
    pga_g: Annotated[
        V, Field("Peak ground acceleration", "g", ("pga", "peak_ground_acceleration"), least=0.0)
    ]
    tm_s: Annotated[V, Field("Mean period", "s", ("tm", "mean_period"), above=0.0)]
    pgd_m: Annotated[
        V, Field("Peak ground displacement", "m", ("pgd", "peak_ground_displacement"), least=0.0)
    ]
    sa03_g: Annotated[V, _spectral("0.3")]
    sa10_g: Annotated[V, _spectral("1.0")]
    sa30_g: Annotated[V, _spectral("3.0")]
    arias_m_s: Annotated[
        V,
        Field(
            "Arias intensity, π/2g times ∫a² dt",
            "m/s",
            ("arias", "ia", "arias_intensity"),
            least=0.0,
        ),
    ]
    magnitude: Annotated[
        V,
        Field(
            "Magnitude of the earthquake",
            "",
            ("mag", "mw", "moment_magnitude"),
            above=0.0,
            most=10.0,
        ),
    ]


def _deviation(of: str) -> Field:
    return Field(f"Standard deviation of ln {of}, of which the median is stated", least=0.0)


class SceneFields(TypedDict, Generic[V], total=False):
    """How well measures are known, and what stands for them: the scenario and the site."""

    pgv_sigma: Annotated[V, _deviation("PGV")]
    pga_sigma: Annotated[V, _deviation("PGA")]
    sa03_sigma: Annotated[V, _deviation("SA(0.3)")]
    sa10_sigma: Annotated[V, _deviation("SA(1.0)")]
    sa30_sigma: Annotated[V, _deviation("SA(3.0)")]
    pgv_tau: Annotated[
        V,
        Field(
            "Part of {pgv_sigma} that all sites of one earthquake share, for the range with "
            "{sites}",
            least=0.0,
        ),
    ]
    rjb_km: Annotated[
        V,
        Field(
            "Distance from the surface projection of the rupture, instead of measures, with "
            "{magnitude} and {vs30_m_s}",
            "km",
            ("rjb", "r_jb", "joyner_boore_distance"),
            least=0.0,
        ),
    ]
    vs30_m_s: Annotated[
        V, Field("Mean velocity of shear waves in the upper 30 m", "m/s", ("vs30",), above=0.0)
    ]
    amplification: Annotated[
        V, Field("Factor on all measures for the shape of the ground", above=0.0)
    ]
    amplification_sigma: Annotated[V, Field("Standard deviation of ln {amplification}", least=0.0)]


SCENE = frozenset({"rjb_km", "vs30_m_s", "amplification"})
"""Fields that are turned into measures before a model is asked."""


class ShakingFields(MeasureFields[V], SceneFields[V], total=False):
    """What may be said of the shaking."""


class SourceFields(TypedDict, total=False):
    """What is said of the earthquake of a scenario beside numbers."""

    mechanism: Annotated[
        str | None,
        Field(
            "How the fault moves, with {rjb_km}: strike-slip, normal, reverse or unspecified; "
            "default: unspecified",
            is_text=True,
        ),
    ]
    gmm: Annotated[
        str | PathLike[str] | None,
        Field(
            "CSV table of medians and sigmas of another ground-motion model: rjb_km, pgv_m_s, "
            "pgv_sigma, pgv_tau and the like, a row a distance",
            is_text=True,
        ),
    ]


class ComponentFields(TypedDict, total=False):
    """Definition of the horizontal component that the measures are of."""

    component: Annotated[
        str | Sequence[str | None] | None,
        Field(
            "Horizontal component of the measures of shaking: single, geometric_mean, rotd50, "
            "rotd100 or larger; default: single",
            is_text=True,
        ),
    ]


_KIND = Field(
    "How the blocks fail: toppling (backed by a slope), rocking (free-standing), slumping, "
    "confined_toppling or sliding; default: what they are given by",
    is_text=True,
)


class WholeFields(SpaceFields, total=False):
    """What holds for all blocks of a question."""

    block: Annotated[Block | None, Field("A block by its corners, a rbfrag.Block")]
    back_fracture: Annotated[
        bool | None, Field("There is no fracture behind the block", word="no_back", is_flag=True)
    ]
    drainage: Annotated[
        str | None,
        Field(
            "Drainage of the water in the back fracture, with {water_m}: undrained (its pressure "
            "keeps acting while the block moves) or drained (it vanishes); default: undrained",
            is_text=True,
        ),
    ]
    cohesion_pa: Annotated[
        float | None, Field("Cohesion of the base, with {density_kg_m3}", "Pa", least=0.0)
    ]
    density_kg_m3: Annotated[
        float | None,
        Field("Density of the rock; default: 2650", "kg/m³", ("density",), above=0.0),
    ]
    kind: Annotated[str | None, _KIND]


class AtRestFields(TypedDict, total=False):
    """What may be said of the ground under a block that no earthquake shakes."""

    kv: Annotated[
        float | None, Field("Vertical acceleration of the ground, up positive", "g", above=-1.0)
    ]


class AnsweringFields(TypedDict, total=False):
    """Which model answers, and how wide its interval is."""

    model: Annotated[
        Model | None,
        Field(
            "Name of a stored model; default: the database's default if the given measures suffice "
            "for it, else the best that they suffice for",
            is_text=True,
        ),
    ]
    level: Annotated[
        float,
        Field(
            "Level of the interval of P, and of the range of one earthquake; default: 0.95",
            above=0.0,
            below=1.0,
        ),
    ]
    db: Annotated[
        str | PathLike[str] | None,
        Field(
            "Database: a path or an SQLAlchemy URL; default: RBFRAG_DB, else rbfrag.db in the "
            "current folder, else the built-in data set",
            is_text=True,
        ),
    ]


class RangeFields(AnsweringFields, total=False):
    """Which model answers, and what the range of one earthquake is of."""

    sites: Annotated[
        float | None,
        Field(
            "Number of sites shaken so in one earthquake: adds what share of such blocks, facing "
            "all sides, fails there; default: none",
            least=1.0,
            most=10_000.0,
        ),
    ]


class RequestFields(RangeFields, SourceFields, ComponentFields, total=False):
    """What is asked of blocks and their shaking."""

    rotation_deg: Annotated[
        float | None,
        Field(
            "Slumping: rotation that counts as failure, of which there must be a model; default: "
            "failure past recovery",
            "deg",
        ),
    ]


class RecordFields(TypedDict, Generic[V], total=False):
    """What else may be said of the shaking."""

    sa_g: Annotated[
        Mapping[float, V] | None,
        Field("Spectral accelerations by their period in s, as in {{1.0: 0.4}}", "g"),
    ]
    motion: Annotated[
        MotionLike | None, Field("The accelerogram itself or its file, instead of its measures")
    ]
    polarity: Annotated[
        Polarity,
        Field(
            "forward or reverse where it is known how the motion points at the slope; both gives "
            "the mean of the two, which stand beside it (motion only)",
            is_text=True,
        ),
    ]


class ArrayFields(TypedDict, total=False):
    """What is asked of arrays."""

    nan: Annotated[
        Literal["propagate", "raise"],
        Field(
            "propagate answers NaN with its reason where the input cannot be used, raise refuses "
            "such arrays",
            is_text=True,
        ),
    ]
    interval: Annotated[
        bool,
        Field(
            "False leaves interval and range out (their ends are then NaN), which takes less time"
        ),
    ]
    weights: Annotated[
        ArrayLike | None,
        Field(
            "Makes the arrays that describe the block draws of one block, of these weights (1: all "
            "the same): one answer, over all of them"
        ),
    ]


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

    block_id: Annotated[str, Field("Name of the block", "", ("block", "name", "id"), is_text=True)]
    site_id: Annotated[str, Field("Name of its site", "", ("site",), is_text=True)]
    kind: Annotated[str, _KIND]
    mode: Annotated[str, Field("Its failure mode", "", ("failure_mode",), is_text=True)]
    lon: Annotated[float, Field("Longitude", "deg", ("longitude",))]
    lat: Annotated[float, Field("Latitude", "deg", ("latitude",))]
    x: Annotated[float, Field("Place of the block in {crs}, to the east", "", ("easting", "x_m"))]
    y: Annotated[float, Field("Place likewise, to the north", "", ("northing", "y_m"))]
    z: Annotated[float, Field("Height of the place in {crs}", "", ("elevation", "z_m"))]
    crs: Annotated[str, Field("Coordinate reference system, as EPSG:2056", is_text=True)]
    strike_length_m: Annotated[
        float, _length("Length of the block along the slope, for its volume", "strike_length")
    ]
    count: Annotated[float, Field("Number of like blocks")]
    weight: Annotated[float, Field("What a failure counts")]
    loss: Annotated[float, Field("What a failure costs")]
    loss_sigma: Annotated[float, Field("Standard deviation of the logarithm of the loss")]


GROUPS: Mapping[str, tuple[Any, ...]] = {
    "First": ("height_m", "width_m", "beta_deg", "phi_deg", "kind", "pgv_m_s"),
    "A block by its numbers": (NumberFields, FailureFields),
    "A block by its shape": ("block", ShapeFields),
    "Planes and joints": (PlaneFields, SpaceFields, JointFields, WholeFields, AtRestFields),
    "What the block may be": (ScatterFields,),
    "More of the shaking": (MeasureFields, ComponentFields, RecordFields),
    "Earthquake, site and scatter of the shaking": (SceneFields, SourceFields),
    "What is asked": (RequestFields,),
}
"""Fields by what they are about, a beginner's first; each belongs where it is found first."""

SPECTRAL = tuple(name for name in MeasureFields.__annotations__ if name.startswith("sa"))

_CLASSES = (QuestionFields, AtRestFields, RowFields)

# nothing but the annotations' own words is read: what the types are called does not matter
_TYPES: dict[str, Any] = dict.fromkeys(
    ("V", "Block", "Model", "MotionLike", "Polarity", "ArrayLike"), Any
) | {"PathLike": list}


@cache
def declared() -> dict[str, Field]:
    """Return all fields by name."""
    return {
        name: about
        for fields in _CLASSES
        for name, hint in get_type_hints(fields, localns=_TYPES, include_extras=True).items()
        for about in getattr(hint, "__metadata__", ())
        if isinstance(about, Field)
    }


def names_of(*classes: Any) -> tuple[str, ...]:
    """Return the fields that classes declare, in their order; a name is one of its own."""
    every = ((each,) if isinstance(each, str) else _hints(each) for each in classes)
    return tuple(dict.fromkeys(name for names in every for name in names))


def _hints(fields: Any) -> Mapping[str, Any]:
    annotations: Mapping[str, Any] = fields.__annotations__
    return annotations


def keywords_in_words(fields: Any) -> str:
    """Return the list of a class's fields for the documentation of what takes them by keyword."""
    lines = []
    for name in names_of(fields):
        if (about := declared().get(name)) is not None:
            sentence = about.sentence("``{}``".format)
            if about.is_flag:
                sentence = f"False where {sentence[:1].lower()}{sentence[1:]}"
            text = f"- ``{name}``: {sentence}"
            lines += wrap(text, 92, initial_indent="    ", subsequent_indent="      ")
    return "\n".join(lines)


BY_ROW = ("back_fracture", "cohesion_pa", "density_kg_m3")
"""Fields of :class:`WholeFields` that a table may give row by row."""


def columns_declared() -> tuple[str, ...]:
    """Return the fields that may be columns of tables."""
    classes = (BlockFields, ShakingFields, ComponentFields, RowFields, SpaceFields)
    return names_of(*classes, *BY_ROW, "mechanism", "drainage")


def column_of(name: str) -> str:
    """Return what the column of a field is called in tables that are written."""
    return declared()[name].column or name


_UNIT = re.compile("_(deg|m_s|kg_m3|pa|km|m|g|s)$")

OTHER_WORDS = {"dip": "beta_deg"}
"""Further words for fields, which shell and requests take too."""


def word_of(name: str) -> str:
    """Return what people call a field that has its unit in its name: ``beta`` of ``beta_deg``."""
    about = declared().get(name)
    return about.word if about and about.word else _UNIT.sub("", name)


def option_of(name: str) -> str:
    """Return what a field is called on the command line."""
    return "--" + word_of(name).replace("_", "-")


def parameter_of(name: str) -> str:
    """Return what a field is called in requests: spectral accelerations as in tables."""
    return name if name in SPECTRAL else word_of(name)


def by_field(words: Mapping[str, Any]) -> dict[str, Any]:
    """Return what was said in words of shell or requests by field; None and False say nothing.

    Raises:
        InputError: two words for one field.
    """
    given: dict[str, Any] = {}
    words_of: dict[str, str] = {}
    for word, value in words.items():
        name = name_of(word)
        if value is None or (value is False and word != name):
            continue
        if name in given:
            raise InputError(
                f"{word} does not go with {words_of[name]}: both say the same",
                fields=(word, words_of[name]),
            )
        words_of[name] = word
        given[name] = False if declared()[name].is_flag and word != name else value
    return given


@cache
def _by_word() -> dict[str, str]:
    names = declared()
    return {parameter_of(n): n for n in names} | {word_of(n): n for n in names} | OTHER_WORDS


def name_of(word: str) -> str:
    """Return the field that people call so; the word itself where it is none."""
    return _by_word().get(word, word)
