"""List of fitted models for scripts. Loads no library."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rbfrag.db.model_file import ModelRow, held_out_loss
from rbfrag.fragility.measures import TERMS
from rbfrag.results.numbers import count_of
from rbfrag.results.result import ResultList, TextLine, TextTable
from rbfrag.vocabulary.quantities import word_of


@dataclass(frozen=True, eq=False, repr=False)
class ModelList(ResultList):
    """The fitted models of a database, by kind, the best of a kind first."""

    models: Sequence[ModelRow]

    def sentences(self) -> Iterator[str]:
        """Yield the number of models."""
        yield count_of(len(self.models), "fitted model")

    def lines(self) -> Iterator[TextLine]:
        """Yield the default of each kind."""
        defaults = [f"{row['name']} ({row['kind']})" for row in self.rows() if row["is_default"]]
        if defaults:
            yield TextLine("Default", ", ".join(defaults))

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:  # noqa: ARG002
        """Yield the models with their predictors and log loss."""
        headers = ("model", "kind", "predictors", "log loss", "default")
        losses = [row["log_loss_kr05"] or row["log_loss"] for row in self.rows()]
        yield TextTable(
            headers,
            [
                (row["name"], row["kind"], ", ".join(map(word_of, row["reads"])),
                 "" if loss is None else f"{loss:.4f}", "yes" if row["is_default"] else "")
                for row, loss in zip(self.rows(), losses, strict=True)
            ],
        )  # fmt: skip

    def rows(self) -> list[dict[str, Any]]:
        """Return the models under the keys of the JSON contract."""
        return [
            {
                **{
                    name: getattr(row, name)
                    for name in ("name", "kind", "term", "method", "is_default")
                },
                "n": fitted_number(row.diagnostics),
                "reads": list(TERMS[row.term].inputs) if row.term in TERMS else [],
                "log_loss": _finite(held_out_loss(row, "log_loss_held_out")),
                "log_loss_kr05": _finite(held_out_loss(row, "log_loss_held_out_kr05")),
                "events": row.diagnostics.get("events"),
                "sensitive_share": row.diagnostics.get("sensitive_share"),
                "domain": dict(row.domain),
                "created": row.created,
            }
            for row in sorted(self.models, key=lambda row: (row.kind, held_out_loss(row)))
        ]


def _finite(loss: float) -> float | None:
    return loss if loss < math.inf else None


def fitted_number(diagnostics: Mapping[str, Any]) -> int | None:
    """Return the number of critical values, or else of outcomes, that a model was fitted to."""
    critical, outcomes = (diagnostics.get(name) for name in ("n", "n_outcomes"))
    number = critical or outcomes or critical
    return None if number is None else int(number)
