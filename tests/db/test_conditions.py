"""Conditions over columns of the view `outcome`: the rows of SQL and of pandas, and no others."""

from __future__ import annotations

import ast
import builtins
import operator
import random
from collections.abc import Callable
from contextlib import suppress
from itertools import islice
from typing import Any

import pandas as pd
import pytest
from sqlalchemy import Engine, case, select, text, update

from rbfrag.db import schema
from rbfrag.db.conditions import (
    condition_of_combinations,
    condition_of_motions,
    parsed_condition,
)
from rbfrag.db.views import OF_BLOCK, OF_COMBINATION, OF_MOTION, VIEW_QUERIES
from rbfrag.errors import InputError

ALL = (*OF_BLOCK, *OF_COMBINATION, *OF_MOTION)

EXPRESSIONS = 10_000

NUMBERS = ("pga_g", "pgv_m_s", "p2", "kr", "failed", "magnitude", "vs30_m_s", "rjb_km", "grid")
TEXTS = ("kind", "polarity", "mechanism", "event_id", "outcome")
TRUTHS = ("event_guessed", "on_structure", "linear", "sensitive")


@pytest.fixture
def rows(filled: Engine) -> Engine:
    """A database with several motions, of which some lack metadata."""
    with filled.begin() as connection:
        connection.execute(update(schema.earthquake).values(mechanism="reverse", magnitude=6.5))
        first = select(schema.earthquake.c.id).order_by(schema.earthquake.c.id).limit(1)
        single = schema.earthquake.c.id == first.scalar_subquery()
        connection.execute(update(schema.earthquake).where(single).values(mechanism=None))
        first = select(schema.recording.c.id).order_by(schema.recording.c.id).limit(1)
        other = schema.recording.c.id != first.scalar_subquery()
        connection.execute(update(schema.recording).where(other).values(vs30_m_s=450.0, rjb_km=8.0))
    return filled


KEY = ["combination_id", "kr_over_pga"]


def selected(engine: Engine, condition: str) -> set[tuple[Any, ...]]:
    keys = (schema.simulation.c[name] for name in KEY)
    query = VIEW_QUERIES["outcome"].with_only_columns(*keys)
    with engine.connect() as connection:
        return {*map(tuple, connection.execute(query.where(parsed_condition(condition, ALL))))}


def frame_of(engine: Engine) -> pd.DataFrame:
    with engine.connect() as connection:
        frame = pd.read_sql_query(
            text("SELECT * FROM outcome ORDER BY combination_id, kr_over_pga"), connection
        )
    for name in frame:
        kind = "boolean" if name in TRUTHS else "Float64" if name in NUMBERS else "string"
        if name not in KEY:
            frame[name] = frame[name].astype(kind)
    return frame


OPERATORS: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.Eq: operator.eq, ast.NotEq: operator.ne,
}  # fmt: skip


def evaluated(node: ast.expr, frame: pd.DataFrame) -> Any:
    """Return the truth of a condition by pandas, with its logic of three values."""
    if isinstance(node, ast.BoolOp):
        parts = [evaluated(value, frame) for value in node.values]
        result = parts[0]
        for part in parts[1:]:
            result = result & part if isinstance(node.op, ast.And) else result | part
        return result
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return ~evaluated(node.operand, frame)
    if isinstance(node, ast.Name):
        return frame[node.id]
    assert isinstance(node, ast.Compare)
    operands = [node.left, *node.comparators]
    result = pd.Series(True, index=frame.index, dtype="boolean")
    for lhs, op, right in zip(operands, node.ops, operands[1:], strict=False):
        first = frame[lhs.id] if isinstance(lhs, ast.Name) else ast.literal_eval(lhs)
        if isinstance(op, ast.In | ast.NotIn):
            part = first.isin(list(ast.literal_eval(right))).astype("boolean")
            part = (part if isinstance(op, ast.In) else ~part).mask(first.isna(), pd.NA)
        else:
            second = frame[right.id] if isinstance(right, ast.Name) else ast.literal_eval(right)
            part = OPERATORS[type(op)](first, second)
        result &= part.astype("boolean")
    return result


def drawn(draw: random.Random, depth: int = 0) -> str:
    """Return a random expression, much of which is no condition."""
    if depth < 3 and draw.random() < 0.55:
        form = draw.choice(("{} and {}", "{} or {}", "not {}", "({})", "({}) or not ({})"))
        return form.format(drawn(draw, depth + 1), drawn(draw, depth + 1))
    if draw.random() < 0.07:
        return draw.choice(
            ("sentinel()", "sentinel(p2) > 1", "kind.sentinel", "[sentinel() for _ in (1,)] == 1",
             "p2 + 1 > 2", "p2 if sentinel() else 1", "(x := sentinel())", "lambda: sentinel()",
             "kind[0] == 'a'", "f'{sentinel()}' == kind", "__import__('os') == 1", "p2 > 1 > kind",
             "p2 is None", "p2 >", "p3 > 1", "1", "'a'", "p2", "p2 in ()", "p2 in 3", "1e999 > p2",
             "p2 > 1j", "kind < 'a'", "kind == 1", "p2 == 'a'", "*p2", "await p2", "p2 = 1", "\x00",
             "{sentinel(): 1} == p2", "b'a' == kind", "... == p2", "p2 == (1,)", "- -p2 < 1")
        )  # fmt: skip
    sort = draw.randrange(6)
    number = draw.choice(("0", "1", "3", "0.05", "0.5", "-1", "6.5", "450", "1e3", "+8.0"))
    name, compare = draw.choice(NUMBERS), draw.choice(("<", "<=", ">", ">=", "==", "!="))
    if sort == 0:
        return f"{number} {draw.choice(('<', '<='))} {name} {compare} {draw.choice(NUMBERS)}"
    if sort == 1:
        return f"{name} {compare} {number}"
    if sort == 2:
        return f"{name} {draw.choice(('in', 'not in'))} ({number}, 3.0, 6.5)"
    if sort == 3:
        value = draw.choice(("toppling", "forward", "reverse", "stable", "it's", "%"))
        return f"{draw.choice(TEXTS)} {draw.choice(('==', '!='))} {value!r}"
    if sort == 4:
        return f"{draw.choice(TEXTS)} {draw.choice(('in', 'not in'))} ['reverse', 'toppled', '']"
    truth = draw.choice(TRUTHS)
    return draw.choice((truth, f"{truth} == True", f"{truth} != False", f"not {truth}"))


@pytest.fixture
def sentinel(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    calls: list[object] = []
    monkeypatch.setattr(builtins, "sentinel", lambda *values: calls.append(values), raising=False)
    return calls


def test_random_conditions_are_rejected_or_select_the_rows_of_pandas(
    rows: Engine, sentinel: list[object]
) -> None:
    frame, draw = frame_of(rows), random.Random(5)
    accepted = {}
    for _ in range(EXPRESSIONS):
        condition = drawn(draw)
        with suppress(InputError):
            accepted[condition] = parsed_condition(condition, ALL)
    assert 0.3 * EXPRESSIONS < len(accepted) < 0.9 * EXPRESSIONS
    conditions, sizes = iter(accepted.items()), set()
    keys = [schema.simulation.c[name] for name in KEY]
    while part := list(islice(conditions, 100)):  # each as a column, which costs less than a query
        query = VIEW_QUERIES["outcome"].with_only_columns(
            *keys, *(case((sql, 1)) for _, sql in part)
        )
        with rows.connect() as connection:
            table = [tuple(row) for row in connection.execute(query.order_by(*keys))]
        for number, (condition, _) in enumerate(part, 2):
            truth = evaluated(ast.parse(condition.strip(), mode="eval").body, frame)
            expected = frame.loc[truth.fillna(False).astype(bool), KEY]
            values = [row[:2] for row in table if row[number]]
            assert values == [*expected.itertuples(index=False, name=None)], condition
            sizes.add(len(values))
    assert len(sizes) > 10
    assert sentinel == []


@pytest.mark.parametrize(
    ("condition", "sql"),
    [
        ("vs30_m_s > 400 and magnitude >= 6", "vs30_m_s > 400 AND magnitude >= 6"),
        ("not vs30_m_s > 400", "NOT vs30_m_s > 400"),
        ("mechanism not in ('normal', 'x')", "mechanism NOT IN ('normal', 'x')"),
        ("0.01 < kr < 0.2 or failed == 1", "(0.01 < kr AND kr < 0.2) OR failed = 1"),
    ],
)
def test_a_condition_selects_the_rows_of_its_sql(rows: Engine, condition: str, sql: str) -> None:
    query = f"SELECT combination_id, kr_over_pga FROM outcome WHERE {sql}"
    with rows.connect() as connection:
        expected = {tuple(row) for row in connection.execute(text(query))}
    assert selected(rows, condition) == expected


@pytest.mark.parametrize(
    ("condition", "words"),
    [
        ("vs30 > 600", "character 1: unknown column 'vs30'; did you mean 'vs30_m_s'?"),
        ("p2 > 1 and kind < 'a'", "character 19: a text has no order: use ==, != or in"),
        ("event == 'é' and abs(p2) > 1", "character 18: call is not supported"),
        ("p2 > 1 and", "character 11: invalid syntax; use columns"),
        ("1 < 2", "character 1: one side of a comparison must be a column"),
        ("p2 == 'a'", "character 7: a number is compared with a text"),
        ("p2", "character 1: p2 is a number: compare it with a value"),
        ("not " * 40 + "linear", "nested more than 30 levels deep"),
        ("p2 > 1 or " * 300 + "p2 < 1", "characters are too many: give at most 2000"),
    ],
)
def test_anything_else_is_rejected_with_its_position(condition: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        parsed_condition(condition, ALL)
    assert words in str(caught.value)


def test_columns_that_an_answer_does_not_have_are_rejected_with_the_reason() -> None:
    with pytest.raises(InputError, match="'p2' depends on simulations, which are still to be"):
        condition_of_motions("p2 > 1")
    with pytest.raises(InputError, match="'failed' is of single blocks, but a fit uses all"):
        condition_of_combinations("failed == 1")
