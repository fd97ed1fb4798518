"""Fragility models in OpenQuake's NRML: versions 0.4 and 0.5 read, 0.5 written."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from rbfrag.errors import InputError
from rbfrag.exchange.fragility_function import (
    FragilityFunction,
    assets_of,
    discrete_function,
    lognormal_function,
)
from rbfrag.exchange.xml_source import Node, read_xml
from rbfrag.files import number_at
from rbfrag.hazards.curve import IntensityType, openquake_type

_UNITS = {"g": 1.0, "cm/s": 0.01, "m/s": 1.0}


def read_nrml(path: str | os.PathLike[str]) -> list[FragilityFunction]:
    """Return every fragility function of a file, one for each asset and limit state.

    ``mean`` and ``stddev`` of a continuous function are those of the lognormal variable itself:
    β = sqrt(ln(1 + (sd/mean)²)), median = mean/sqrt(1 + (sd/mean)²).

    Raises:
        InputError: not such a file, a limit state without its function, or numbers that make
            none; the message names line or element.
    """
    source = str(path)
    document = read_xml(path, "an NRML fragility model")
    model = next(document.of("fragilityModel"), None)
    # fragilityFunction in version 0.5, ffs in 0.4
    assets = [] if model is None else list(model.of("fragilityFunction", "ffs"))
    if model is None or not assets:
        raise InputError(f"{source}: there is no fragility function in the file")
    limit_states = next(model.of("limitStates"), None)
    if limit_states is None:
        raise InputError(f"{source}: limitStates is missing")
    states = limit_states.text.split()
    if not states:
        raise InputError(f"{source}, line {limit_states.line}: there is no limit state")
    functions = []
    for asset in assets:
        if asset.name == "ffs":
            taxonomy = next(asset.of("taxonomy"), None)
            name = "" if taxonomy is None else taxonomy.text.strip()
            form = model.attributes.get("format", "")
        elif "id" not in asset.attributes:
            raise InputError(f"{source}, line {asset.line}: fragilityFunction has no id")
        else:
            name, form = asset.attributes["id"], asset.attributes.get("format", "")
            shape = asset.attributes.get("shape", "logncdf")
            if form == "continuous" and shape != "logncdf":
                raise InputError(
                    f"{source}, line {asset.line}: unsupported shape {shape!r}: use logncdf"
                )
        curves = _curves(asset, source)
        for state in states:
            if state not in curves:
                raise InputError(
                    f"{source}, line {asset.line}: {name!r} lacks the limit state {state!r}"
                )
        for state in curves:
            if state not in states:
                raise InputError(
                    f"{source}, line {asset.line}: limit state {state!r} of {name!r} is not one "
                    f"of {' '.join(states)}"
                )
        for state in states:
            where = f"{source}, line {asset.line}, {name!r}, {state}"
            functions.append(_function(asset, name, form, state, curves[state], where))
    return functions


def _curves(asset: Node, source: str) -> dict[str, Node]:
    """Return the XML element with the numbers of each limit state."""
    curves: dict[str, Node] = {}
    for part in asset.children:
        if part.name not in ("ffc", "ffd", "params", "poes"):
            continue
        state = part.attributes.get("ls", "")
        if not state:
            raise InputError(f"{source}, line {part.line}: {part.name} has no limit state ls")
        for curve in part.of("params", "poEs", "poes") if part.name.startswith("ff") else [part]:
            if state in curves:
                raise InputError(
                    f"{source}, line {curve.line}: limit state {state!r} is given twice"
                )
            curves[state] = curve
    return curves


def _function(
    asset: Node, name: str, form: str, state: str, curve: Node, where: str
) -> FragilityFunction:
    levels = next(asset.of("imls", "IML"), Node("", {}, 0))
    imt = levels.attributes.get("imt", levels.attributes.get("IMT"))
    if imt is None:
        raise InputError(f"{where}: the intensity measure is missing")
    kind = openquake_type(imt, where)
    unit = levels.attributes.get("imlUnit")
    if unit is not None:
        if unit not in _UNITS or (unit == "g") != (kind.measure != "pgv_m_s"):
            raise InputError(f"{where}: {imt} in {unit!r} is not supported: use g, or cm/s for PGV")
        kind = IntensityType(kind.measure, _UNITS[unit], kind.period_s)
    limit = levels.attributes.get("noDamageLimit")
    lowest = None if limit is None else kind.factor * number_at(limit, where)
    if form == "continuous":
        for key in ("mean", "stddev"):
            if key not in curve.attributes:
                raise InputError(f"{where}: {key} is missing")
        mean, sd = (number_at(curve.attributes[key], where) for key in ("mean", "stddev"))
        if not (mean > 0.0 and sd > 0.0):
            raise InputError(
                f"{where}: mean = {mean:g} and stddev = {sd:g}: both must be above zero"
            )
        if not sd / mean < 1e100:
            raise InputError(f"{where}: stddev = {sd:g} is out of range for mean {mean:g}")
        spread = 1.0 + (sd / mean) ** 2
        median, beta = kind.factor * mean / math.sqrt(spread), math.sqrt(math.log(spread))
        return lognormal_function(name, state, kind, median, beta, where, lowest)
    if form == "discrete":
        x = np.array([number_at(word, where) for word in levels.text.split()])
        poes = np.array([number_at(word, where) for word in curve.text.split()])
        return discrete_function(name, state, kind, kind.factor * x, poes, where, lowest)
    raise InputError(f"{where}: format {form!r} is neither continuous nor discrete")


_FAR = 8.0


def nrml_text(functions: Sequence[FragilityFunction], *, description: str = "") -> str:
    """Return the document; PGV is in cm/s, PGA and SA in g, as OpenQuake requires.

    A lognormal function is written as ``continuous`` with mean and standard deviation of the
    variable itself; any other as ``discrete`` on its levels.

    Args:
        functions: the functions; those of one asset one after the other, the same limit states
            for every asset.
    """
    assets = assets_of(functions)
    states = [function.limit_state for function in functions[: len(next(iter(assets.values())))]]
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<nrml xmlns="http://openquake.org/xmlns/nrml/0.5">',
        '<fragilityModel id="rbfrag" assetCategory="rock_blocks" lossCategory="structural">',
        f"<description>{escape(description)}</description>",
        f"<limitStates>{escape(' '.join(states))}</limitStates>",
    ]
    for name, group in assets.items():
        lines += _asset(name, group)
    lines += ["</fragilityModel>", "</nrml>", ""]
    return "\n".join(lines)


def _asset(name: str, group: list[FragilityFunction]) -> list[str]:
    first = group[0]
    unit = first.kind.factor
    if all(function.is_lognormal for function in group):
        low = min(_quantile(function, -_FAR) for function in group) / unit
        high = max(_quantile(function, _FAR) for function in group) / unit
        lines = [
            f'<fragilityFunction id={quoteattr(name)} format="continuous" shape="logncdf">',
            f'<imls imt="{first.kind.imt}" minIML="{float(low)!r}" maxIML="{float(high)!r}"/>',
        ]
        for function in group:
            assert function.median is not None
            assert function.beta is not None
            mean = function.median / unit * math.exp(0.5 * function.beta**2)
            sd = mean * math.sqrt(math.expm1(function.beta**2))
            lines.append(
                f"<params ls={quoteattr(function.limit_state)} "
                f'mean="{float(mean)!r}" stddev="{float(sd)!r}"/>'
            )
        return [*lines, "</fragilityFunction>"]
    assert first.levels is not None
    limit = (
        ""
        if first.no_damage_limit is None
        else f' noDamageLimit="{float(first.no_damage_limit / unit)!r}"'
    )
    lines = [
        f'<fragilityFunction id={quoteattr(name)} format="discrete">',
        f'<imls imt="{first.kind.imt}"{limit}>{_list((first.levels / unit).tolist())}</imls>',
    ]
    for function in group:
        assert function.probability is not None
        lines.append(
            f"<poes ls={quoteattr(function.limit_state)}>"
            f"{_list(function.probability.tolist())}</poes>"
        )
    return [*lines, "</fragilityFunction>"]


def _quantile(function: FragilityFunction, z: float) -> float:
    assert function.median is not None
    assert function.beta is not None
    return function.median * math.exp(z * function.beta)


def _list(values: list[float]) -> str:
    return " ".join(map(repr, values))
