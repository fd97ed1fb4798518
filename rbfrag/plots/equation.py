"""The equation of a fitted model, with its coefficients, as figures print it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from rbfrag.fragility.method import Form
from rbfrag.fragility.model import FragilityModel

_TERMS_A_LINE = 5


def equation_lines(model: FragilityModel) -> list[str]:
    """Return P of a model with its coefficients rounded, and what its symbols are with their units.

    Args:
        model: a model of blocks known by p² and k_r.

    Returns:
        Lines of text with mathtext.
    """
    form, known = model.form, model.row.coefficients
    factor = form.size_factor
    eta = r"\eta" if factor is None else r"\eta/h"
    right = re.sub("<([^>]+)>", lambda match: _filled(match[1], form, known), form.equation)
    first, *others = right.split("\n")
    lines = [rf"$P = {model.method.link.formula},\quad {eta} = {first}$"]
    lines += [rf"${other}$" for other in others]
    where = re.sub("<([^>]+)>", lambda match: _filled(match[1], form, known), form.where)
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


def _filled(what: str, form: Form, known: Mapping[str, float]) -> str:
    if what == "sum":
        return _sum(form, known)
    if what.startswith("exp "):
        return rounded(math.exp(known[what[4:]]))
    if what.startswith("+"):
        return rounded(known[what[1:]], signed=True)
    return rounded(known[what])


def _sum(form: Form, known: Mapping[str, float]) -> str:
    """Return the sum over the parameters, a line for some of its terms at a time."""
    text = ""
    count = 0
    for name, term in zip(form.parameters, form.terms, strict=True):
        if not term or name not in known:
            continue
        if count and count % _TERMS_A_LINE == 0:
            text += "\n"
        text += rounded(known[name], signed=count > 0) + ("" if term == "1" else rf"\,{term}")
        count += 1
    return text
