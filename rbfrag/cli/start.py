"""The console script, and what `rbfrag predict` answers and prints for one block.

A question of numbers and names alone is answered here: loading typer, and pydantic for each kind
of option, takes several times as long as the answer. All else (--help, a typing error, a file, a
table) is left to the full command, which also says what is wrong; a test proves that both give
the same output.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.cli.output import print_json, print_pairs, print_table, print_warnings
from rbfrag.errors import InputError, RbfragError

BLOCK = {
    "--p2": "p2",
    "--kr": "kr",
    "--ky": "ky",
    "--beta": "beta_deg",
    "--displacement": "displacement_m",
    "--ks": "ks",
    "--ps2": "ps2",
}
"""Options that describe a block, with the names that `rbfrag.predict` has for them."""

NUMBERS = {
    **BLOCK,
    "--rotation": "rotation_deg",
    "--pgv": "pgv_m_s",
    "--pga": "pga_g",
    "--tm": "tm_s",
    "--pgd": "pgd_m",
    "--level": "level",
}
"""Options with a number."""

NAMES = {"--kind": "kind", "--model": "model", "--db": "db"}
"""Options with a text."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def run() -> None:
    """Entry point of the console script."""
    if sys.argv[1:2] == ["predict"]:
        status = quick_predict(sys.argv[2:])
        if status is not None:
            raise SystemExit(status)
    from rbfrag.cli.main import run as full

    full()


def quick_predict(arguments: Sequence[str]) -> int | None:
    """Answer, print, and return the exit status; None leaves it to the full command.

    Args:
        arguments: what follows the word `predict`.
    """
    options = numbers_and_names(arguments)
    if options is None:
        return None
    given, names, json = options
    stated: dict[str, Any] = {**names}
    for name in ("level", "rotation_deg"):
        if name in given:
            stated[name] = given.pop(name)
    try:
        document = answer_one(given, **stated)
        show(document, json=json)
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


def numbers_and_names(
    arguments: Sequence[str],
) -> tuple[dict[str, float], dict[str, str], bool] | None:
    """Return numbers and texts by name and whether JSON is wanted, or None if there is more."""
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
    if not any(BLOCK[option] in numbers for option in BLOCK):
        return None
    return numbers, names, json


def answer_one(
    given: Mapping[str, float],
    *,
    block: str | None = None,
    kind: str | None = None,
    rotation_deg: float | None = None,
    motion: str | None = None,
    polarity: str = "both",
    model: str | None = None,
    level: float = 0.95,
    units: str | None = None,
    dt: float | None = None,
    db: str | None = None,
) -> dict[str, Any]:
    """Return the JSON document of one block.

    Args:
        given: block and measures of the motion, by the names of :func:`rbfrag.predict`.
        block: a block file instead of the block's numbers.
        kind: how the block fails.
        rotation_deg: rotation that counts as failure [deg].
        motion: the accelerogram itself: a file, ``FILE#INDEX`` or a database id.
        polarity: forward, reverse or both; with `motion`.
        model: name of a stored model.
        level: confidence level of the interval.
        units: unit of a text file of the motion.
        dt: sampling interval of such a file [s].
        db: database.
    """
    from rbfrag.fragility.lookup import block_of
    from rbfrag.fragility.predict import prediction_document

    asked, record = dict(given), None
    remarks: tuple[str, ...] = ()
    described = block_of(asked)
    if block is not None:
        from rbfrag.cli.parameters.block import block_of_file

        values, remarks = block_of_file(block, described.kind if kind is None else kind)
        twice = [option for option, name in BLOCK.items() if name in values and name in asked]
        if twice:
            raise InputError(f"{twice[0]} does not go with --block: the file describes the block")
        asked |= values
        described = block_of(asked)
    if kind in (None, described.kind):
        for option, name in BLOCK.items():
            if name in described.names and name not in asked:
                raise InputError(
                    f"{option} is missing: a block of kind {described.kind} is given by "
                    f"{' and '.join(o for o, n in BLOCK.items() if n in described.names)}, or by "
                    "--block FILE"
                )
    if motion is not None:
        from rbfrag.cli.parameters.motion import find_motion

        record = find_motion(motion, db=db, units=units, dt_s=dt)
    return prediction_document(
        asked,
        kind=kind,
        rotation_deg=rotation_deg,
        motion=record,
        polarity=polarity,
        model=model,
        level=level,
        db=db,
        remarks=remarks,
    )


def show(document: dict[str, Any], *, json: bool) -> None:
    """Print an answer."""
    if json:
        print_json(document)
        return
    answers = document.pop("answers")
    polarities = document.pop("polarities", None)
    warnings = document.pop("warnings")
    print_pairs({name: value for name, value in document.items() if name not in _LEFT_OUT or value})
    if polarities:
        print()
        print_table(
            ("polarity", "probability", "ci_low", "ci_high", "intensity_m_s"),
            [
                (name, p["probability"], p["ci_low"], p["ci_high"], p["intensity_m_s"])
                for name, p in polarities.items()
            ],
        )
    if len(answers) > 1:
        print()
        columns = ("model", "term", "probability", "ci_low", "ci_high", "in_domain", "recommended")
        print_table(columns, [tuple(answer[name] for name in columns) for answer in answers])
    print_warnings(warnings)


_LEFT_OUT = ("y_m_s", "median_displacement_m")
"""Keys that a table leaves out where they do not apply."""


if __name__ == "__main__":
    run()
