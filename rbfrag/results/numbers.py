"""Numbers as answers print them: probabilities, intervals, return periods, rates.

One rule for the command line, the web page, reports and figures: two significant digits of a
probability, three of a return period. Documents have all digits.
"""

from __future__ import annotations

SMALLEST = 1e-4
"""Probabilities nearer to 0 or to 1 than this are printed as a bound."""

TINY = 1e-12
"""Probability, above 0, that is printed for one of a model that is 0 or 1 to rounding."""

NEVER = 1e-8
"""Annual rates below this are printed as a bound [1/yr]."""


def _in_percent(p: float) -> str:
    if p in (0.0, 1.0):
        return f"{100.0 * p:g}"
    if p < SMALLEST:
        return "<0.01"
    if p > 1.0 - SMALLEST:
        return ">99.99"
    if p < 0.0995:
        return f"{100.0 * p:#.2g}"
    if p < 0.995:
        return f"{100.0 * p:.0f}"
    return f"{100.0 * p:.2f}".rstrip("0").rstrip(".")


def percent(p: float) -> str:
    """Return a probability in percent, with two significant digits: "8.4 %"."""
    return f"{_in_percent(p)} %"


def interval(low: float, high: float) -> str:
    """Return an interval of probabilities in percent, "7.4–26 %"; one number if both ends agree."""
    return "–".join(dict.fromkeys((_in_percent(low), _in_percent(high)))) + " %"


def with_interval(p: float, low: float, high: float) -> str:
    """Return a probability with its interval, "15 % (7.4–26 %)", unless the interval is a point."""
    ends = interval(low, high)
    return percent(p) if ends == percent(p) else f"{percent(p)} ({ends})"


def equals(name: str, value: str) -> str:
    """Return "P = 15 %", or "P < 0.01 %" where the value is a bound."""
    return f"{name} {value[0]} {value[1:]}" if value[0] in "<>" else f"{name} = {value}"


def exact_percent(fraction: float) -> str:
    """Return a level or a threshold in percent with all digits: "97.5 %"."""
    return f"{100.0 * fraction:g} %"


def relative(change: float) -> str:
    """Return a relative change or error in percent, with two significant digits: "130 %"."""
    return f"{float(f'{100.0 * change:.2g}'):g} %"


def confidence(level: float, ends: str, name: str = "confidence") -> str:
    """Return an interval with its level: "95 % confidence interval 7.4–26 %"."""
    return f"{exact_percent(level)} {name} interval {ends}"


def years(rate: float, digits: int = 2) -> str:
    """Return the return period of an annual rate [1/yr] without its unit: "4,400"."""
    return f"{float(f'{1.0 / rate:.{digits}g}'):,.15g}"


def two_digits(value: float) -> str:
    """Return a number with two significant digits and without an exponent: "890"."""
    return f"{float(f'{value:.2g}'):,.15g}"


def return_period(rate: float) -> str:
    """Return the return period of an annual rate [1/yr]: "4,400 years"."""
    return f"{years(rate)} years" if rate > NEVER else "over 100 million years"


def return_periods(low: float, high: float) -> str:
    """Return the return periods of an interval of annual rates [1/yr]: "3,700–5,300"."""
    ends = [years(rate) if rate > NEVER else "over 100 million" for rate in (high, low)]
    return "–".join(dict.fromkeys(ends))


def count_of(number: int, noun: str) -> str:
    """Return a number with its noun in the correct form: "12 blocks"."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def place(lon: float, lat: float) -> str:
    """Format a longitude and latitude [deg]: "37.180 N, 121.930 W"."""
    return f"{abs(lat):.3f} {'S' if lat < 0.0 else 'N'}, {abs(lon):.3f} {'W' if lon < 0.0 else 'E'}"


def annual_rate(value: float) -> str:
    """Return an annual rate [1/yr] without its unit, with two significant digits: "2.3e-4"."""
    if value == 0.0 or 0.1 <= value < 1000.0:
        return f"{value:.2g}"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def annual_rates(low: float, high: float) -> str:
    """Return an interval of annual rates [1/yr] without its unit: "1.9e-4–2.7e-4"."""
    return "–".join(dict.fromkeys((annual_rate(low), annual_rate(high))))


def rounded(value: float) -> str:
    """Return a number with three digits, without an exponent where possible."""
    if value != 0.0 and not 1e-4 <= abs(value) < 1e7:
        return f"{value:.2g}"
    text = f"{value:#.3g}"
    return f"{float(text):,.0f}" if abs(value) >= 100.0 else text.rstrip(".")
