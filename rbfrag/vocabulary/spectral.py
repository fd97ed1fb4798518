"""Spectral accelerations at any oscillator period: their names, and collections that hold them.

``sa(0.5)`` is the spectral acceleration at 0.5 s, ``sa(0.5)_sigma`` the standard deviation of its
logarithm. Inputs give several of them at once, by period: ``sa_g`` and ``sa_sigma``.
"""

from __future__ import annotations

from functools import lru_cache

TYPE_CHECKING = False  # that of `typing` would load it
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import Any, TypeVar

    V = TypeVar("V")

SHORTEST_S, LONGEST_S = 0.01, 10.0
"""Range of the oscillator period [s]."""

SPECTRUM_PERIODS_S = (
    0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0,
    6.0, 7.5, 10.0,
)  # fmt: skip
"""Periods [s] of the response spectrum that is stored with each motion."""

BY_PERIOD = {"sa_g": "", "sa_sigma": "_sigma"}
"""Inputs of values by period, and how the names of these values end."""


def spectral_name(period_s: float) -> str:
    """Return the name of the spectral acceleration at a period [s]: ``sa(0.5)``."""
    return f"sa({period_s:g})"


@lru_cache(maxsize=1024)
def period_of(name: str) -> float | None:
    """Return the period [s] of a spectral acceleration; None for the name of anything else."""
    if not (name.startswith("sa(") and name.endswith(")")):
        return None
    try:
        period_s = float(name[3:-1])
    except ValueError:
        return None
    in_range = SHORTEST_S <= period_s <= LONGEST_S
    return period_s if in_range and spectral_name(period_s) == name else None


@lru_cache(maxsize=1024)
def input_of(name: str) -> str:
    """Return the input that gives a quantity: ``sa_g`` for ``sa(0.5)``, else the name itself."""
    if not name.startswith("sa("):
        return name
    of_sigma = name.endswith("_sigma")
    if period_of(name.removesuffix("_sigma")) is None:
        return name
    return "sa_sigma" if of_sigma else "sa_g"


def spectral_names(names: Iterable[str]) -> list[str]:
    """Return the spectral accelerations among names, by increasing period."""
    periods = {name: period_of(name) or 0.0 for name in names}
    return sorted(filter(periods.get, periods), key=periods.__getitem__)


class SpectralNames(tuple[str, ...]):
    """Names of inputs; what ``sa_g`` or ``sa_sigma`` gives belongs to them if these do."""

    __slots__ = ()

    def __contains__(self, name: object) -> bool:
        return super().__contains__(input_of(name) if isinstance(name, str) else name)


class SpectralSet(frozenset[str]):
    """Set of names, with all that ``sa_g`` or ``sa_sigma`` gives if these belong to it."""

    __slots__ = ()

    def __contains__(self, name: object) -> bool:
        return super().__contains__(name) or (
            isinstance(name, str) and name[:3] == "sa(" and super().__contains__(input_of(name))
        )

    def issuperset(self, names: Iterable[object]) -> bool:
        """Return whether all names belong to the set."""
        return all(name in self for name in names)

    def isdisjoint(self, names: Iterable[Any]) -> bool:
        """Return whether none of the names belongs to the set."""
        names = tuple(names)
        return super().isdisjoint(names) and super().isdisjoint(map(input_of, names))

    def intersection(self, *names: Iterable[object]) -> frozenset[str]:
        """Return the names that belong to the set."""
        (candidates,) = names
        return frozenset(name for name in candidates if isinstance(name, str) and name in self)


class SpectralMapping(dict[str, "V"]):
    """Mapping by name that has a value for each spectral acceleration, made on demand.

    Args:
        values: the others, over which alone it iterates.
        make: returns the value for the name of a spectral acceleration.
        inputs: which names it has: those that ``sa_g`` gives, or ``sa_sigma``.
    """

    __slots__ = ("_inputs", "_make")

    def __init__(self, values: Mapping[str, V], make: Callable[[str], Any], *inputs: str) -> None:
        super().__init__(values)
        self._make, self._inputs = make, inputs

    def _is_spectral(self, name: object) -> bool:
        return isinstance(name, str) and name[:3] == "sa(" and input_of(name) in self._inputs

    def __contains__(self, name: object) -> bool:
        return super().__contains__(name) or self._is_spectral(name)

    def __missing__(self, name: str) -> V:
        if not self._is_spectral(name):
            raise KeyError(name)
        value: V = self._make(name)
        return value

    def get(self, name: str, default: Any = None) -> V | Any:
        """Return the value for a name; the default where there is none."""
        return self[name] if name in self else default  # noqa: SIM401


def spectral_inputs(name: str, values: Any, word: str = "") -> dict[str, Any]:
    """Return values at oscillator periods by name: ``sa(0.5)``, ``sa(0.5)_sigma``.

    Args:
        name: the input, one of :data:`BY_PERIOD`.
        values: values by period [s], or texts such as "0.5=0.4" or "0.5:0.4 1:0.2".
        word: its name in the interface; empty for that of the keyword.

    Raises:
        InputError: a period that is not a number, out of range or given twice, or a text without a
            number.
    """
    from rbfrag.errors import InputError

    word = word or name

    def rejection(typed: object, problem: str) -> InputError:
        return InputError(f"{word} {typed:.60}: {problem}", fields=(word,))

    if hasattr(values, "items"):
        items = [(f"{period!r}", period, value) for period, value in values.items()]
    elif isinstance(values, (list, tuple)) and all(isinstance(text, str) for text in values):
        items = []
        for text in " ".join(values).split():
            period, mark, number = text.replace(":", "=").partition("=")
            value = _number(number)
            if not mark or value is None:
                raise rejection(text, "give the period in s and the value, such as 0.5=0.4")
            items.append((text, period, value))
    else:
        raise InputError(
            f"{word} = {values!r:.60}: give values by period in s, such as {{1: 0.4}}",
            fields=(word,),
        )
    result: dict[str, Any] = {}
    for typed, period, value in items:
        period_s = _number(period)
        if period_s is None:
            raise rejection(typed, "the period is not a number")
        if not SHORTEST_S <= period_s <= LONGEST_S:
            raise rejection(typed, f"the period must be from {SHORTEST_S:g} to {LONGEST_S:g} s")
        key = spectral_name(period_s) + BY_PERIOD[name]
        if key in result:
            raise rejection(typed, f"the period {period_s:g} s is given twice")
        result[key] = value
    return result


def _number(value: Any) -> float | None:
    if isinstance(value, bool):
        return None
    try:
        return float(value)
    except (TypeError, ValueError):
        return None
