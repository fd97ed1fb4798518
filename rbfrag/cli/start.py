"""The console script: a question to `predict` of numbers is answered without typer.

A question of numbers and names alone is answered here: loading typer, and pydantic for each kind
of option, takes several times as long as the answer. All else (--help, a typing error, a file, a
table) is left to the full command, which also says what is wrong; a test proves that both give
the same output.
"""

from __future__ import annotations

import os
import re
import signal
import sys
from collections.abc import Sequence
from typing import Any

from rbfrag.cli.output import show_prediction
from rbfrag.errors import RbfragError
from rbfrag.question.fields import BlockFields, ShakingFields, option_of

NUMBERS = {
    option_of(name): name
    for name in (
        *sorted(BlockFields.__optional_keys__ - {"leaves_g"}),
        *sorted(ShakingFields.__optional_keys__),
        "rotation_deg",
        "level",
    )
}
"""Options with a number, with the names that `rbfrag.predict` has for them."""

NAMES = {"--kind": "kind", "--model": "model", "--db": "db"}
"""Options with a text."""

FLAGS = ("json", "verbose")
"""Options without a value."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


ONE_THREAD = "OPENBLAS_NUM_THREADS"
"""Threads of linear algebra, read where numpy is loaded. The matrices here are too narrow to be
shared, and threads that wait for one another on a busy machine spin
(docs/evidence/performance.md)."""


def run() -> None:
    """Entry point of the console script."""
    os.environ.setdefault(ONE_THREAD, "1")
    try:
        if sys.argv[1:2] == ["predict"]:
            status = quick_predict(sys.argv[2:])
            if status is not None:
                raise SystemExit(status)
        from rbfrag.cli.main import run as full

        full()
    except KeyboardInterrupt:  # while libraries load, or once more while the command ends
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        raise SystemExit(130) from None


def quick_predict(arguments: Sequence[str]) -> int | None:
    """Answer, print, and return the exit status; None leaves it to the full command.

    Args:
        arguments: what follows the word `predict`.
    """
    options = numbers_and_names(arguments)
    if options is None:
        return None
    given, names, flags = options
    stated: dict[str, Any] = {**names}
    for name in ("level", "rotation_deg"):
        if name in given:
            stated[name] = given.pop(name)
    try:
        from rbfrag.question.document import question_document

        document, read = question_document(given, **stated)
        show_prediction(document, read, **flags)
        sys.stdout.flush()
    except RbfragError:
        return None  # the full command refuses it in its words
    except BrokenPipeError:
        # the reader has gone; nothing more can be written, not even by Python's own last flush
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    return 0


def numbers_and_names(
    arguments: Sequence[str],
) -> tuple[dict[str, float], dict[str, str], dict[str, bool]] | None:
    """Return numbers, texts and flags by name, or None if there is more."""
    numbers: dict[str, float] = {}
    names: dict[str, str] = {}
    flags = dict.fromkeys(FLAGS, False)
    rest = iter(arguments)
    for word in rest:
        if word.removeprefix("--") in flags and word.startswith("--"):
            flags[word.removeprefix("--")] = True
            continue
        option, equals, value = word.partition("=")
        if not equals:
            value = next(rest, "")
        if option == "--dip" and _NUMBER.fullmatch(value):
            numbers["dip"] = float(value)
        elif option in NUMBERS and _NUMBER.fullmatch(value):
            numbers[NUMBERS[option]] = float(value)
        elif option in NAMES and value and not value.startswith("-"):
            names[NAMES[option]] = value
        else:
            return None
    if not numbers:
        return None
    dip = numbers.pop("dip", None)
    if dip is not None:  # of a rectangle it is the dip of the base, unless that is stated too
        if "beta_deg" in numbers or "height_m" not in numbers:
            return None
        numbers["beta_deg"] = dip
    return numbers, names, flags


if __name__ == "__main__":
    run()
