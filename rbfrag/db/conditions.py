"""Conditions over the columns of the view `outcome`, such as ``vs30_m_s > 600 and p2 < 3``.

The text is read as a Python expression and turned into SQL; nothing of it is ever run. A row in
which a compared column is missing is not selected, not under ``not`` either: the logic is SQL's,
with three values.
"""

from __future__ import annotations

import ast
import operator
import warnings
from collections.abc import Callable, Mapping
from typing import Any

from sqlalchemy import Boolean, ColumnElement, Double, Integer, and_, literal, not_, or_

from rbfrag.db.views import OF_BLOCK, OF_COMBINATION, OF_MOTION, Shown
from rbfrag.errors import InputError

MOST_CHARACTERS = 2_000
LARGEST = 1e300
DEEPEST = 30
"""Levels of nesting: some builds of SQLite parse no more than a hundred."""

GRAMMAR = "columns, numbers, texts, comparisons, and, or, not, in"

_COMPARISONS: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_ORDER = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)
_NO_OUTCOME = "depends on simulations, which are still to be made: use columns of motions"
_WHOLE_COMBINATION = "is of single blocks, but a fit uses all blocks of a motion: omit it"


def condition_of_motions(text: str) -> ColumnElement[bool]:
    """Return a condition over motions with their recordings and earthquakes.

    Raises:
        InputError: anything but :data:`GRAMMAR`, with its position; an unknown column, or one of
            simulated blocks.
    """
    excluded = {about.name: _NO_OUTCOME for about, _ in (*OF_BLOCK, *OF_COMBINATION)}
    return parsed_condition(text, OF_MOTION, excluded)


def condition_of_combinations(text: str) -> ColumnElement[bool]:
    """Return a condition over combinations with their motions.

    Raises:
        InputError: as for :func:`condition_of_motions`; a column of single blocks.
    """
    excluded = {about.name: _WHOLE_COMBINATION for about, _ in OF_BLOCK}
    return parsed_condition(text, (*OF_COMBINATION, *OF_MOTION), excluded)


def parsed_condition(
    text: str, shown: tuple[Shown, ...], excluded: Mapping[str, str] | None = None
) -> ColumnElement[bool]:
    """Return the SQL of a condition.

    Args:
        shown: the columns that it may use, and what each is computed from.
        excluded: why further columns are rejected, by name.

    Raises:
        InputError: anything but :data:`GRAMMAR`, with its position.
    """
    if len(text) > MOST_CHARACTERS:
        raise _rejected(f"{len(text)} characters are too many: give at most {MOST_CHARACTERS}")
    source = " ".join(text.splitlines()).strip()
    try:
        with warnings.catch_warnings(action="ignore"):  # of escapes that Python deprecates
            tree = ast.parse(source, mode="eval")
    except SyntaxError as error:
        position = error.offset or len(source) + 1  # 0 stands for the end
        raise _rejected(f"character {position}: {error.msg}; use {GRAMMAR}") from None
    except (ValueError, MemoryError, RecursionError) as error:  # NUL, or nested too deeply
        raise _rejected(f"it cannot be parsed ({error}); use {GRAMMAR}") from None
    return _Compiler(source, shown, excluded or {}).condition(tree.body)


def _rejected(reason: str) -> InputError:
    return InputError(f"where: {reason}", fields=("where",))


def _kind(about: Any) -> str:
    if isinstance(about.type, Boolean):
        return "true/false"
    return "number" if isinstance(about.type, Double | Integer) else "text"


class _Compiler:
    """Translation of one expression."""

    def __init__(self, source: str, shown: tuple[Shown, ...], excluded: Mapping[str, str]) -> None:
        self._source, self._excluded = source, excluded
        self._columns = {about.name: (expression, _kind(about)) for about, expression in shown}

    def condition(self, node: ast.expr, depth: int = 0) -> ColumnElement[bool]:
        """Return the SQL of a node that is true or false."""
        if depth > DEEPEST:
            raise self._error(node, f"nested more than {DEEPEST} levels deep")
        if isinstance(node, ast.BoolOp):
            parts = [self.condition(value, depth + 1) for value in node.values]
            return and_(*parts) if isinstance(node.op, ast.And) else or_(*parts)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return not_(self.condition(node.operand, depth + 1))
        if isinstance(node, ast.Compare):
            operands = [node.left, *node.comparators]
            pairs = zip(operands, node.ops, operands[1:], strict=False)
            return and_(*(self._compared(*pair) for pair in pairs))
        if isinstance(node, ast.Name):
            expression, kind = self._column(node)
            if kind == "true/false":
                return expression
            raise self._error(node, f"{node.id} is a {kind}: compare it with a value")
        raise self._error(node, f"{type(node).__name__.lower()} is not a condition; use {GRAMMAR}")

    def _compared(self, lhs: ast.expr, op: ast.cmpop, rhs: ast.expr) -> ColumnElement[bool]:
        if isinstance(op, ast.In | ast.NotIn):
            expression, kind = self._column(lhs)
            values = self._list(rhs, kind)
            return expression.in_(values) if isinstance(op, ast.In) else expression.not_in(values)
        if type(op) not in _COMPARISONS:
            raise self._error(rhs, "only ==, !=, <, <=, >, >= and in compare")
        (first, kind), (second, other) = self._operand(lhs), self._operand(rhs)
        if not isinstance(lhs, ast.Name) and not isinstance(rhs, ast.Name):
            raise self._error(lhs, "one side of a comparison must be a column")
        if kind != other:
            raise self._error(rhs, f"a {kind} is compared with a {other}")
        if kind != "number" and isinstance(op, _ORDER):
            raise self._error(rhs, f"a {kind} has no order: use ==, != or in")
        compared: ColumnElement[bool] = _COMPARISONS[type(op)](first, second)
        return compared

    def _operand(self, node: ast.expr) -> tuple[Any, str]:
        return self._column(node) if isinstance(node, ast.Name) else self._constant(node)

    def _column(self, node: ast.expr) -> tuple[ColumnElement[Any], str]:
        if not isinstance(node, ast.Name):
            raise self._error(node, "a column is required")
        name = node.id
        if name in self._columns:
            return self._columns[name]
        if name in self._excluded:
            raise self._error(node, f"column {name!r} {self._excluded[name]}")
        from difflib import get_close_matches

        near = get_close_matches(name, self._columns, 1)
        hint = f"did you mean {near[0]!r}?" if near else "see the view outcome in the dictionary"
        raise self._error(node, f"unknown column {name[:60]!r}; {hint}")

    def _list(self, node: ast.expr, kind: str) -> list[Any]:
        if not isinstance(node, ast.Tuple | ast.List | ast.Set) or not node.elts:
            raise self._error(node, "values in brackets are required, such as (1, 2)")
        constants = [self._constant(element) for element in node.elts]
        for element, (_, other) in zip(node.elts, constants, strict=True):
            if other != kind:
                raise self._error(element, f"a {kind} is compared with a {other}")
        return [value for value, _ in constants]

    def _constant(self, node: ast.expr) -> tuple[Any, str]:
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            value, kind = self._constant(node.operand)
            if kind != "number" or isinstance(node.operand, ast.UnaryOp):
                raise self._error(node, "a sign requires a number")
            return (-value if isinstance(node.op, ast.USub) else value), kind
        if isinstance(node, ast.Constant):
            value = node.value
            if isinstance(value, bool):
                return value, "true/false"
            if isinstance(value, str):
                if not value.isprintable():
                    raise self._error(node, "a text must be printable")
                return value, "text"
            if isinstance(value, int | float):
                if not abs(value) <= LARGEST:
                    raise self._error(node, "a number must be finite")
                return literal(float(value), Double()), "number"
        raise self._error(node, f"{type(node).__name__.lower()} is not supported; use {GRAMMAR}")

    def _error(self, node: ast.expr, reason: str) -> InputError:
        before = self._source.encode()[: node.col_offset].decode()
        return _rejected(f"character {len(before) + 1}: {reason}")
