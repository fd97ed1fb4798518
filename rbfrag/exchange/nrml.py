"""Fragility models in OpenQuake's NRML: versions 0.4 and 0.5 read, 0.5 written."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from rbfrag.errors import InputError
from rbfrag.exchange.fragility_function import (
    FragilityFunction,
    IntensityType,
    discrete_function,
    lognormal_function,
    openquake_type,
)
from rbfrag.exchange.xml_source import parse_xml

_UNITS = {"g": 1.0, "cm/s": 0.01, "m/s": 1.0}


@dataclass
class _Function:
    """One fragilityFunction (0.5) or ffs (0.4) while it is read."""

    line: int
    name: str = ""
    form: str = ""
    imls: Mapping[str, str] = field(default_factory=dict)
    levels: str = ""
    states: dict[str, tuple[str, Mapping[str, str]]] = field(default_factory=dict)


def read_nrml(path: str | os.PathLike[str]) -> list[FragilityFunction]:
    """Return every fragility function of a file, one for each asset and limit state.

    ``mean`` and ``stddev`` of a continuous function are those of the lognormal variable itself:
    β = sqrt(ln(1 + (sd/mean)²)), median = mean/sqrt(1 + (sd/mean)²).

    Raises:
        InputError: not such a file, a limit state without its function, or numbers that make
            none; the message names line or element.
    """
    reading = _Reading(str(path))
    parse_xml(
        path, "an NRML fragility model", start=reading.start, end=reading.end, text=reading.text
    )
    return reading.result()


class _Reading:
    def __init__(self, source: str) -> None:
        self._source = source
        self._functions: list[_Function] = []
        self._states: list[str] | None = None
        self._format = ""
        self._state = ""
        self._text = ""
        self._is_model = False

    def start(self, name: str, attributes: Mapping[str, str], line: int) -> None:
        self._text = ""
        if name == "fragilityModel":
            self._is_model = True
            self._format = attributes.get("format", "")
        elif name == "fragilityFunction":
            if "id" not in attributes:
                raise InputError(f"{self._source}, line {line}: fragilityFunction has no id")
            form = attributes.get("format", "")
            shape = attributes.get("shape", "logncdf")
            if form == "continuous" and shape != "logncdf":
                raise InputError(
                    f"{self._source}, line {line}: shape {shape!r} is not known: logncdf is"
                )
            self._functions.append(_Function(line, attributes["id"], form))
        elif name == "ffs":
            self._functions.append(_Function(line, "", self._format))
        elif name in ("imls", "IML") and self._functions:
            self._functions[-1].imls = attributes
        elif name in ("ffc", "ffd"):
            self._state = attributes.get("ls", "")
            if not self._state:
                raise InputError(f"{self._source}, line {line}: {name} has no limit state ls")
        elif name in ("params", "poes") and self._functions:
            state = attributes.get("ls", self._state)
            if not state:
                raise InputError(f"{self._source}, line {line}: {name} has no limit state ls")
            if state in self._functions[-1].states:
                raise InputError(
                    f"{self._source}, line {line}: limit state {state!r} is given twice"
                )
            self._state = state
            if name == "params":
                self._functions[-1].states[state] = ("", attributes)

    def text(self, piece: str) -> None:
        self._text += piece

    def end(self, name: str, line: int) -> None:
        if name == "limitStates":
            self._states = self._text.split()
            if not self._states:
                raise InputError(f"{self._source}, line {line}: there is no limit state")
        elif name == "taxonomy" and self._functions:
            self._functions[-1].name = self._text.strip()
        elif name in ("imls", "IML") and self._functions:
            self._functions[-1].levels = self._text
        elif name in ("poes", "poEs") and self._functions:
            self._functions[-1].states[self._state] = (self._text, {})
        elif name == "fragilityFunction":
            self._state = ""
        self._text = ""

    def result(self) -> list[FragilityFunction]:
        if not self._is_model or not self._functions:
            raise InputError(f"{self._source}: there is no fragility function in the file")
        if self._states is None:
            raise InputError(f"{self._source}: limitStates is missing")
        return [
            self._one(function, state)
            for function in self._functions
            for state in self._complete(function)
        ]

    def _complete(self, function: _Function) -> list[str]:
        assert self._states is not None
        for state in self._states:
            if state not in function.states:
                raise InputError(
                    f"{self._source}, line {function.line}: {function.name!r} lacks the limit "
                    f"state {state!r}"
                )
        for state in function.states:
            if state not in self._states:
                raise InputError(
                    f"{self._source}, line {function.line}: limit state {state!r} of "
                    f"{function.name!r} is none of {' '.join(self._states)}"
                )
        return self._states

    def _one(self, function: _Function, state: str) -> FragilityFunction:
        where = f"{self._source}, line {function.line}, {function.name!r}, {state}"
        imt = function.imls.get("imt", function.imls.get("IMT"))
        if imt is None:
            raise InputError(f"{where}: the intensity measure is not stated")
        kind = openquake_type(imt, where)
        unit = function.imls.get("imlUnit")
        if unit is not None:
            if unit not in _UNITS or (unit == "g") != (kind.measure != "pgv_m_s"):
                raise InputError(f"{where}: {imt} in {unit!r} is not known: g, or cm/s for PGV")
            kind = IntensityType(kind.measure, _UNITS[unit], kind.period_s)
        limit = function.imls.get("noDamageLimit")
        lowest = None if limit is None else kind.factor * _number(limit, where)
        text, parameters = function.states[state]
        if function.form == "continuous":
            mean, sd = (_parameter(parameters, key, where) for key in ("mean", "stddev"))
            if not (mean > 0.0 and sd > 0.0):
                raise InputError(
                    f"{where}: mean = {mean:g} and stddev = {sd:g}: both must be above zero"
                )
            spread = 1.0 + (sd / mean) ** 2
            return lognormal_function(
                function.name,
                state,
                kind,
                kind.factor * mean / math.sqrt(spread),
                math.sqrt(math.log(spread)),
                where,
                lowest,
            )
        if function.form == "discrete":
            levels = np.array([_number(word, where) for word in function.levels.split()])
            poes = np.array([_number(word, where) for word in text.split()])
            return discrete_function(
                function.name, state, kind, kind.factor * levels, poes, where, lowest
            )
        raise InputError(f"{where}: format {function.form!r} is neither continuous nor discrete")


def _parameter(parameters: Mapping[str, str], key: str, where: str) -> float:
    if key not in parameters:
        raise InputError(f"{where}: {key} is missing")
    return _number(parameters[key], where)


def _number(text: str, where: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{where}: {text!r} is not a number") from None


_FAR = 8.0


def nrml_text(
    functions: Sequence[FragilityFunction],
    *,
    identifier: str = "rbfrag",
    asset_category: str = "rock_blocks",
    loss_category: str = "structural",
    description: str = "",
) -> str:
    """Return the document. PGV is in cm/s, PGA and SA in g, as OpenQuake wants them.

    A lognormal function is written as ``continuous`` with mean and standard deviation of the
    variable itself; any other as ``discrete`` on its levels.

    Args:
        functions: the functions; those of one asset one after the other, the same limit states
            for every asset.
        identifier: id of the model.
        asset_category: what the assets are.
        loss_category: the loss type that OpenQuake files the model under.
        description: a sentence or two.
    """
    if not functions:
        raise InputError("there is no fragility function to write")
    assets = [(name, list(group)) for name, group in groupby(functions, key=lambda f: f.name)]
    names = [name for name, _ in assets]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"asset {twice[0]!r} is there twice: give every block its own block_id")
    states = [function.limit_state for function in assets[0][1]]
    for name, group in assets:
        if [function.limit_state for function in group] != states:
            raise InputError(f"asset {name!r} has other limit states than {assets[0][0]!r}")
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<nrml xmlns="http://openquake.org/xmlns/nrml/0.5">',
        f"<fragilityModel id={quoteattr(identifier)} assetCategory={quoteattr(asset_category)} "
        f"lossCategory={quoteattr(loss_category)}>",
        f"<description>{escape(description)}</description>",
        f"<limitStates>{escape(' '.join(states))}</limitStates>",
    ]
    for name, group in assets:
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
