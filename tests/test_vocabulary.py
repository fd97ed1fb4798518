"""The vocabulary: what it loads, what types say of it, and that its facts stand nowhere else."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Collection

import pytest

from rbfrag.question import fields
from rbfrag.vocabulary import quantities
from rbfrag.vocabulary.quantities import (
    INPUTS,
    MEASURES,
    PANELS,
    QUANTITIES,
    name_of,
    option_of,
    word_of,
)

GROUPS: list[tuple[type, Collection[str]]] = [
    (fields.BlockFields, quantities.BLOCK),
    (fields.MeasureFields, quantities.INTENSITY),
    (fields.ShakingFields, quantities.SHAKING),
    (fields.SourceFields, quantities.SOURCE),
    (fields.WholeFields, quantities.COMMON),
    (fields.AnsweringFields, quantities.ANSWERING),
    (fields.RangeFields, quantities.RANGE),
    (fields.QuestionFields, quantities.QUESTION),
    (fields.BlockKeywords, quantities.BLOCKS),
]


@pytest.mark.parametrize(("types", "names"), GROUPS, ids=lambda item: getattr(item, "__name__", ""))
def test_types_are_declared_for_the_same_inputs(types: type, names: Collection[str]) -> None:
    assert {*types.__annotations__} == {*names}


@pytest.mark.parametrize("module", ["quantities", "results", "headers"])
def test_the_vocabulary_loads_no_library(module: str) -> None:
    program = (
        f"import sys; before = set(sys.modules); import rbfrag.vocabulary.{module}; "
        "print(*set(sys.modules) - before)"
    )
    process = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    loaded = set(process.stdout.split())
    assert len(loaded) <= 40
    assert not loaded & {"numpy", "typing", "re", "dataclasses"}


def test_every_name_and_alias_means_one_quantity() -> None:
    for name in INPUTS:
        assert name_of(word_of(name)) == name
        assert option_of(name).startswith("--")
    aliases = [alias for value in INPUTS.values() for alias in value.aliases if alias != "block"]
    assert len(aliases) == len({*aliases})


def test_every_input_of_the_command_line_has_a_heading() -> None:
    names = {name for group in PANELS.values() for name in group}
    assert {*quantities.QUESTION, *quantities.AT_REST} - {*quantities.ARRAYS} <= names


def test_help_has_label_unit_detail_and_default() -> None:
    assert QUANTITIES["restitution"].help(option_of) == (
        "Coefficient of restitution of a rocking block, 0–1 "
        "[default: from conservation of angular momentum]"
    )
    assert QUANTITIES["width_m"].help(option_of) == (
        "Width of a rectangle along its base, with --height [m]"
    )


def test_measures_have_a_range_and_a_unit() -> None:
    for name in MEASURES:
        assert QUANTITIES[name].unit or name == "magnitude"
    for quantity in QUANTITIES.values():
        if quantity.credible is not None:
            low, high, hint = quantity.credible
            assert low < high
            assert hint
