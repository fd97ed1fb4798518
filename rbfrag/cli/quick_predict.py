"""`rbfrag predict` for options that are all plain numbers and names.

Whatever is not plain (--help, a typing error, a file, a table) is left to the full command, which
also says what is wrong; a test proves that both give the same output.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Sequence

from rbfrag.cli.predict_answer import answer_one, show
from rbfrag.errors import RbfragError

NUMBERS = {
    "--p2": "p2",
    "--kr": "kr",
    "--pgv": "pgv_m_s",
    "--pga": "pga_g",
    "--tm": "tm_s",
    "--pgd": "pgd_m",
    "--level": "level",
}
"""Options with a number."""

NAMES = {"--model": "model", "--db": "db"}
"""Options with a text."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def quick_predict(arguments: Sequence[str]) -> int | None:
    """Answer, print, and return the exit status; None leaves it to the full command.

    Args:
        arguments: what follows the word `predict`.
    """
    options = plain_options(arguments)
    if options is None:
        return None
    numbers, names, json = options
    p2, kr, level = numbers.pop("p2"), numbers.pop("kr"), numbers.pop("level", 0.95)
    try:
        document, warnings = answer_one(
            p2,
            kr,
            None,
            numbers,
            motion=None,
            polarity="both",
            model=names.get("model"),
            level=level,
            units=None,
            dt=None,
            db=names.get("db"),
        )
        show(document, warnings, json=json)
        sys.stdout.flush()
    except RbfragError as error:
        print(f"rbfrag: {error}", file=sys.stderr)
        return error.exit_status
    except BrokenPipeError:
        # the reader has gone; nothing more can be written, not even by Python's own last flush
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


def plain_options(
    arguments: Sequence[str],
) -> tuple[dict[str, float], dict[str, str], bool] | None:
    """Return numbers and texts by name and whether JSON is wanted, or None if not plain."""
    numbers: dict[str, float] = {}
    names: dict[str, str] = {}
    json = False
    rest = iter(arguments)
    for word in rest:
        if word == "--json":
            json = True
            continue
        option, equals, value = word.partition("=")
        if not equals:
            value = next(rest, "")
        if option in NUMBERS and _NUMBER.fullmatch(value):
            numbers[NUMBERS[option]] = float(value)
        elif option in NAMES and value and not value.startswith("-"):
            names[NAMES[option]] = value
        else:
            return None
    if "p2" not in numbers or "kr" not in numbers:
        return None
    return numbers, names, json
