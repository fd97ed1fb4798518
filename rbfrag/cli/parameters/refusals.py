"""Which options do not go together, and which need another: one table for all commands."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from rbfrag.errors import InputError
from rbfrag.vocabulary import quantities


def _options(names: Collection[str]) -> tuple[str, ...]:
    """Return the options of inputs, with all that they are called."""
    words = (word for word, name in quantities.OTHER_WORDS.items() if name in names)
    return (*map(quantities.option_of, names), *(f"--{word}" for word in words))


NUMBERS = ("--p2", "--kr")
SHAPE = _options(quantities.SHAPE)
PLANES = (*_options(quantities.PLANES), "--no-back")
FRICTION = tuple(each for each in PLANES if each not in ("--beta", "--dip"))
SIGMAS = _options(quantities.SCATTER)
MEASURES = _options(quantities.SHAKING)

ONCE = "a block is described once"


class OptionConflict(NamedTuple):
    """Options of which none goes with any of some others.

    Args:
        options: those that are refused.
        others: those that they do not go with.
        why: what to do instead, or why not.
        commands: where this holds; () for all that have both.
    """

    options: tuple[str, ...]
    others: tuple[str, ...]
    why: str
    commands: tuple[str, ...] = ()


class Need(NamedTuple):
    """Options that do nothing unless one of some others is given.

    Args:
        options: those that are refused.
        others: what they need one of.
        goes_with: these others in words.
        why: what to do.
        commands: where this holds; () for all that have one of the others.
    """

    options: tuple[str, ...]
    others: tuple[str, ...]
    goes_with: str
    why: str
    commands: tuple[str, ...] = ()


FILES = ("--block", "--polygon")
TABLES = ("--blocks", "--rockmass")
OF_TABLES = ("hazard", "survival", "shakemap", "nrml", "pelicun")
"""Commands in which a table says all of its blocks; in predict some may be said of all rows."""

CONFLICTS = (
    OptionConflict((*FILES, "--rockmass"), NUMBERS, ONCE),
    OptionConflict(("--blocks",), NUMBERS, ONCE, OF_TABLES),
    OptionConflict(
        tuple(each for each in SHAPE if each != "--gamma"), FILES, "the file has the shape"
    ),
    OptionConflict(("--polygon",), ("--block",), ONCE),
    OptionConflict(TABLES, (*SHAPE, *FILES), ONCE),
    OptionConflict(("--mesh",), (*SHAPE, *FILES), ONCE),
    OptionConflict(
        ("--block-draws",), (*NUMBERS, *SHAPE, *FILES, *PLANES, *SIGMAS), "the table has the block"
    ),
    OptionConflict(
        ("--template",),
        (*SHAPE, *FILES, *PLANES, "--cohesion", "--density", "--kv", "--mesh", "--plot"),
        "it is an empty table",
    ),
    OptionConflict(("--block-draws",), ("--blocks",), "one question is about one block"),
    OptionConflict(("--block-draws",), ("--ky", "--restitution"), "the table has the block"),
    OptionConflict(("--draws",), ("--csv", "--plot", "--film"), "they show one run", ("respond",)),
    OptionConflict(
        ("--vertical", "--map"),
        ("--sequence",),
        "two motions are two horizontal ones, and no map is made of them",
        ("simulate",),
    ),
    OptionConflict(("--polarity",), ("--reverse",), "one of them is enough"),
    OptionConflict(
        (*PLANES, "--cohesion", "--kv"),
        ("--mesh",),
        "a mesh stands free on level ground, in the pose that it was measured in",
    ),
    OptionConflict(("--rockmass",), ("--blocks",), "one of them is enough"),
    OptionConflict(
        PLANES, TABLES, "the file has the planes", ("hazard", "shakemap", "nrml", "pelicun")
    ),
    OptionConflict(
        (*FRICTION, "--motion"), ("--blocks",), "the table has the blocks", ("predict",)
    ),
    OptionConflict(
        ("--samples", "--seed", "--plot"), ("--expected",), "curves and samples need draws"
    ),
    OptionConflict(
        ("--motion",),
        MEASURES,
        "give the accelerogram, or the measures that a fragility model answers for",
    ),
)

_NAME_IT = "name the accelerogram, too"
_MEASURE = "give --pgv, --pga or --sa10, or --pgd and --tm, too"

NEEDS = (
    Need(
        ("--ses",), ("--investigation-time",), "--investigation-time", "both say how long it took"
    ),
    Need(("--investigation-time",), ("--ses",), "--ses", "both say how long the events took"),
    Need(("--out",), ("--blocks",), "--blocks", "--blocks FILE names the table", ("predict",)),
    Need(("--sheet",), ("--blocks",), "--blocks", "it is a sheet of that workbook"),
    Need(("--ignore-columns", "--crs"), ("--blocks",), "--blocks", "it is about that table"),
    Need(("--excel-text",), ("--out",), "--out", "--out FILE names the table that it is about"),
    Need(("--excel-text",), ("--csv",), "--csv", "--csv FILE names the table that it is about"),
    Need(
        ("--vertical", "--reverse", "--scales", "--jobs", "--units", "--dt", "--polarity"),
        ("--motion",),
        "--motion",
        _NAME_IT,
    ),
    Need(
        ("--displacement",),
        ("--motion", *MEASURES),
        "--motion, or with --pgv",
        _NAME_IT,
        ("rockmass",),
    ),
    Need(
        ("--rotation",),
        ("--motion", "--displacement"),
        "--motion, or with --pgv and --displacement",
        _NAME_IT,
        ("rockmass",),
    ),
    Need(
        (
            "--imt",
            "--site",
            "--convert",
            "--convert-sigma",
            "--years",
            "--disaggregation",
        ),
        ("--hazard",),
        "--hazard",
        "name the hazard curve, too",
        ("report",),
    ),
    Need(("--model",), MEASURES, "a measure of the motion", _MEASURE, ("rockmass",)),
    Need(
        ("--db",),
        ("--motion", *MEASURES),
        "a motion or a measure of it",
        f"give --motion, or {_MEASURE.removeprefix('give ')}",
        ("rockmass",),
    ),
    Need(
        (*SIGMAS, "--block-draws", "--polarity", "--seed", "--displacement"),
        ("--draws",),
        "--draws",
        "it is about what the block may be, of which so many are run",
        ("respond",),
    ),
    Need(
        ("--seed", "--draws", "--out"),
        ("--sequence",),
        "--sequence",
        "it is about pairs of motions",
        ("simulate",),
    ),
    Need(("--exaggerate",), ("--film",), "--film", "it is a factor on what the film shows"),
    Need(("--up", "--contact-mm"), ("--mesh",), "--mesh", "it is about the pose of a mesh"),
    Need(
        ("--out",), ("--mesh",), "--mesh", "only a mesh makes a table, of its azimuths", ("block",)
    ),
    Need(("--n",), ("--rockmass",), "--rockmass", "only a rock mass is drawn anew"),
    Need(("--shares",), ("--rockmass",), "--rockmass", "they are shares of its blocks"),
)


def refuse(command: str, given: Collection[str], known: Collection[str]) -> None:
    """Refuse options that do not go together.

    Args:
        command: name of the command's function.
        given: the options that were given.
        known: all that the command has; what it cannot be given, nothing needs.

    Raises:
        InputError: the first option that does not go with the others; the message names both.
    """
    for rule in CONFLICTS:
        if not rule.commands or command in rule.commands:
            one = _first(rule.options, given)
            other = _first(rule.others, given)
            if one and other:
                raise InputError(f"{one} does not go with {other}: {rule.why}")
    for need in NEEDS:
        if (not need.commands or command in need.commands) and _first(need.others, known):
            one = _first(need.options, given)
            if one and not _first(need.others, given):
                raise InputError(f"{one} goes with {need.goes_with}: {need.why}")


def _first(options: Collection[str], among: Collection[str]) -> str | None:
    return next((option for option in options if option in among), None)
