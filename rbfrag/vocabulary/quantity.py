"""A quantity: its range, its names as an input, and what makes it an intensity measure.

Plain classes, because each start of the program makes all quantities.
"""

from __future__ import annotations

TYPE_CHECKING = False  # that of `typing` would load it
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any


class Limits:
    """Permitted range of a quantity; None for no limit.

    Args:
        above: lower limit, excluded.
        least: lower limit, included.
        below: upper limit, excluded.
        most: upper limit, included.
    """

    __slots__ = ("above", "below", "least", "most")

    def __init__(
        self,
        above: float | None = None,
        least: float | None = None,
        below: float | None = None,
        most: float | None = None,
    ) -> None:
        self.above, self.least, self.below, self.most = above, least, below, most

    def holds(self, value: Any) -> Any:
        """Return whether a number, or each of an array, lies within the range; NaN does not."""
        inside = value == value
        if self.above is not None:
            inside = inside & (value > self.above)
        if self.least is not None:
            inside = inside & (value >= self.least)
        if self.below is not None:
            inside = inside & (value < self.below)
        if self.most is not None:
            inside = inside & (value <= self.most)
        return inside

    @property
    def words(self) -> str:
        """Text of the range."""
        if self.above is not None and self.below is not None:
            return f"between {self.above:g} and {self.below:g}"
        high = "" if self.below is None else f"below {self.below:g}"
        if self.most is not None:
            high = f"up to {self.most:g}"
        if self.above is not None:
            return f"above {self.above:g} and {high}" if high else f"above {self.above:g}"
        if self.least is not None:
            least = f"{self.least:g}"
            if self.most is not None:
                return f"from {least} to {self.most:g}"
            return f"at least {least}{f' and {high}' if high else ''}"
        return high


ANY, POSITIVE, NOT_NEGATIVE = Limits(), Limits(above=0.0), Limits(least=0.0)


class Input:
    """Names, type and help of an input quantity.

    Args:
        detail: addition to the label in the help; names in braces stand for their spelling in an
            interface.
        aliases: further names of its column, in small letters and without a unit.
        default: value or rule where it is not given, for the help.
        column: its column in tables that are written; empty for its name.
        word: its name in options and requests; empty for its name without the unit.
        type: float, str, bool for a truth value that is true by default, or dict for values by
            oscillator period.
    """

    __slots__ = ("aliases", "column", "default", "detail", "type", "word")

    def __init__(
        self,
        detail: str = "",
        aliases: tuple[str, ...] = (),
        *,
        default: str = "",
        column: str = "",
        word: str = "",
        type: type = float,
    ) -> None:
        self.detail, self.aliases, self.default = detail, aliases, default
        self.column, self.word, self.type = column, word, type


class Measure:
    """Properties of an intensity measure.

    Args:
        title: name for people where that is not the symbol.
        axis: label of an axis, without the unit; empty where no curve runs over it.
        power: exponent of the amplitude of the shaking that it grows with; 0 for none.
        period_s: oscillator period of a spectral acceleration [s].
        imt: intensity measure type of OpenQuake; empty for none.
        imt_factor: unit of that type in the unit of the quantity.
        uncertain: whether the standard deviation of its logarithm may be given.
        top: strongest shaking that fragility functions for other tools cover.
        largest: value beyond which the unit of a grid of shaking must be wrong.
    """

    __slots__ = (
        "axis", "imt", "imt_factor", "largest", "period_s", "power", "title", "top",
        "uncertain",
    )  # fmt: skip

    def __init__(
        self,
        title: str = "",
        axis: str = "",
        *,
        power: int = 0,
        period_s: float | None = None,
        imt: str = "",
        imt_factor: float = 1.0,
        uncertain: bool = False,
        top: float | None = None,
        largest: float | None = None,
    ) -> None:
        self.title, self.axis, self.power, self.period_s = title, axis, power, period_s
        self.imt, self.imt_factor, self.uncertain = imt, imt_factor, uncertain
        self.top, self.largest = top, largest


class Quantity:
    """One quantity: name, unit, symbol, range and texts.

    Args:
        name: name in Python, JSON and the database, with its unit.
        label: noun phrase that begins its help and its description.
        unit: its unit; empty for a pure number or a text.
        symbol: its symbol in formulas.
        range: the values that it may have.
        input: its names as an input; None where it is not one.
        credible: minimum and maximum credible value, and the warning about others.
        prompt: description of a valid value, for errors; empty for one of label, unit and range.
        measure: what makes it an intensity measure; None where it is none.
        stored: its meaning as a column of the database; empty where it is none.
    """

    __slots__ = (
        "_prompt", "credible", "input", "label", "measure", "name", "range", "stored", "symbol",
        "unit",
    )  # fmt: skip

    def __init__(
        self,
        name: str,
        label: str,
        unit: str = "",
        symbol: str = "",
        range: Limits = ANY,
        input: Input | None = None,
        *,
        credible: tuple[float, float, str] | None = None,
        prompt: str = "",
        measure: Measure | None = None,
        stored: str = "",
    ) -> None:
        self.name, self.label, self.unit, self.symbol = name, label, unit, symbol
        self.range, self.input, self.credible = range, input, credible
        self._prompt, self.measure, self.stored = prompt, measure, stored

    @property
    def noun(self) -> str:
        """The label within a sentence: "dip of the base"."""
        text = self.label
        for mark in ",;(":
            text = text.partition(mark)[0]
        text = text.rpartition(": ")[2].strip()
        return f"{text[:1].lower()}{text[1:]}".removeprefix("the ")

    @property
    def prompt(self) -> str:
        """Description of a valid value, for errors."""
        limit = "0 or more" if self.range.above is None else f"above {self.range.above:g}"
        return self._prompt or f"the {self.noun} in {self.unit}, {limit}"

    def description(self, spell: Callable[[str], str]) -> str:
        """Return label, details and default, with inputs in the spelling of an interface."""
        text = self.label
        if self.input is not None:
            detail, default = self.input.detail, self.input.default
            text += f"{', ' if detail and detail[0] not in ';:( ' else ''}{detail}"
            text += f" [default: {default}]" if default else ""
        return text.format_map(_Spelling(spell))

    def help(self, spell: Callable[[str], str]) -> str:
        """Return the description with the unit, which precedes the default."""
        text, mark, default = self.description(spell).partition(" [default: ")
        return f"{text}{f' [{self.unit}]' if self.unit else ''}{mark}{default}"


class _Spelling(dict[str, str]):
    """Names in the spelling of an interface, created on demand."""

    def __init__(self, spell: Callable[[str], str]) -> None:
        super().__init__()
        self._spell = spell

    def __missing__(self, name: str) -> str:
        return self._spell(name)
