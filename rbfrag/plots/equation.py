"""The equation of a fitted model as text with mathtext."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from rbfrag.fragility import describe
from rbfrag.fragility.completion import Completion, Regression, node_weights
from rbfrag.fragility.method import SINGLE, Velocity
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.spectral_velocity import ln_rocking_velocity, ln_toppling_velocity
from rbfrag.vocabulary.quantities import QUANTITIES
from rbfrag.vocabulary.spectral import spectral_names

_TERMS_A_LINE = 5

_VELOCITY: dict[Velocity, str] = {ln_toppling_velocity: "X", ln_rocking_velocity: "A"}
"""Symbols of the spectral velocities."""

_OVER = {"": r"\ln %s", "PGV": r"\ln(%s/\mathrm{PGV})", "PGA": r"\ln[%s/(\mathrm{PGA}\,g)]"}
"""Their logarithms, by the symbol of the measure that they are regressed on as a ratio to."""

_FEW = 3
"""Of more spectral accelerations their number is given."""


def equation_lines(model: FragilityModel, p2: float = 1.0) -> list[str]:
    """Return the equation of P with rounded coefficients, and its symbols with their units.

    A spectral velocity that the given measures do not determine is written as its regression on
    them, with the standard deviation σ of the residual.

    Args:
        model: a model of blocks known by p² and k_r.
        p2: frequency parameter p² [1/s²] for which the regression is written.

    Returns:
        Lines of text with mathtext.
    """
    form, coefficients, completion = model.form, model.row.coefficients, model.completion
    factor, link = form.size_factor, model.method.link.formula
    eta = r"\eta" if factor is None else r"\eta/h"

    def number_of(match: re.Match[str]) -> str:
        sign, function, name = match[1], match[2], match[3]
        if name == "sum":
            named = zip(form.parameters, form.terms, strict=True)
            return _sum(
                [(coefficients[n], term) for n, term in named if term and n in coefficients]
            )
        value = math.exp(coefficients[name]) if function else coefficients[name]
        return rounded(value, signed=bool(sign))

    right, where = (
        re.sub(r"<(\+?)(exp )?([^>]+)>", number_of, template)
        for template in (form.equation, form.where)
    )
    definitions = [where] if factor is None else [f"h = {factor.formula}", where]
    if completion is not None and completion.regression is not None:
        # averaged over the normal residual of ln X, whose coefficient is the last
        link = link.replace(r"\eta", r"\eta/D")
        slope = rounded(abs(model.parameters[-1]))
        definitions.insert(0, rf"D = \sqrt{{1 + ({slope}\,h\,\sigma)^2}}")
    first, *further_lines = right.split("\n")
    lines = [rf"$P = {link},\quad {eta} = {first}$", *(f"${line}$" for line in further_lines)]
    if where := ",\\ ".join(filter(None, definitions)):
        unit = r"\ \mathrm{[m^2/s^2]}" if r"\sigma^2" in where else ""
        lines.append(f"${where}{unit}$")
    lines += () if completion is None else _regression_lines(completion, p2)
    symbol = model.term.symbol.replace("π", r"$\pi$").replace("·", " ")
    has_x = re.search(r"(?<![A-Za-z\\])x(?![A-Za-z])", right + where)
    units = [rf"$x$ = {symbol} [m/s]"] if has_x else []
    if completion is not None:
        velocity = _VELOCITY[completion.velocity.ln_velocity]
        units.append(f"${velocity}$ = spectral velocity at the block's periods [m/s]")
    units.append(r"$y = k_r\,g/p$ [m/s]")
    units += ["$p$ [1/s]"] if factor is not None or r"\ln p" in right else []
    units += ["$T_m$ [s]"] if any("T_m" in line for line in lines) else []
    return [*lines, ",  ".join(units)]


def _regression_lines(completion: Completion, p2: float) -> Iterator[str]:
    """Yield the regression of a spectral velocity at a block size, and its symbols."""
    velocity, used, regression = completion.velocity, completion.used, completion.regression
    if regression is None:
        return
    symbol, spectrum = _VELOCITY[velocity.ln_velocity], spectral_names(used)
    ln_ratio = _OVER[QUANTITIES[velocity.over].symbol if velocity.over else ""]
    *slopes, sigma = _at_size(regression, p2)
    terms = ["1"]
    if velocity.over and "pgv_m_s" in used:
        terms += [r"\zeta", r"\zeta^2"]
    if spectrum:
        terms.append(ln_ratio % rf"\hat {symbol}")
    terms += [r"\ln T_m"] if "tm_s" in used else []
    terms += [r"[\min(M, 6.5) - 6.5]"] if "magnitude" in used else []
    right = _sum([*zip(slopes, terms, strict=True)]).replace("\n", "")
    at = rf"\ \mathrm{{at}}\ p^2 = {p2:.3g}\ \mathrm{{s^{{-2}}}}"
    yield rf"${ln_ratio % symbol} = {right},\ \sigma = {rounded(sigma)}{at}$"
    if r"\zeta" in terms:
        zeta = r"\ln[\mathrm{PGV}/(\mathrm{PGA}\,g)]"
        if velocity.over == "pga_g" and slopes[2] < 0.0:
            top = rounded(-slopes[1] / (2.0 * slopes[2]))
            zeta = rf"\min\{{{zeta},\ {top}\}}"
        yield rf"$\zeta = {zeta}$"
    if spectrum:
        few = len(spectrum) <= _FEW
        ordinates = describe.measures(spectrum) if few else f"SA at {len(spectrum)} periods"
        pga = " and of PGA as SA(0.03 s)" if "pga_g" in used else ""
        yield rf"$\hat {symbol}$ = {symbol} of the interpolated {ordinates}{pga}"


def _at_size(regression: Regression, p2: float) -> list[float]:
    """Return the coefficients and σ of a regression at a block size p² [1/s²]."""
    weights = node_weights({"p": math.sqrt(p2)}, SINGLE)
    columns = (*zip(*regression.coefficients, strict=True), regression.sigma)
    return [sum(w * v for w, v in zip(weights, column, strict=True)) for column in columns]


def _sum(terms: list[tuple[float, str]]) -> str:
    """Return the sum of coefficients times terms ("1" for none), with a few terms per line."""
    text = ""
    for count, (value, term) in enumerate(terms):
        text += "\n" if count and count % _TERMS_A_LINE == 0 else ""
        text += rounded(value, signed=count > 0) + ("" if term == "1" else rf"\,{term}")
    return text


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
