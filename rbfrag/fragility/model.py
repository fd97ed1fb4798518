"""A fitted fragility model, ready to answer.

No library is loaded here: `predict` needs it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rbfrag.db.rows import ModelRow
from rbfrag.errors import ModelError
from rbfrag.fragility import formulas
from rbfrag.fragility.measures import TERMS, Term

_OF_CRITICAL = (
    "probability that the critical toppling velocity of the motion is at least the block's; "
    "safe islands below the critical value are not taken off"
)
_OF_OUTCOME = "probability that the block topples"

MEANINGS: Mapping[str, str] = {
    "wls": _OF_CRITICAL,
    "lognormal": _OF_CRITICAL,
    "logistic": _OF_OUTCOME,
    "weibull": _OF_OUTCOME,
    "bounded": _OF_OUTCOME,
    "record": _OF_OUTCOME,
    "power": _OF_OUTCOME,
}
"""What the probability of each method is a probability of."""

METHODS_BEST_FIRST = ("record", "bounded", "weibull", "power", "logistic", "lognormal", "wls")
"""The methods by falling skill on held-out earthquakes (docs/theory/model-choice.md)."""

BEST_ON_PGV = ("weibull", "bounded", "logistic", "lognormal", "wls")
"""The same for PGV alone, where the third parameter of `bounded` gains nothing."""


@dataclass(frozen=True)
class FragilityModel:
    """One fitted fragility model: a stored row in the form that answers.

    Args:
        row: the model as stored.
        term: the intensity term it reads.
        shape: number of its formula in :mod:`rbfrag.fragility.formulas`.
        link: number of its link there.
        parameters: values of the coefficients, without those that the model does not have.
        padded: the six parameters of the formula.
        packed_covariance: the 21 numbers of :func:`rbfrag.fragility.formulas.standard_error`.
        floor: least widths of the interval over its quantile, of
            :func:`rbfrag.fragility.formulas.least_width`, or empty.
        limits: edges of the fitted ranges for :func:`rbfrag.fragility.formulas.is_plain`.
        limits_with_both: the same where PGV and PGA are both given, with the range of PGV/PGA
            that earthquakes have.
        vertical: whether it was fitted with vertical motion.
        degrees_of_freedom: of the standard errors, which the interval is widened by, at most the
            earthquakes less one; 0 for none.
        notes: what every answer says of the model, such as where it comes from.
    """

    row: ModelRow
    term: Term
    shape: int
    link: int
    parameters: tuple[float, ...]
    padded: tuple[float, ...]
    packed_covariance: tuple[float, ...]
    floor: tuple[float, ...]
    limits: tuple[float, ...]
    limits_with_both: tuple[float, ...]
    vertical: bool
    degrees_of_freedom: int
    notes: tuple[str, ...] = ()

    @classmethod
    def from_row(cls, row: ModelRow) -> FragilityModel:
        """Return the model of a stored row.

        Raises:
            ModelError: this rbfrag does not know the model's term or method, or the row is
                not whole.
        """
        term, shape = TERMS.get(row.term), formulas.SHAPES.get((row.method, row.term))
        if term is None or shape is None:
            methods = ", ".join(dict.fromkeys(method for method, _ in formulas.SHAPES))
            raise ModelError(
                f"model {row.name!r} is of term {row.term!r} and method {row.method!r}, which "
                f"this rbfrag does not know (terms {', '.join(TERMS)}; methods "
                f"{methods}): update rbfrag or choose another model"
            )
        parameters = tuple(float(value) for value in row.coefficients.values())
        size = len(parameters)
        if len(row.covariance) != size or any(len(line) != size for line in row.covariance):
            raise ModelError(
                f"model {row.name!r} has {size} coefficients but a covariance of another size: "
                "fit it again"
            )
        names = formulas.PARAMETERS[shape]
        if not 2 <= size <= len(names) or tuple(row.coefficients) != names[:size]:
            raise ModelError(
                f"model {row.name!r} has the coefficients {', '.join(row.coefficients)}, but "
                f"method {row.method} on {row.term} has {', '.join(names)}: fit it again"
            )
        floor = row.diagnostics.get("interval_floor") or ()
        if isinstance(floor, list | tuple) and len(floor) == formulas.FLOOR_NODES:
            # stored before there was a second table, which must not be the lower one then
            floor = [*floor, *[max(floor)] * formulas.FLOOR_NODES]
        if not isinstance(floor, list | tuple) or len(floor) not in (0, 2 * formulas.FLOOR_NODES):
            raise ModelError(
                f"model {row.name!r} holds a table of least widths of another size: fit it again"
            )
        limits = tuple(
            edge
            for variable in ("p2", "intensity_m_s", "y_m_s", "tm_s", "pgv_over_pga_s")
            for edge in row.domain.get(variable, (formulas.LEAST_Y_M_S, math.inf))
        )
        freedom = row.diagnostics.get("degrees_of_freedom")
        return cls(
            row=row,
            term=term,
            shape=shape,
            link=formulas.LINKS[row.method],
            parameters=parameters,
            padded=parameters + (0.0,) * (formulas.MOST_PARAMETERS - size),
            packed_covariance=packed(row.covariance),
            floor=tuple(float(value) for value in floor),
            limits=limits,
            limits_with_both=(*limits[:8], max(limits[8], 0.005), min(limits[9], 2.0)),
            vertical=row.diagnostics.get("vertical", "without") != "without",
            degrees_of_freedom=freedom if isinstance(freedom, int) else 0,
        )

    @property
    def name(self) -> str:
        """Unique name in the database."""
        return self.row.name

    @property
    def meaning(self) -> str:
        """What the probability is a probability of."""
        return MEANINGS[self.row.method]


def packed(covariance: tuple[tuple[float, ...], ...]) -> tuple[float, ...]:
    """Return a covariance as the 21 numbers of `formulas.standard_error`."""
    size = len(covariance)
    return tuple(
        (float(covariance[i][j]) * (1.0 if i == j else 2.0)) if i < size else 0.0
        for i in range(formulas.MOST_PARAMETERS)
        for j in range(i + 1)
    )
