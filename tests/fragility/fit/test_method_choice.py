"""The method of a fit where none is named."""

from __future__ import annotations

from itertools import groupby

from rbfrag.db.location import reference_file
from rbfrag.db.model_file import ModelRow, read_models
from rbfrag.fragility.fit.fitting import method_of_kind

SCORES = ("log_loss_held_out_kr05", "log_loss_held_out")
"""Of real blocks where that is known, as models are listed."""


def loss_of(row: ModelRow) -> float:
    scores = row.diagnostics["scores"]
    assert isinstance(scores, dict)
    return float(next(scores[name] for name in SCORES if name in scores))


def test_it_is_the_method_whose_shipped_model_has_the_least_loss() -> None:
    shipped = reference_file()
    assert shipped is not None
    by_term = sorted(read_models(shipped), key=lambda row: (row.kind, row.term))
    compared = 0
    for (kind, term), models in groupby(by_term, key=lambda row: (row.kind, row.term)):
        losses = {row.method: loss_of(row) for row in models}
        assert method_of_kind(kind, None, term).name == min(losses, key=lambda m: losses[m])
        compared += len(losses) > 1
    assert compared >= 3


def test_of_critical_values_alone_it_reads_no_outcomes() -> None:
    assert method_of_kind("toppling", None, "pgv", reads="critical").reads == "critical"
    assert method_of_kind("toppling", None, "pgv").name != "wls"
    assert method_of_kind("toppling", "wls", "pgv").name == "wls"
