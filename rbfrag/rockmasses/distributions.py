"""Probability distributions of the variables of a rock mass: dip, spacing, friction, planes.

Every law turns one uniform number into one value by its inverse distribution function. A
truncation then only narrows the range of the uniform numbers, and a value depends on nothing
but the law, the seed and its place in the sample. Of sets of measured planes the poles scatter as
of Fisher (1953) about the axis of their greatest moment; in the section of a face the dips scatter
by a circular law.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from rbfrag.errors import InputError
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import percent
from rbfrag.solver.block.planes import STRIKE_DEG, Plane, plane_of, section_of
from rbfrag.solver.results import FloatArray

Law = Literal["constant", "normal", "lognormal", "uniform", "von_mises", "measured"]

LAWS: dict[Law, tuple[str, ...]] = {
    "constant": ("value",),
    "normal": ("mean", "sd"),
    "lognormal": ("median", "sd_ln"),
    "uniform": ("low", "high"),
    "von_mises": ("mean", "kappa"),
    "measured": ("values",),
}
"""The laws and what each must be given."""

TRUNCATED: tuple[Law, ...] = ("normal", "lognormal", "von_mises")
"""Laws that may be cut off at ``low``, at ``high`` or at both."""

SMALLEST_REMAINDER = 1e-6
"""Least part of a law that a truncation may leave."""

_SMALLEST_UNIFORM = 2.0**-54
_NODES = 20001


@dataclass(frozen=True)
class Distribution:
    """Distribution of one variable of a rock mass; created by :meth:`of`.

    Args:
        location: value of a constant, mean, median, or centre of the circular law.
        scale: standard deviation, that of the logarithm, or the concentration kappa.
        low: lower end; -inf for none.
        high: upper end; +inf for none.
        values: the measurements of the law ``measured``.
    """

    law: Law
    location: float = math.nan
    scale: float = math.nan
    low: float = -math.inf
    high: float = math.inf
    values: tuple[float, ...] = ()

    @classmethod
    def of(cls, description: object, *, angle: bool) -> Distribution:
        """Return the distribution described by a number or a table of keys.

        Args:
            description: a number, or a mapping with ``distribution`` and the keys of that law:
                ``normal`` mean, sd; ``lognormal`` median, sd_ln (standard deviation of the
                natural logarithm); ``uniform`` low, high; ``von_mises`` mean, kappa;
                ``measured`` values. The first two and von_mises may have low and high.
            angle: whether the variable is an angle in degrees, which alone may be von_mises.

        Raises:
            InputError: what is stated is no such law; the message names the key.
        """
        if not isinstance(description, dict):
            return cls("constant", location=_number(description, ""))
        keys = dict(description)
        name = keys.pop("distribution", None)
        if not isinstance(name, str) or name not in LAWS:
            if name is None:
                raise InputError(f"the key distribution is missing: use one of {', '.join(LAWS)}")
            raise InputError(f"distribution = {name!r} is unknown: use one of {', '.join(LAWS)}")
        law: Law = name
        if law == "von_mises" and not angle:
            raise InputError(
                "distribution = 'von_mises' is for angles: use lognormal, normal, uniform or "
                "measured for a length or an acceleration"
            )
        ends = ("low", "high") if law in TRUNCATED else ()
        for key in LAWS[law]:
            if key not in keys:
                raise InputError(
                    f"the key {key} is missing: a {law} distribution requires {_and(LAWS[law])}"
                )
        for key in keys:
            if key not in (*LAWS[law], *ends):
                raise InputError(
                    f"unknown key {key!r}: a {law} distribution has {_and((*LAWS[law], *ends))}"
                )
        if law == "measured":
            measurements = keys["values"]
            if not isinstance(measurements, list | tuple) or not measurements:
                raise InputError(
                    f"values = {measurements!r:.60}: give a list of measurements such as [18, 22.5]"
                )
            numbered = enumerate(measurements)
            return cls(law, values=tuple(_number(value, f"values[{i}]") for i, value in numbered))
        numbers = {key: _number(value, key) for key, value in keys.items()}
        distribution = cls(
            law,
            location=numbers.get("mean", numbers.get("median", numbers.get("value", math.nan))),
            scale=numbers.get("sd", numbers.get("sd_ln", numbers.get("kappa", math.nan))),
            low=numbers.get("low", -math.inf),
            high=numbers.get("high", math.inf),
        )
        distribution._check()
        return distribution

    @property
    def centres(self) -> tuple[float, ...]:
        """Values that must lie in the permitted range: centre, ends or data."""
        if self.law == "uniform":
            return (self.low, self.high)
        return self.values or (self.location,)

    def __str__(self) -> str:
        """Describe the distribution and its truncation."""
        if self.law == "constant":
            return f"{self.location:.10g}"
        if self.law == "measured":
            low, high = min(self.values), max(self.values)
            return f"{len(self.values)} measurements from {low:.6g} to {high:.6g}"
        if self.law == "uniform":
            return f"uniform from {self.low:.10g} to {self.high:.10g}"
        first, second = LAWS[self.law]
        ends = ", truncated" if self.is_truncated else ", not truncated"
        if self.low > -math.inf:
            ends += f" below {self.low:.10g}"
        if self.high < math.inf:
            ends += f"{' and' if self.low > -math.inf else ''} above {self.high:.10g}"
        name = self.law.replace("_", " ")
        return f"{name}, {first} {self.location:.10g}, {second} {self.scale:.10g}{ends}"

    @property
    def is_truncated(self) -> bool:
        """True if the distribution is truncated."""
        return self.law in TRUNCATED and (self.low > -math.inf or self.high < math.inf)

    def sample(self, n: int, random: np.random.Generator) -> FloatArray:
        """Return n independent values.

        Args:
            random: generator of the uniform numbers; n are taken, whatever the law.
        """
        uniform = np.maximum(random.random(n), _SMALLEST_UNIFORM)
        if self.law == "constant":
            return np.full(n, self.location)
        if self.law == "measured":
            values = np.array(self.values)
            return values[(uniform * values.size).astype(np.intp)]
        if self.law == "uniform":
            return self.low + (self.high - self.low) * uniform
        start, end = self._cdf(self.low), self._cdf(self.high)
        # Never quite 0 or 1, where the inverse is infinite.
        inside = np.clip(start + (end - start) * uniform, _SMALLEST_UNIFORM, 1.0 - 2.0**-53)
        return np.clip(self._ppf(inside), self.low, self.high)

    def _check(self) -> None:
        if self.law not in TRUNCATED:
            if self.law == "uniform" and not self.low < self.high:
                raise InputError(f"low = {self.low:g} is not below high = {self.high:g}")
            return
        centre, spread = LAWS[self.law]
        if not self.scale > 0.0:
            raise InputError(
                f"{spread} = {self.scale:g} is not above zero: for a constant give a number"
            )
        if self.law == "lognormal" and self.location <= 0.0:
            raise InputError(f"median = {self.location:g} is not above zero")
        if not self.low < self.high:
            raise InputError(f"low = {self.low:g} is not below high = {self.high:g}")
        remaining = self._cdf(self.high) - self._cdf(self.low)
        if not remaining >= SMALLEST_REMAINDER:
            raise InputError(
                f"low = {self.low:g} and high = {self.high:g} leave {remaining:.2g} of the "
                f"distribution, less than {SMALLEST_REMAINDER:g}: move them towards "
                f"{centre} = {self.location:g}"
            )

    # Loading scipy.stats takes .8 s, longer than a whole `rbfrag rockmass` (.65 s), and its
    # truncnorm.ppf 11 to 32 ms for 20,000 values, where scipy.special's pair takes .4 ms and
    # differs by 1e-11: a truncation narrows the uniform numbers instead.

    def _cdf(self, value: float) -> float:
        """Return the cumulative probability before truncation."""
        if math.isinf(value):
            return 0.0 if value < 0.0 else 1.0
        if self.law == "von_mises":
            angles, probabilities = self._von_mises_table()
            return float(np.interp(value - self.location, angles, probabilities))
        from scipy.special import ndtr

        if self.law == "lognormal":
            if value <= 0.0:
                return 0.0
            return float(ndtr(math.log(value / self.location) / self.scale))
        return float(ndtr((value - self.location) / self.scale))

    def _ppf(self, probability: FloatArray) -> FloatArray:
        """Return the quantiles before truncation."""
        if self.law == "von_mises":
            angles, probabilities = self._von_mises_table()
            return self.location + np.interp(probability, probabilities, angles)
        from scipy.special import ndtri

        if self.law == "lognormal":
            return np.asarray(self.location * np.exp(self.scale * ndtri(probability)))
        return np.asarray(self.location + self.scale * ndtri(probability))

    def _von_mises_table(self) -> tuple[FloatArray, FloatArray]:
        """Return angles from the mean [deg] and their cumulative probability.

        The trapezoid rule: scipy.stats.vonmises.ppf searches each value for itself, 75 s for 20,000
        of them, and vonmises.cdf approximates above kappa = 50 (at 130 by 4e-4 degrees).
        """
        # Beyond 12 standard deviations lies nothing that a sample could meet.
        reach = min(math.pi, 12.0 / math.sqrt(self.scale))
        angles = np.linspace(-reach, reach, _NODES)
        density = np.exp(self.scale * (np.cos(angles) - 1.0))
        sums = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
        return np.degrees(angles), sums / sums[-1]


def _and(names: tuple[str, ...]) -> str:
    return ", ".join(names[:-1]) + (" and " if len(names) > 1 else "") + names[-1]


def _number(value: object, key: str) -> float:
    label = f"{key} = {value!r}" if key else f"{value!r}"
    if isinstance(value, bool) or not isinstance(value, int | float):
        tables = "" if key else " or a table such as { distribution = 'normal', mean = 20, sd = 5 }"
        raise InputError(f"{label} is not a number: give a number{tables}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InputError(f"{label} is not finite: give a number")
    return number


_DRAWS, _SEED = 100_000, 1
_WIDE_K = 30.0


class OrientationSet(NamedTuple):
    """A set of planes.

    Args:
        mean: the mean plane.
        resultant: length R of the sum of their unit poles.
        fisher_k: concentration K = (N - 1)/(N - R).
        alpha95_deg: half-angle of the cone that holds the true mean with 95 % [deg].
        size: number N of planes.
    """

    mean: Plane
    resultant: float
    fisher_k: float
    alpha95_deg: float
    size: int

    def share_off(self, face: Plane) -> float:
        """Return the share of such planes that strike more than 20 deg off a face."""
        random = np.random.default_rng(_SEED)
        spread = 1.0 - math.exp(-2.0 * self.fisher_k)
        cosine = 1.0 + np.log1p(-random.random(_DRAWS) * spread) / self.fisher_k
        around = 2.0 * math.pi * random.random(_DRAWS)
        sine = np.sqrt(1.0 - cosine**2)
        pole = np.array(self.mean.pole)
        azimuth = math.radians(self.mean.direction_deg)
        strike = np.array([math.cos(azimuth), -math.sin(azimuth), 0.0])
        aside = np.cross(pole, strike)
        drawn = np.outer(cosine, pole) + np.outer(sine * np.cos(around), strike)
        drawn += np.outer(sine * np.sin(around), aside)
        off = np.degrees(np.arctan2(drawn[:, 0], drawn[:, 1])) - face.direction_deg
        off = np.abs((off + 90.0) % 180.0 - 90.0)
        return float(np.mean(off > STRIKE_DEG))


def orientation_set(planes: Sequence[Plane]) -> OrientationSet:
    """Return the mean and the scatter of planes.

    Raises:
        InputError: fewer than three planes, or all alike.
    """
    if len(planes) < 3:
        raise InputError(f"a set of {len(planes)} planes has no dispersion: give three or more")
    poles: FloatArray = np.array([plane.pole for plane in planes])
    axis = np.linalg.eigh(poles.T @ poles)[1][:, -1]
    poles[poles @ axis < 0.0] *= -1.0
    total = poles.sum(axis=0)
    total = -total if total[2] < 0.0 else total
    length, count = float(np.linalg.norm(total)), len(planes)
    if count - length < 1e-9:
        raise InputError("all planes of the set are identical: give one plane")
    east, north, up = (total / length).tolist()
    mean = Plane(
        math.degrees(math.acos(min(up, 1.0))), math.degrees(math.atan2(east, north)) % 360.0
    )
    cosine = 1.0 - (count - length) / length * (20.0 ** (1.0 / (count - 1)) - 1.0)
    return OrientationSet(
        mean, length, (count - 1) / (count - length), math.degrees(math.acos(max(cosine, -1.0))),
        count,
    )  # fmt: skip


def in_section(description: Mapping[str, object]) -> tuple[dict[str, object], tuple[str, ...]]:
    """Return the description of a rock mass in the section across its face, and warnings.

    Args:
        description: as of a rock mass; ``face.plane`` with ``base.plane`` and ``back.plane``, each
            a text dip/dip direction or a list of such, stand for the dips; spacings are those
            along the normals.

    Raises:
        InputError: a plane is missing or cannot be read, or no section does.
    """
    converted = dict(description)
    plane_values = {name: converted.pop(f"{name}.plane", None) for name in ("face", "base", "back")}
    if all(value is None for value in plane_values.values()):
        return converted, ()
    planes: dict[str, Plane] = {}
    sets: dict[str, OrientationSet] = {}
    for name, value in plane_values.items():
        if value is None:
            raise InputError(f"{name}.plane is missing: give face, base and back as 25/102")
        if isinstance(value, list):
            sets[name] = orientation_set([plane_of(text, f"{name}.plane") for text in value])
            planes[name] = sets[name].mean
        else:
            planes[name] = plane_of(value, f"{name}.plane")
    face = planes["face"]
    section = section_of(face, planes["base"], planes["back"])
    notes: list[str] = []
    assert section.gamma_deg is not None
    dips = {"base": section.beta_deg, "back": section.beta_deg + section.gamma_deg}
    factors = {"base": section.base_factor, "back": section.back_factor}
    for name, dip in dips.items():
        if f"{name}.dip_deg" in converted:
            raise InputError(f"{name}.dip_deg and {name}.plane both give the dip: give one of them")
        converted[f"{name}.dip_deg"] = dip
        spacing = f"{name}.spacing_m"
        if spacing in converted:
            converted[spacing] = _scaled(converted[spacing], factors[name])
        if name not in sets:
            continue
        joints = sets[name]
        kappa = joints.fisher_k / factors[name] ** 2
        converted[f"{name}.dip_deg"] = {"distribution": "von_mises", "mean": dip, "kappa": kappa}
        notes.append(
            f"{name}: {joints.size} planes, mean {joints.mean}, Fisher K {joints.fisher_k:.4g}, "
            f"alpha95 {joints.alpha95_deg:.3g} deg; {percent(joints.share_off(face))} of such "
            f"planes strike more than {STRIKE_DEG:g} deg off the face, which the section leaves out"
        )
        if joints.fisher_k < _WIDE_K:
            notes.append(
                f"{name}: with K below {_WIDE_K:g} the dips in the section scatter a little more "
                "than the von Mises law drawn from (at K 10 by 3.3 %)"
            )
    coded = (Diagnostic(note, "plane_sets") for note in notes)
    return converted, (*section.remarks, *coded)


def _scaled(law: Any, factor: float) -> Any:
    """Return the distribution of a length multiplied by a factor."""
    if isinstance(law, dict):
        return {
            key: value if key in ("distribution", "sd_ln", "kappa") else _scaled(value, factor)
            for key, value in law.items()
        }
    if isinstance(law, list):
        return [_scaled(item, factor) for item in law]
    return law * factor if isinstance(law, int | float) and not isinstance(law, bool) else law
