"""A fitted fragility model and the formulas that models answer by.

A method of fitting is one file with its formula and one line in `FORMULAS`. No library is
loaded here: `predict` needs it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rbfrag.db.rows import ModelRow
from rbfrag.errors import ModelError
from rbfrag.fragility import straight_line
from rbfrag.fragility.functions import Functions, N
from rbfrag.fragility.terms import TERMS, Term


@dataclass(frozen=True)
class Formula:
    """How models of one method answer.

    Args:
        meaning: what the probability is a probability of.
        score: ``score(parameters, x, y, functions)`` gives z, whose normal distribution
            function is the probability, and the slopes of z by each parameter.
        negative_share: ``negative_share(parameters, x, functions)`` gives the probability
            spent on critical velocities below zero.
        rise: ``rise(parameters, x, y)`` is negative where the probability falls with
            growing intensity.
    """

    meaning: str
    score: Callable[..., Any]
    negative_share: Callable[..., Any]
    rise: Callable[..., Any]


FORMULAS: Mapping[str, Formula] = {
    "wls": Formula(
        meaning=straight_line.MEANING,
        score=straight_line.score,
        negative_share=straight_line.negative_share,
        rise=straight_line.rise,
    ),
}
"""The formula of each method of fitting."""


@dataclass(frozen=True)
class FragilityModel:
    """One fitted fragility model: a stored row together with its term and formula.

    Args:
        row: the model as stored.
        term: the intensity term it reads.
        formula: how it answers.
        parameters: values of the coefficients in their fixed order.
    """

    row: ModelRow
    term: Term
    formula: Formula
    parameters: tuple[float, ...]

    @classmethod
    def from_row(cls, row: ModelRow) -> FragilityModel:
        """Return the model of a stored row.

        Raises:
            ModelError: this rbfrag does not know the model's term or method, or the row is
                not whole.
        """
        term, formula = TERMS.get(row.term), FORMULAS.get(row.method)
        if term is None or formula is None:
            raise ModelError(
                f"model {row.name!r} is of term {row.term!r} and method {row.method!r}, which "
                f"this rbfrag does not know (terms {', '.join(TERMS)}; methods "
                f"{', '.join(FORMULAS)}): update rbfrag or choose another model"
            )
        parameters = tuple(float(value) for value in row.coefficients.values())
        size = len(parameters)
        if len(row.covariance) != size or any(len(line) != size for line in row.covariance):
            raise ModelError(
                f"model {row.name!r} has {size} coefficients but a covariance of another size: "
                "fit it again"
            )
        return cls(row, term, formula, parameters)

    @property
    def name(self) -> str:
        """Unique name in the database."""
        return self.row.name

    def score(self, x: N, y: N, functions: Functions[N]) -> tuple[N, N]:
        """Return z and its standard error by the delta method.

        The standard error is sqrt(gᵀ Σ g) with g the slopes of z by the parameters and Σ
        their covariance.

        Args:
            x: intensity [m/s].
            y: toppling velocity of the block [m/s].
            functions: functions for the kind of number given.
        """
        z, slopes = self.formula.score(self.parameters, x, y, functions)
        return z, functions.sqrt(functions.floor(_form(self.row.covariance, slopes), 0.0))


def _form(covariance: Sequence[Sequence[float]], slopes: Sequence[N]) -> N:
    total = slopes[0] * 0.0
    for i, line in enumerate(covariance):
        part = slopes[i] * line[i]
        for j in range(i):
            part = part + slopes[j] * (2.0 * line[j])
        total = total + slopes[i] * part
    return total
