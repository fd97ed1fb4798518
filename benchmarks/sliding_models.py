"""How good the models of sliding blocks are:  python -m benchmarks.sliding_models DATABASE

Reads the sliding campaign of a database and prints what each model scores on earthquakes left out,
how far it is off by magnitude, and published regressions on the same rows beside our form; --write
keeps the tables, in docs/evidence/other-kinds.md or benchmarks/results.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from benchmarks.model_choice import (
    MODELS,
    PAGES,
    Predicted,
    loss_cell,
    magnitude_classes,
    measures_cell,
    predicted,
)
from benchmarks.page import markdown, write_table
from benchmarks.slide_comparison import comparison
from rbfrag.db.engine import opened_database
from rbfrag.fragility.fit.data import read_source
from rbfrag.fragility.methods import method_named


def score_table(predictions: Mapping[str, Predicted]) -> str:
    """Return log loss, slope and intercepts of the models, best first."""
    cells = [
        [f"`{name}`", measures_cell(name), loss_cell(prediction), f"{prediction.slope[0]:.2f}",
         *(f"{value:+.2f}" for value in prediction.intercepts)]
        for name, prediction in sorted(predictions.items(), key=lambda item: item[1].loss)
    ]  # fmt: skip
    classes = [words for words, *_ in magnitude_classes()]
    return markdown((["model", "reads", "log loss", "slope", *classes], cells))


def main(arguments: list[str] | None = None) -> None:
    """Print the tables, and keep them if asked to."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("database")
    options.add_argument("--write", action="store_true", help="keep the tables")
    chosen = options.parse_args(arguments)
    with opened_database(chosen.database, read_only=True) as engine, engine.connect() as connection:
        source = read_source(connection, method_named("displacement").block)
    models = {name: aims for name, aims in MODELS.items() if aims.kind == "sliding"}
    tables = {
        "sliding-scores": score_table({n: predicted(source, aims) for n, aims in models.items()}),
        "sliding-one": comparison(source, facing="one"),
        "sliding-either": comparison(source, facing="either"),
    }
    for name, table in tables.items():
        print(f"## {name}\n\n{table}\n", flush=True)
        if chosen.write:
            write_table(PAGES["sliding"], name, table)


if __name__ == "__main__":
    main()
