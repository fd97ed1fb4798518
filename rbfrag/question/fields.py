"""What may be said of a block and of its shaking: every field once, with its unit and its names.

A field is a key of one of the classes; its annotation says what else it is called. No physics here,
and no library is loaded.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Generic, TypedDict, TypeVar, get_type_hints

V = TypeVar("V")
"""A number, or an array of numbers."""


@dataclass(frozen=True)
class Field:
    """One thing that may be said.

    Args:
        help: what it is.
        unit: its unit; empty for a pure number or a text.
        others: what else its column may be called, in small letters and without a unit.
        column: its column in tables that are written; empty for its own name.
        is_text: whether it is a text.
    """

    help: str
    unit: str = ""
    others: tuple[str, ...] = ()
    column: str = ""
    is_text: bool = False


SPECTRAL = ("sa03_g", "sa10_g", "sa20_g", "sa30_g")


def _scatter(of: str) -> Field:
    return Field(f"standard deviation of {of}")


def _spectral(period: str) -> Field:
    code = f"sa{period.replace('.', '')}"
    return Field(f"spectral acceleration at {period} s", "g", (code, f"sa({period})"))


class BlockFields(TypedDict, Generic[V], total=False):
    """What may be said of a block: numbers, or its sides and planes."""

    p2: Annotated[V, Field("frequency parameter p²", "1/s²", ("p²", "p^2"), "p2_1_s2")]
    kr: Annotated[V, Field("yield acceleration of toppling, tan(critical angle)", "", ("k_r",))]
    height_m: Annotated[V, Field("height of a rectangle", "m", ("height", "h"))]
    width_m: Annotated[V, Field("width of a rectangle along its base", "m", ("width", "w", "b"))]
    alpha1_deg: Annotated[V, Field("angle of the heel", "deg", ("alpha1", "α1"))]
    alpha3_deg: Annotated[V, Field("angle of the toe", "deg", ("alpha3", "α3"))]
    r3_m: Annotated[V, Field("distance from centroid to toe", "m", ("r3",))]
    s1_m: Annotated[V, Field("spacing of the base fractures", "m", ("s1",))]
    s2_m: Annotated[V, Field("spacing of the back fractures", "m", ("s2",))]
    gamma_deg: Annotated[V, Field("dip of the back plane less that of the base", "deg", ("gamma",))]
    beta_deg: Annotated[
        V, Field("dip of the base", "deg", ("beta", "dip", "dip_deg", "β", "base_dip"), "dip_deg")
    ]
    phi_deg: Annotated[
        V, Field("friction angle of the base", "deg", ("phi", "φ", "friction", "friction_angle"))
    ]
    phi_back_deg: Annotated[V, Field("friction angle of the back plane", "deg", ("phi_back",))]
    ky: Annotated[V, Field("yield acceleration of sliding", "", ("k_y",))]
    displacement_m: Annotated[V, Field("displacement that is too far", "m", ("displacement",))]
    ks: Annotated[V, Field("yield acceleration of slumping", "", ("k_s",))]
    ps2: Annotated[V, Field("frequency parameter of slumping", "1/s²", (), "ps2_1_s2")]
    leaves_g: Annotated[V, Field("acceleration at which the block leaves its back plane", "g")]
    restitution: Annotated[V, Field("speed after an impact over that before it")]
    p2_sigma: Annotated[V, _scatter("ln p²")]
    kr_sigma: Annotated[V, _scatter("ln k_r")]
    ky_sigma: Annotated[V, _scatter("ln k_y")]
    ks_sigma: Annotated[V, _scatter("ln k_s")]
    ps2_sigma: Annotated[V, _scatter("ln p_s²")]
    restitution_sigma: Annotated[V, _scatter("the restitution")]


class ShakingFields(TypedDict, Generic[V], total=False):
    """What may be said of the shaking: measures of one horizontal component."""

    pgv_m_s: Annotated[V, Field("peak ground velocity", "m/s", ("pgv", "peak_ground_velocity"))]
    pga_g: Annotated[V, Field("peak ground acceleration", "g", ("pga", "peak_ground_acceleration"))]
    tm_s: Annotated[V, Field("mean period", "s", ("tm", "mean_period"))]
    pgd_m: Annotated[V, Field("peak ground displacement", "m", ("pgd",))]
    sa03_g: Annotated[V, _spectral("0.3")]
    sa10_g: Annotated[V, _spectral("1.0")]
    sa20_g: Annotated[V, _spectral("2.0")]
    sa30_g: Annotated[V, _spectral("3.0")]


class RowFields(TypedDict, total=False):
    """What a row of a table says beside its block and its shaking."""

    block_id: Annotated[str, Field("name of the block", "", ("block", "name", "id"), is_text=True)]
    site_id: Annotated[str, Field("name of its site", "", ("site",), is_text=True)]
    kind: Annotated[str, Field("how it fails", is_text=True)]
    mode: Annotated[str, Field("its failure mode", "", ("failure_mode",), is_text=True)]
    lon: Annotated[float, Field("longitude", "deg", ("longitude",))]
    lat: Annotated[float, Field("latitude", "deg", ("latitude",))]
    count: Annotated[float, Field("number of like blocks")]
    weight: Annotated[float, Field("what a failure counts")]
    loss: Annotated[float, Field("what a failure costs")]
    loss_sigma: Annotated[float, _scatter("the logarithm of the loss")]


@cache
def declared() -> dict[str, Field]:
    """Return all fields by name."""
    return {
        name: about
        for fields in (BlockFields, ShakingFields, RowFields)
        for name, hint in get_type_hints(fields, localns={"V": Any}, include_extras=True).items()
        for about in getattr(hint, "__metadata__", ())
        if isinstance(about, Field)
    }


def column_of(name: str) -> str:
    """Return what the column of a field is called in tables that are written."""
    return declared()[name].column or name


_UNIT = re.compile("_(deg|m_s|m|g|s)$")


def word_of(name: str) -> str:
    """Return what people call a field that has its unit in its name: ``beta`` of ``beta_deg``."""
    return "no_back" if name == "back_fracture" else _UNIT.sub("", name)


def option_of(name: str) -> str:
    """Return what a field is called on the command line."""
    return "--" + word_of(name).replace("_", "-")


def parameter_of(name: str) -> str:
    """Return what a field is called in requests: spectral accelerations as in tables."""
    return name if name in SPECTRAL or name == "leaves_g" else word_of(name)


@cache
def _by_word() -> dict[str, str]:
    return {word_of(name): name for name in declared()}


def name_of(word: str) -> str:
    """Return the field that people call so; the word itself where it is none."""
    return _by_word().get(word, word)
