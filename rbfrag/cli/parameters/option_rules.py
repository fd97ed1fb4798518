"""Rules for combining options: conflicts and requirements, one table for all commands."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

from rbfrag.errors import InputError
from rbfrag.vocabulary import quantities


def _options(names: Collection[str]) -> tuple[str, ...]:
    """Return all names of the options of inputs."""
    words = (word for word, name in quantities.OTHER_WORDS.items() if name in names)
    return (*map(quantities.option_of, names), *(f"--{word}" for word in words))


NUMBERS = ("--p2", "--kr")
SHAPE = _options(quantities.SHAPE)
PLANES = (*_options(quantities.PLANES), "--no-back")
FRICTION = tuple(option for option in PLANES if option not in ("--beta", "--dip"))
SIGMAS = _options(quantities.SCATTER)
MEASURES = _options(quantities.SHAKING)

ONCE = "give one description of the block"


class OptionConflict(NamedTuple):
    """Options that cannot be combined with certain other options.

    Args:
        options: those that are rejected.
        other_options: those that they cannot be combined with.
        why: what to do instead, or why not.
        commands: where this holds; () for all that have both.
    """

    options: tuple[str, ...]
    other_options: tuple[str, ...]
    why: str
    commands: tuple[str, ...] = ()


class Need(NamedTuple):
    """Options that require at least one of certain other options.

    Args:
        options: those that are rejected.
        other_options: what they need one of.
        goes_with: these others in words.
        why: what to do.
        commands: where this holds; () for all that have one of the others.
    """

    options: tuple[str, ...]
    other_options: tuple[str, ...]
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
        tuple(word for word in SHAPE if word != "--gamma"), FILES, "the geometry is in the file"
    ),
    OptionConflict(("--polygon",), ("--block",), ONCE),
    OptionConflict(TABLES, (*SHAPE, *FILES), ONCE),
    OptionConflict(("--mesh",), (*SHAPE, *FILES), ONCE),
    OptionConflict(
        ("--block-draws",),
        (*NUMBERS, *SHAPE, *FILES, *PLANES, *SIGMAS),
        "the table describes the block",
    ),
    OptionConflict(
        ("--template",),
        (*SHAPE, *FILES, *PLANES, "--cohesion", "--density", "--kv", "--mesh", "--plot"),
        "it is an empty table",
    ),
    OptionConflict(("--block-draws",), ("--blocks",), "--block-draws is for a single block"),
    OptionConflict(("--block-draws",), ("--ky", "--restitution"), "the table describes the block"),
    OptionConflict(
        ("--draws",),
        ("--csv", "--plot", "--film"),
        "these outputs are for a single response",
        ("respond",),
    ),
    OptionConflict(
        ("--vertical", "--map"),
        ("--sequence",),
        "sequences have horizontal motions only and no map",
        ("simulate",),
    ),
    OptionConflict(("--polarity",), ("--reverse",), "give one of them"),
    OptionConflict(
        (*PLANES, "--cohesion", "--kv"),
        ("--mesh",),
        "a mesh is free-standing on level ground",
    ),
    OptionConflict(("--rockmass",), ("--blocks",), "give one of them"),
    OptionConflict(
        PLANES, TABLES, "the planes are in the file", ("hazard", "shakemap", "nrml", "pelicun")
    ),
    OptionConflict(
        (*FRICTION, "--motion"), ("--blocks",), "the table describes the blocks", ("predict",)
    ),
    OptionConflict(
        ("--samples", "--seed", "--plot"), ("--expected",), "curves and samples require draws"
    ),
    OptionConflict(
        ("--motion",),
        MEASURES,
        "give the accelerogram or the intensity measures",
    ),
)

_NAME_IT = "give also the accelerogram"
_MEASURE = "give --pgv, --pga or --sa10, or --pgd and --tm, too"

NEEDS = (
    Need(
        ("--ses",),
        ("--investigation-time",),
        "--investigation-time",
        "together they give the duration of the event set",
    ),
    Need(
        ("--investigation-time",),
        ("--ses",),
        "--ses",
        "together they give the duration of the event set",
    ),
    Need(("--out",), ("--blocks",), "--blocks", "give also the table of blocks", ("predict",)),
    Need(("--sheet",), ("--blocks",), "--blocks", "it is a sheet of the workbook"),
    Need(
        ("--ignore-columns", "--crs"),
        ("--blocks",),
        "--blocks",
        "it applies to the table of blocks",
    ),
    Need(("--excel-text",), ("--out",), "--out", "it applies to that table"),
    Need(("--excel-text",), ("--csv",), "--csv", "it applies to that table"),
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
        "give also the hazard curve",
        ("report",),
    ),
    Need(("--model",), MEASURES, "an intensity measure", _MEASURE, ("rockmass",)),
    Need(
        ("--db",),
        ("--motion", *MEASURES),
        "a motion or an intensity measure",
        f"give --motion, or {_MEASURE.removeprefix('give ')}",
        ("rockmass",),
    ),
    Need(
        (*SIGMAS, "--block-draws", "--polarity", "--seed", "--displacement"),
        ("--draws",),
        "--draws",
        "it applies to the draws of an uncertain block",
        ("respond",),
    ),
    Need(
        ("--seed", "--draws", "--out"),
        ("--sequence",),
        "--sequence",
        "it applies to pairs of motions",
        ("simulate",),
    ),
    Need(("--exaggerate",), ("--film",), "--film", "it scales the animation"),
    Need(("--up", "--contact-mm"), ("--mesh",), "--mesh", "it applies to a mesh"),
    Need(
        ("--out",), ("--mesh",), "--mesh", "the table is that of the azimuths of a mesh", ("block",)
    ),
    Need(
        ("--n",), ("--rockmass",), "--rockmass", "it is the number of realisations of the rock mass"
    ),
    Need(("--shares",), ("--rockmass",), "--rockmass", "it gives fractions of its blocks"),
)


def reject(command: str, used: Collection[str], available: Collection[str]) -> None:
    """Reject options that cannot be combined.

    Args:
        command: name of the command's function.
        used: the options that were given.
        available: all that the command has; what it cannot be given, nothing needs.

    Raises:
        InputError: the first option that cannot be combined with the others, with both names.
    """
    for rule in CONFLICTS:
        if not rule.commands or command in rule.commands:
            option = _first(rule.options, used)
            other = _first(rule.other_options, used)
            if option and other:
                raise InputError(f"{option} cannot be combined with {other}: {rule.why}")
    for need in NEEDS:
        if (not need.commands or command in need.commands) and _first(
            need.other_options, available
        ):
            option = _first(need.options, used)
            if option and not _first(need.other_options, used):
                raise InputError(f"{option} requires {need.goes_with}: {need.why}")


def _first(options: Collection[str], among: Collection[str]) -> str | None:
    return next((option for option in options if option in among), None)
