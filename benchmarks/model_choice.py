"""How well fragility models predict held-out earthquakes:  python -m benchmarks.model_choice

Reads the built-in data set (--db DATABASE: another) and the models that are fitted to it. Each
earthquake is predicted without it (leave-one-earthquake-out cross-validation, by the steps of
coefficients and regressions that are stored with the models), for each set of intensity measures
that may be given. --aims prints what is aimed at and what is reached, and the exit status is 1
where an aim is missed; an aim that cannot be measured is missed. --kind and --model choose. --write
puts the tables into the pages or benchmarks/results. Models of sliding have aims here, and their
tables by benchmarks.sliding_models.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from benchmarks.held_out import MAGNITUDES, Predicted, StoredModels, clustered_mean, log_losses
from benchmarks.model_aims import (
    KR_CLASSES,
    MODELS,
    NAMES,
    REQUIRED_ONLY,
    SA_1,
    SA_2,
    SA_3,
    SA_4,
    SA_8,
    SA_13,
    SA_21,
    SA_TO_2_S,
    SA_TO_3_S,
    STRONG_KR,
    WITH_PGV,
    WITH_TM,
    MeasureSet,
    acceptance_table,
    model_marks,
    rare_failures,
)
from benchmarks.page import ROOT, markdown, parser, write_table
from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import read_models
from rbfrag.errors import RbfragError
from rbfrag.fragility.completion import NODES_P2
from rbfrag.fragility.fit.data import REAL_KR
from rbfrag.fragility.measures import TERMS

EVIDENCE = ROOT / "docs" / "evidence" / "model-choice.md"
PAGES = {
    "toppling": EVIDENCE,
    "rocking": ROOT / "docs" / "theory" / "rocking.md",
    "sliding": ROOT / "docs" / "evidence" / "other-kinds.md",
}

ASKED_FOR = (
    SA_21,
    SA_13,
    SA_8,
    SA_TO_3_S,
    SA_TO_2_S,
    SA_4,
    SA_3,
    SA_2,
    SA_1,
    WITH_TM,
    REQUIRED_ONLY,
)
"""What a hazard analyst may be asked for, the most first."""

ASKED_OF = {
    "backed: PGV, PGA": ("toppling-pgv_pga", False), "backed: PGA": ("toppling-pga", False),
    "backed: SA alone": ("toppling-sa", False),
    "free-standing: PGV, PGA": ("rocking-pga", True),
    "free-standing: PGA": ("rocking-pga", False),
    "free-standing: SA alone": ("rocking-sa", False),
}  # fmt: skip
"""Model by what is given otherwise, and whether PGV is an additional measure of it."""

CLASSES_OF = {
    "toppling": (
        ("toppling-pgv_pga", SA_21), ("toppling-pgv_pga", REQUIRED_ONLY), ("toppling-pga", SA_21),
        ("toppling-pga", SA_3), ("toppling-pga", WITH_TM), ("toppling-sa", SA_21),
        ("toppling-pgv", REQUIRED_ONLY), ("record-xp", REQUIRED_ONLY),
    ),
    "rocking": (
        ("rocking-pga", SA_21), ("rocking-pga", SA_3), ("rocking-pga", WITH_PGV),
        ("rocking-pga", SA_1), ("rocking-sa", SA_21), ("rocking-pgv", REQUIRED_ONLY),
    ),
}  # fmt: skip
"""Models and what they are given whose calibration is shown by class."""

Predictions = Mapping[str, Mapping[MeasureSet, Predicted | None]]
"""By model and what is given; None where there are none."""


def _with_pgv(measures: MeasureSet) -> MeasureSet:
    return MeasureSet(measures.periods_s, WITH_PGV.scalars + measures.scalars)


def loss_cell(blocks: Predicted) -> str:
    """Return the log loss with its standard error by earthquake."""
    mean, error = clustered_mean(log_losses(blocks.p, blocks.failed), blocks.event)
    return f"{mean:.4f} ± {error:.4f}"


def measures_cell(term: str, measures: MeasureSet = REQUIRED_ONLY) -> str:
    """Return the intensity measures from which a model answers, in words."""
    required = [NAMES[name] for name in TERMS[term].inputs if name in NAMES]
    return ", ".join([*required, *[measures.words] * bool(measures.words)])


def score_table(predictions: Predictions, terms: Mapping[str, str]) -> str:
    """Return the scores of the models by what is given, for blocks with k_r."""
    cells = []
    for name, sets in predictions.items():
        for measures in MODELS[name].sets:
            blocks = sets.get(measures)
            if blocks is None:
                continue
            real, strong = blocks.kr_from(REAL_KR), blocks.kr_from(STRONG_KR)
            failures, expected, _ = rare_failures(blocks)
            cells.append([
                f"`{name}`", measures_cell(terms[name], measures), loss_cell(blocks),
                loss_cell(real), slope_cell(real), f"{strong.ratio:.2f}",
                f"{failures} ({expected:.0f})",
            ])  # fmt: skip
    head = [
        "model", "given", "log loss, $k_r$ ≥ .02", "log loss, $k_r$ ≥ .05", "slope",
        "predicted/observed, $k_r$ ≥ .2", "failures with $P$ < .01 (expected)",
    ]  # fmt: skip
    return markdown((head, cells))


def asked_for_table(predictions: Predictions) -> str:
    """Return the log loss of blocks with k_r >= 0.05 by what is given."""
    cells = []
    for measures in ASKED_FOR:
        line = [measures.words or "nothing else"]
        for name, with_pgv in ASKED_OF.values():
            blocks = predictions[name].get(_with_pgv(measures) if with_pgv else measures)
            line.append("–" if blocks is None else f"{blocks.kr_from(REAL_KR).loss:.3f}")
        cells.append(line)
    return markdown((["in addition", *ASKED_OF], cells))


def class_table(
    chosen: Mapping[str, Predicted], classes: Mapping[str, Sequence[Predicted]], *, ratio: bool
) -> str:
    """Return the calibration slope of each class, or predicted over observed failures.

    Args:
        chosen: predictions by the words of their column.
        classes: the blocks of each class, a column each.
        ratio: whether it is the ratio.
    """
    cells = [
        [words, *(ratio_cell(part) if ratio else slope_cell(part) for part in parts)]
        for words, parts in classes.items()
    ]
    return markdown((["predicted/observed" if ratio else "slope", *chosen], cells))


def strength_and_size_classes(
    columns: Sequence[Predicted],
) -> dict[str, list[Predicted]]:
    """Return the blocks of each class of k_r and of each size."""
    classes = {
        f"$k_r$ {low:g} to {high:g}": [blocks.kr_from(low, high) for blocks in columns]
        for low, high in pairwise(KR_CLASSES)
    }
    return classes | {
        f"$p^2$ = {p2:g} s⁻²": [blocks.of_size(p2) for blocks in columns] for p2 in NODES_P2
    }


def magnitude_classes() -> Iterator[tuple[str, float, float]]:
    """Yield the magnitude classes in words, with their ends."""
    for low, high in pairwise(MAGNITUDES):
        if math.isinf(high):
            yield f"M ≥ {low:g}", low, high
        else:
            yield (f"M {low:g} to {high:g}" if low > 0.0 else f"M < {high:g}"), low, high


def slope_cell(blocks: Predicted) -> str:
    """Return the calibration slope with its standard error."""
    slope, error = blocks.slope
    return f"{slope:.2f} ± {error:.2f}" if math.isfinite(slope) else "–"


def ratio_cell(blocks: Predicted) -> str:
    """Return predicted over observed failures."""
    return f"{blocks.ratio:.2f}" if blocks.failed.any() else "–"


def predictions_of(
    models: StoredModels, names: Sequence[str]
) -> dict[str, dict[MeasureSet, Predicted]]:
    """Return the predictions of the models by what is given; those that fail are left out."""
    result: dict[str, dict[MeasureSet, Predicted]] = {}
    asked_for = {model: [] for model, _ in ASKED_OF.values()}
    for model, with_pgv in ASKED_OF.values():
        asked_for[model] += [
            _with_pgv(measures) if with_pgv else measures for measures in ASKED_FOR
        ]
    for name in names:
        sets = result.setdefault(name, {})
        for measures in dict.fromkeys((*MODELS[name].sets, *asked_for.get(name, ()))):
            try:
                if not (measures.names or TERMS[models.rows[name].term].inputs):
                    continue  # SA alone without SA
                sets[measures] = models.predicted(name, measures.names)
            except (RbfragError, KeyError) as error:
                print(f"{name}, {measures.words or 'nothing else'}: not measured ({error})")
    return result


def tables_of(kind: str, predictions: Predictions, terms: Mapping[str, str]) -> dict[str, str]:
    """Return the tables of the models of one kind whose blocks have k_r."""
    tables = {"scores": score_table(predictions, terms)}
    chosen = {
        measures_cell(terms[name], measures): blocks
        for name, measures in CLASSES_OF[kind]
        if (blocks := predictions.get(name, {}).get(measures)) is not None
    }
    columns = [*chosen.values()]
    tables["classes"] = class_table(chosen, strength_and_size_classes(columns), ratio=False)
    magnitudes = {
        words: [blocks.of_magnitude(low, high).kr_from(REAL_KR) for blocks in columns]
        for words, low, high in magnitude_classes()
    }
    tables["magnitudes"] = class_table(chosen, magnitudes, ratio=True)
    return tables


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables, and keep them if asked to."""
    options = parser(__doc__)
    options.add_argument("--db", default=str(REFERENCE), help="database with outcomes and models")
    options.add_argument("--aims", action="store_true", help="only the table of aims")
    options.add_argument("--kind", choices=list(PAGES), help="only models of one kind")
    options.add_argument("--model", action="append", help="only the named models")
    chosen = options.parse_args(arguments)
    models = StoredModels(chosen.db, read_models(chosen.db))
    terms = {name: row.term for name, row in models.rows.items()}
    predicted: dict[str, dict[MeasureSet, Predicted]] = {}
    missed = 0
    for kind in PAGES if chosen.kind is None else [chosen.kind]:
        names = [name for name, aims in MODELS.items() if aims.kind == kind]
        names = [name for name in names if name in (chosen.model or MODELS)]
        if not names:
            continue
        predictions = predictions_of(models, names)
        predicted |= predictions
        marks = [
            mark
            for name in names
            for mark in model_marks(name, models.rows.get(name), predictions[name])
        ]
        missed += sum(not mark.is_reached for mark in marks)
        tables = {"aims": acceptance_table(marks)}
        if not chosen.aims and kind != "sliding":
            tables |= tables_of(kind, predictions, terms)
        for name, table in tables.items():
            print(f"## {kind}: {name}\n\n{table}\n", flush=True)
            if chosen.write:
                write_table(PAGES[kind], name, table)
    if not chosen.aims and {"toppling-sa", "rocking-sa"} <= predicted.keys():
        table = asked_for_table(predicted)
        print(f"## asked for\n\n{table}")
        if chosen.write:
            write_table(EVIDENCE, "asked-for", table)
    print(f"{missed} aims missed")
    if chosen.aims and missed:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
