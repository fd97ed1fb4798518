"""Output of commands: JSON for scripts, tables for people, progress of long commands."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cache
from os import PathLike
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Any

from rbfrag.errors import InputError, spelled
from rbfrag.results.diagnostic import Diagnostic, by_severity, with_diagnostics
from rbfrag.vocabulary.quantities import OTHER_WORDS, QUESTION, option_of

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress

    from rbfrag.results.result import Result

OPTION_FIELDS = tuple(name for name in QUESTION if "_" in name)
"""Inputs that notes name as Python does; a name without a unit is an everyday word."""


def print_json(document: object) -> None:
    """Print one JSON document on standard output."""
    document = with_diagnostics(document)
    print(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False))


def print_pairs(pairs: Mapping[str, object]) -> None:
    """Print names and values in two columns; None is shown as a dash."""
    width = max(map(len, pairs), default=0)
    for name, value in pairs.items():
        print(f"{name:<{width}}  {cell(value)}")


def print_table(
    headers: Sequence[str], rows: Iterable[Sequence[object]], *, width: int | None = None
) -> None:
    """Print a table: numbers right-aligned, text left-aligned.

    Args:
        headers: names of the columns.
        rows: their cells.
        width: characters of a line, to which the longest texts are cut; None for all there is.
    """
    table = [[cell(value) for value in row] for row in rows]
    numeric = [
        all(_is_number(row[i]) for row in table) and bool(table) for i in range(len(headers))
    ]
    widths = [
        max([len(header), *(len(row[i]) for row in table)]) for i, header in enumerate(headers)
    ]
    while width is not None and sum(widths) + 2 * (len(widths) - 1) > width:
        texts = [i for i in range(len(widths)) if not numeric[i] and widths[i] > len(headers[i])]
        if not texts:
            break
        widths[max(texts, key=widths.__getitem__)] -= 1
    for line in [list(headers), *table]:
        fields = (
            _cut(text, size).rjust(size) if right else _cut(text, size).ljust(size)
            for text, size, right in zip(line, widths, numeric, strict=True)
        )
        print("  ".join(fields).rstrip())


def print_rows(rows: Sequence[Mapping[str, object]]) -> None:
    """Print rows below their column names, cut to the terminal width; reasons only if there are
    any.
    """
    names = [name for name in rows[0] if name != "reason" or any(row[name] for row in rows)]
    width = get_terminal_size().columns if sys.stdout.isatty() else None
    print_table(names, [[row[name] for name in names] for row in rows], width=width)


def _cut(text: str, size: int) -> str:
    return text if len(text) <= size else f"{text[: size - 1]}…"


def print_result(
    result: Result, *, json: bool, verbose: bool = False, fields: Collection[str] = OPTION_FIELDS
) -> None:
    """Print an answer: headline, labelled lines, notes, tables.

    Args:
        result: the answer.
        json: as one JSON document.
        verbose: with every value.
        fields: names in notes that are printed as options.
    """
    if json:
        print_json(result.as_dict())
        return
    notes = by_severity(result.warnings)
    questions = [note for note in notes if note.code == "check_unit"]
    sentences = [*result.sentences()]
    print(*questions, *sentences, "", sep="\n")
    for label, text in result.lines():
        print_labelled(label, text)
    for note in notes:
        if note not in questions and not any(note in sentence for sentence in sentences):
            print_warning(note, fields)
    width = get_terminal_size().columns if sys.stdout.isatty() else None
    is_first = not notes and not any(result.lines())
    for table in result.tables(verbose=verbose):
        if not is_first:
            print()
        is_first = False
        if table.title:
            print(table.title)
        if table.headers:
            print_table(table.headers, table.rows, width=width)
        else:
            print_pairs({str(name): value for name, value in table.rows})


def typed_option(name: str) -> str:
    """Return the option of an input, by its other word if the command line has that."""
    by_name = {of: f"--{word.replace('_', '-')}" for word, of in OTHER_WORDS.items()}
    typed = {argument.partition("=")[0] for argument in sys.argv[1:]}
    is_typed = name in by_name and typed & {*by_name.values()}
    return by_name[name] if is_typed else option_of(name)


def print_labelled(label: str, text: str) -> None:
    """Print a line of an answer with its label: "Model     toppling-pgv, …"."""
    print(f"{label:<9} {spelled(text, (), typed_option)}")


def print_warnings(warnings: Iterable[str], fields: Collection[str] = ()) -> None:
    """Print warnings as notes below an answer, one per line, with fields as options."""
    for i, warning in enumerate(by_severity(warnings)):
        if i == 0:
            print()
        print_warning(warning, fields)


def print_warning(warning: Diagnostic, fields: Collection[str] = ()) -> None:
    """Print a warning or note with its label, and with fields as options."""
    print_labelled(warning.label, spelled(warning, ("excel_text", *fields), typed_option))


def write_table(
    columns: Mapping[str, Any],
    out: str | PathLike[str],
    *,
    excel_text: bool,
    notes: Sequence[str] = (),
) -> None:
    """Write the table of a command with its warnings; warn of texts that spreadsheets read as
    formulas.
    """
    from rbfrag.exchange.tables.csv_file import formula_warnings
    from rbfrag.exchange.tables.files import write_block_table

    formulas: tuple[str, ...] = ()
    if not excel_text and str(out).lower().endswith(".csv"):
        formulas = tuple(formula_warnings(columns))
    write_block_table(columns, out, excel_text=excel_text, notes=(*notes, *formulas))
    for text in formulas:  # they stand with the table; standard output may be a JSON document
        print(f"warning: {spelled(text, ('excel_text',), option_of)}", file=sys.stderr)


@cache
def say_when_compiling() -> None:
    """Explain once why the first answer takes long: kernels are compiled on this machine."""
    from rbfrag.solver.integrator.compiled import on_compilation

    on_compilation(_announce_compilation)


# worker processes receive it by its name
def _announce_compilation() -> None:
    from rbfrag.solver.integrator.compiled import where_kept

    text = f"compiling the kernels for this machine; this happens {where_kept() or 'once'}"
    print(text, file=sys.stderr, flush=True)


def check_files(
    *, table: str | None = None, plot: str | None = None, excel_text: bool = False
) -> None:
    """Reject an output table or figure that cannot be written, before long work."""
    if excel_text and table is not None and not table.lower().endswith(".csv"):
        raise InputError(f"--excel-text applies to CSV output only, not to {table}: omit it")
    if table is not None:
        from rbfrag.exchange.tables.files import table_path

        table_path(table)
    if plot is not None:
        from rbfrag.plots.canvas import plot_path

        plot_path(plot)


def cell(value: object) -> str:
    """Format a value for a table: six digits, a dash for None."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (list, tuple)):
        return ", ".join(cell(item) for item in value) or "-"
    return str(value)


def _is_number(text: str) -> bool:
    if text == "-":
        return True
    try:
        float(text)
    except ValueError:
        return False
    return True


SECONDS_BETWEEN_LINES = 5.0
"""Pause between two lines where there is no terminal for a bar [s]."""


class ProgressBar:
    """Progress of a command: a bar with rate and remaining time on a terminal, lines elsewhere.

    Args:
        command: the command that is under way.
        things: what is counted.
        on_lines: whether to say it where there is no terminal.
    """

    def __init__(self, command: str, things: str, *, on_lines: bool = True) -> None:
        self._command = command
        self._things = things
        self._on_lines = on_lines
        self._bar: RichProgress | None = None
        self._task: Any = None
        self._first = 0
        self._started = 0.0
        self._last: float | None = None

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def show(self, completed: int, total: int, remark: str = "") -> None:
        """Show the progress; the first call counts as completed before the start."""
        now = time.monotonic()
        if self._last is None:
            self._first, self._started = completed, now
        rate = (completed - self._first) / (now - self._started) if now > self._started else 0.0
        about = f" {self._things}" + (f" ({remark})" if remark else "")
        if sys.stderr.isatty() or self._bar is not None:
            self._show_bar(completed, total, about, rate)
        elif not self._on_lines:
            return
        elif self._last is None or completed == total or now - self._last >= SECONDS_BETWEEN_LINES:
            text = f"{self._command}: {completed}/{total}{about}"
            if rate:
                text += f", {rate:.1f} per second"
                seconds = int((total - completed) / rate)
                text += f", {seconds // 60}:{seconds % 60:02d} left" if completed < total else ""
            print(text, file=sys.stderr, flush=True)
        else:
            return
        self._last = now

    def _show_bar(self, completed: int, total: int, about: str, rate: float) -> None:
        per_second = f"{rate:.1f} per second" if rate else ""
        if self._bar is None:
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
            from rich.progress import TimeRemainingColumn as TimeLeft

            self._bar = Progress(
                TextColumn("{task.description}:"), BarColumn(), MofNCompleteColumn(),
                TextColumn("{task.fields[about]}"), TextColumn("{task.fields[rate]}"), TimeLeft(),
                console=Console(stderr=True),
            )  # fmt: skip
            self._task = self._bar.add_task(
                self._command,
                total=total,
                completed=completed,
                about=about.strip(),
                rate=per_second,
            )
            self._bar.start()
            return
        self._bar.update(
            self._task, completed=completed, total=total, about=about.strip(), rate=per_second
        )
