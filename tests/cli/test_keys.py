"""Every key of a JSON document is declared in the vocabulary."""

from __future__ import annotations

import inspect
import json
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from rbfrag.service import documents
from rbfrag.vocabulary.quantities import QUANTITIES
from rbfrag.vocabulary.results import RESULT_GROUPS, RESULTS
from tests.cli.conftest import Shell

ROOT = Path(__file__).resolve().parent.parent.parent

BY_DATA = {"combinations_by_status", "domain", "impossible", "modes", "other_models", "rows",
    "sa_g", "uncovered_share", "variables",
}  # fmt: skip
"""Keys of objects whose own keys are data: names of modes, tables, variables and reasons."""

CURVE = f"{ROOT}/examples/pgv-curve.csv"
EVENTS = f"{ROOT}/docs/examples/event-set"
MASS = f"{ROOT}/docs/examples/rockmass.toml"
COMMANDS = (
    "block --height 2 --width .4 --dip 10 --phi 35 --water .3 --density 2600",
    "critical RECORD --height 2 --width .5",
    "critical RECORD --p2 3 --map",
    "db info --db REFERENCE",
    f"hazard {CURVE} --height 2 --width .4 --phi 40 --water .3 --density 2600",
    f"losses {EVENTS} --blocks {EVENTS}/blocks.csv",
    "models list",
    "motions show RECORD",
    "predict --height 2 --width .4 --phi 40 --water .5 --density 2600 --pgv .6 --pga .4",
    "predict --height 2 --width .4 --motion RECORD --polarity both",
    "predict --height 2 --width .4 --magnitude 6.8 --rjb 12 --vs30 760 --sites 5",
    "predict --blocks TABLE --pgv .6",
    "respond RECORD --height 2 --width .4 --kind rocking",
    "respond RECORD --ky .1",
    f"rockmass {MASS} --n 200 --pgv .5 --pga .4",
    "scenario --magnitude 6.8 --rjb 12 --vs30 760",
    "spectrum RECORD --p2 30,3",
    f"survival {CURVE} --p2 3 --kr .1 --kind rocking --age 10000",
)


def keys(value: Any, of: str = "") -> Iterator[str]:
    """Yield the keys of a document that are not data."""
    for part in value if isinstance(value, list) else ():
        yield from keys(part, of)
    for key, part in value.items() if isinstance(value, dict) else ():
        if of not in BY_DATA:
            yield key
        yield from keys(part, key if of not in BY_DATA else "")


def test_keys_of_data_are_set_aside() -> None:
    document = {"modes": {"slide": {"count": 1}}, "blocks": [{"mode": "slide"}]}
    assert {*keys(document)} == {"modes", "count", "blocks", "mode"}


@pytest.mark.parametrize("command", COMMANDS)
def test_keys_of_documents_are_quantities(shell: Shell, record: Path, command: str) -> None:
    table = Path("table.csv")
    table.write_text("name,height_m,width_m\na,2,.4\nb,1,\n")
    files = {
        "RECORD": record, "TABLE": table, "REFERENCE": ROOT / "rbfrag/reference/reference.db",
    }  # fmt: skip
    words = [files.get(word, word) for word in shlex.split(command)]
    document = json.loads(shell(*words, "--json").stdout)
    assert [name for name in keys(document) if name not in RESULTS] == []


def test_keys_of_the_service_are_quantities() -> None:
    models = [
        model
        for _, model in inspect.getmembers(documents, inspect.isclass)
        if issubclass(model, BaseModel)
    ]
    assert len(models) > 15
    for model in models:
        names = {field.alias or name for name, field in model.model_fields.items()}
        assert names - {*RESULTS} == set(), model


def test_each_key_is_declared_once() -> None:
    names = [about.name for group in RESULT_GROUPS.values() for about in group]
    assert len(names) == len({*names} - {*QUANTITIES})
