"""Equation of a fitted model with its coefficients, as printed in figures."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from rbfrag.fragility.method import Form
from rbfrag.fragility.model import FragilityModel

_TERMS_A_LINE = 5


def equation_lines(model: FragilityModel) -> list[str]:
    """Return the equation of P with rounded coefficients, and its symbols with their units.

    Args:
        model: a model of blocks known by p² and k_r.

    Returns:
        Lines of text with mathtext.
    """
    form, coefficients = model.form, model.row.coefficients
    factor = form.size_factor
    eta = r"\eta" if factor is None else r"\eta/h"
    right = re.sub("<([^>]+)>", lambda match: _filled(match[1], form, coefficients), form.equation)
    first, *further_lines = right.split("\n")
    lines = [rf"$P = {model.method.link.formula},\quad {eta} = {first}$"]
    lines += [rf"${other}$" for other in further_lines]
    where = re.sub("<([^>]+)>", lambda match: _filled(match[1], form, coefficients), form.where)
    if factor is not None:
        where = ",\\ ".join(part for part in (f"h = {factor.formula}", where) if part)
    if where:
        unit = r"\ \mathrm{[m^2/s^2]}" if r"\sigma^2" in where else ""
        lines.append(f"${where}{unit}$")
    symbol = model.term.symbol.replace("π", r"$\pi$").replace("·", " ")
    units = rf"$x$ = {symbol} [m/s],  $y = k_r\,g/p$ [m/s]"
    reads_p = factor is not None or r"\ln p" in right
    lines.append(units + (",  $p$ [1/s]" if reads_p else ""))
    return lines


def rounded(value: float, *, signed: bool = False) -> str:
    """Return a number with three significant digits as mathtext.

    Args:
        signed: with its sign and blanks around it, as a further term of a sum.
    """
    size = abs(value)
    text = f"{size:#.3g}".rstrip(".")
    if "e" in text or 0.0 < size < 1e-3:
        exponent = math.floor(math.log10(float(f"{size:.2e}")))
        text = rf"{size / 10.0**exponent:#.3g}\times10^{{{exponent}}}"
    if signed:
        return f" {'-' if value < 0.0 else '+'} {text}"
    return f"-{text}" if value < 0.0 else text


def _filled(placeholder: str, form: Form, coefficients: Mapping[str, float]) -> str:
    if placeholder == "sum":
        return _sum(form, coefficients)
    if placeholder.startswith("exp "):
        return rounded(math.exp(coefficients[placeholder[4:]]))
    if placeholder.startswith("+"):
        return rounded(coefficients[placeholder[1:]], signed=True)
    return rounded(coefficients[placeholder])


def _sum(form: Form, coefficients: Mapping[str, float]) -> str:
    """Return the sum over the parameters, with a few terms per line."""
    text = ""
    count = 0
    for name, term in zip(form.parameters, form.terms, strict=True):
        if not term or name not in coefficients:
            continue
        if count and count % _TERMS_A_LINE == 0:
            text += "\n"
        text += rounded(coefficients[name], signed=count > 0) + (
            "" if term == "1" else rf"\,{term}"
        )
        count += 1
    return text
