"""Fragility models for OpenQuake: NRML 0.5."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from xml.sax.saxutils import escape, quoteattr

from rbfrag.errors import InputError
from rbfrag.exchange.fragility_function import FragilityFunction

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

    Raises:
        InputError: nothing to write, an asset twice, or assets with other limit states.
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
