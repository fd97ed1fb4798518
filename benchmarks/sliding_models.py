"""How well models of sliding blocks predict:  python -m benchmarks.sliding_models DATABASE

Reads the sliding campaign of a database and prints the scores of its models for held-out
earthquakes, their calibration intercepts by magnitude, and published regressions on the same rows;
--write keeps the tables, in docs/evidence/other-kinds.md or benchmarks/results.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from benchmarks.held_out import Predicted, StoredModels
from benchmarks.model_aims import MODELS
from benchmarks.model_choice import PAGES, loss_cell, magnitude_classes, measures_cell
from benchmarks.page import markdown, write_table
from benchmarks.slide_comparison import comparison
from rbfrag.db.model_file import read_models


def score_table(predictions: Mapping[str, Predicted]) -> str:
    """Return log loss, slope and intercepts of the models, best first."""
    cells = [
        [f"`{name}`", measures_cell(name.removeprefix("sliding-")), loss_cell(prediction),
         f"{prediction.slope[0]:.2f}", *(f"{value:+.2f}" for value in prediction.intercepts)]
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
    models = StoredModels(chosen.database, read_models(chosen.database))
    names = [name for name, aims in MODELS.items() if aims.kind == "sliding"]
    source = models.source(models.rows[names[0]])
    tables = {
        "sliding-scores": score_table({name: models.predicted(name) for name in names}),
        "sliding-one": comparison(source, facing="one"),
        "sliding-either": comparison(source, facing="either"),
    }
    for name, table in tables.items():
        print(f"## {name}\n\n{table}\n", flush=True)
        if chosen.write:
            write_table(PAGES["sliding"], name, table)


if __name__ == "__main__":
    main()
