"""`Result`: base class of answers, which every interface shows in the same words.

The class of an answer states its sentences, its labelled lines and its tables; the command line,
HTTP, the web page, reports and notebooks print these and write none of their own. The design
follows result objects such as those of statsmodels (``summary()``): numbers and their presentation
belong to one object, so that a warning cannot be lost on the way to one of the outputs.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from rbfrag.results.diagnostic import labelled, with_diagnostics

if TYPE_CHECKING:
    import pandas as pd


class TextLine(NamedTuple):
    """A labelled line of an answer: "Model     toppling-pgv, …"; an empty label continues."""

    label: str
    text: str


class TextTable(NamedTuple):
    """A table for a terminal; without headers, its rows are names and values."""

    headers: Sequence[str]
    rows: Sequence[Sequence[object]]
    title: str = ""

    @classmethod
    def of_values(cls, document: Mapping[str, Any]) -> TextTable:
        """Return the numbers and texts of a document, nested ones by their path, without lists."""
        rows: list[tuple[str, object]] = []
        for name, value in document.items():
            if isinstance(value, Mapping):
                rows += [(f"{name}.{key}", nested) for key, nested in cls.of_values(value).rows]
            elif not isinstance(value, list):
                rows.append((name, value))
        return cls((), rows)

    @classmethod
    def of_rows(
        cls, rows: Sequence[Mapping[str, object]], *, verbose: bool = False, title: str = ""
    ) -> TextTable:
        """Return rows with column names, without empty columns.

        Args:
            rows: values by name, the same names in each.
            verbose: with all digits; else three significant digits.
            title: title of the table.
        """
        names = [name for name in rows[0] if any(row[name] not in (None, "") for row in rows)]

        def printed(value: object) -> object:
            return value if verbose or not isinstance(value, float) else float(f"{value:.3g}")

        return cls(names, [[printed(row[name]) for name in names] for row in rows], title)


class Tabular:
    """An answer that can be converted to a table: one row, or one for each element of its arrays.

    Base of dataclasses.
    """

    def table_columns(self) -> Mapping[str, Any]:
        """Return the columns by name; arrays are flat."""
        from rbfrag.frames import columns_of

        return columns_of(self)

    def to_frame(self) -> pd.DataFrame:
        """Return the answer as a pandas DataFrame, with the names and units of its fields."""
        from rbfrag.frames import frame_of

        return frame_of(self.table_columns())

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yield the rows, so that ``pandas.DataFrame(answer)`` is the same table."""
        yield from self.to_frame().to_dict("records")

    def _repr_html_(self) -> str:
        """Return the HTML table for a notebook."""
        from rbfrag.frames import html_of

        return html_of(self.to_frame())

    def __repr__(self) -> str:
        """Return name and columns on one line; for arrays, their length."""
        parts = (
            f"{name}=[{value.size} values]" if hasattr(value, "ravel") else f"{name}={value!r}"
            for name, value in self.table_columns().items()
            if value is not None
        )
        return f"{type(self).__name__}({', '.join(parts)})"


class Result(Tabular, ABC):
    """Base class of the answers; a subclass is a dataclass with ``warnings``."""

    warnings: Sequence[str]

    @abstractmethod
    def sentences(self) -> Iterator[str]:
        """Yield the headline: the main number with its interval, and related numbers."""

    def headline(self) -> str:
        """Return the main number with its interval."""
        return next(self.sentences())

    def lines(self) -> Iterator[TextLine]:
        """Yield labelled lines: the inputs and the model."""
        return iter(())

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield tables for the terminal.

        Args:
            verbose: with every value.
        """
        if verbose:
            yield TextTable.of_values(self.as_dict())

    @abstractmethod
    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""

    def _repr_html_(self) -> str:
        """Return the answer for a notebook: sentences, lines, warnings, numbers."""
        from html import escape

        lines = (f"{label}: {text}" if label else text for label, text in self.lines())
        texts = (*self.sentences(), *lines, *labelled(self.warnings))
        first, *rest = map(escape, texts)
        body = "<br>".join((f"<b>{first}</b>", *rest))
        return f"<p>{body}</p>{super()._repr_html_()}"

    def document(self, *, text: bool = False) -> dict[str, Any]:
        """Return the JSON document: the keys of the contract and ``diagnostics``.

        Args:
            text: with the sentences and labelled lines under ``text``.
        """
        document: dict[str, Any] = with_diagnostics(self.as_dict())
        if text:
            lines = [line._asdict() for line in self.lines()]
            document["text"] = {"sentences": [*self.sentences()], "lines": lines}
        return document


class ResultList(Result):
    """Base of answers that list things: rows under the same names."""

    warnings: Sequence[str] = ()

    def rows(self) -> list[dict[str, Any]]:
        """Return the rows under the keys of the JSON contract."""
        raise NotImplementedError

    def as_dict(self) -> Any:
        """Return the rows, which are the JSON document."""
        return self.rows()

    def to_frame(self) -> pd.DataFrame:
        """Return the rows as a pandas table."""
        from rbfrag.frames import frame_of_rows

        return frame_of_rows(self.rows())
