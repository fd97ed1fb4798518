"""Commands on typer: options of the vocabulary's fields, groups of options, and their help.

A parameter of a command is an option or argument of typer, or a group of options: then it is
annotated with a function, ``Annotated[…, function]``, whose parameters are the options, and the
command gets what the function returns.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from functools import partial
from typing import Any, TypeVar

import typer
from typer.core import TyperCommand, TyperGroup

from rbfrag.errors import InputError
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.vocabulary.quantities import (
    FAILURE,
    INPUTS,
    JOINT,
    MEASURED,
    NUMBERS,
    OTHER_WORDS,
    PANELS,
    PLANES,
    QUANTITIES,
    SCATTER,
    SHAKING,
    SHAPE,
    SPACE,
    inputs_from,
    name_of,
    option_of,
    word_of,
)
from rbfrag.vocabulary.spectral import BY_PERIOD

F = TypeVar("F", bound=Callable[..., None])

MOST_USED = (
    "--height", "--width", "--dip", "--phi", "--kind", "--pgv", "--help",
    "--blocks", "--out", "--json", "--plot", "--age", "--hazard", "--imt", "--component",
    "--p2", "--kr", "--ky", "--displacement", "--motion", "--rockmass", "--gmf-data",
    "--weights", "--years", "--joint", "--magnitude", "--rjb", "--vs30", "--pga", "--sa",
    "--sites", "--block", "--db", "--level", "--draws", "--vertical", "--rotation",
    "--age-sd", "--over", "--kr-sigma", "--model", "--units", "--verbose", "--phi-back",
    "--water", "--polygon", "--restitution", "--s1", "--s2", "--gamma",
)  # fmt: skip
"""Options by use, the most used first; those of a command that come first are in its --help."""

LONGEST_HELP = 25
"""Options that --help shows; --help-all shows the rest."""

OUTPUT = (
    "--out", "--csv", "--plot", "--film", "--exaggerate", "--release", "--template", "--format",
    "--excel-text", "--verbose", "--json",
)  # fmt: skip
"""Options under the heading Output."""

FILES = {
    "block": "Block file (.toml or .csv); options about planes and joints replace its values",
    "polygon": "Outline of a block (.csv or .toml), in the formats of --block",
}
"""Options that name the file of a block, with their help."""

ALL_OPTIONS = "rbfrag.all_options"
"""Key of the metadata of a context whose help shows all options."""


def option(help: str, default: Any = None, *names: str, **about: Any) -> Any:
    """Declare an option: a noun phrase with its unit in brackets; the default ``...`` requires it.

    Args:
        help: noun phrase with its unit in brackets.
        default: its value where it is not given; ``...`` for a required option.
        names: its names; none for that of the parameter.
        about: further arguments of typer, such as metavar.
    """
    return typer.Option(default, *names, help=help, **about)


def argument(help: str, default: Any = ..., **about: Any) -> Any:
    """Declare an argument, which is required unless it has a default."""
    return typer.Argument(default, help=help, **about)


class Inputs(dict[str, Any]):
    """Values of the options of fields, by field.

    Attributes:
        file: the file that describes the block; None for none.
        notes: how numbers with a decimal comma were understood.
    """

    file: str | None = None
    notes: tuple[str, ...] = ()

    @contextmanager
    def named(self) -> Iterator[None]:
        """Prefix errors about the block with the name of its file."""
        try:
            yield
        except InputError as error:
            if self.file is None or str(error).startswith(self.file):
                raise
            raise InputError(f"{self.file}: {error}", fields=error.fields) from None


class _WithComma(float):
    """Number entered with a decimal comma.

    Attributes:
        text: what was typed.
    """

    text: str


_KINDS = {bool: bool, str: str | None, dict: list[str] | None}
"""Types of options by the type of their field; others are numbers."""


class Fields:
    """Group of the options of fields of the vocabulary, which gives :class:`Inputs`.

    Args:
        names: the fields.
        without: those of them that the command does not take.
    """

    def __init__(self, *names: str, without: tuple[str, ...] = ()) -> None:
        self._names = [name for name in names if name not in without]

    @property
    def __signature__(self) -> inspect.Signature:
        """The options, of which the last of several names of a field has the help."""
        options: dict[str, tuple[Any, Any]] = {}
        for name in self._names:
            panel = next((group for group, of in PANELS.items() if name in of), None)
            if name == "block":
                for word, help in FILES.items():
                    file = option(help, metavar="FILE", rich_help_panel=panel)
                    options[word] = str | None, file
                continue
            of_type = INPUTS[name].type
            kind: Any = _KINDS.get(of_type, float | None)
            default = False if of_type is bool else None
            *aliases, first = word_of(name), *(w for w, of in OTHER_WORDS.items() if of == name)
            help = QUANTITIES[name].help(option_of)
            about = {"autocompletion": model_names} if name == "model" else {}
            metavar = "URL" if name == "db" else "T=VALUE" if name in BY_PERIOD else None
            options[first] = (
                kind,
                option(help, default, rich_help_panel=panel, metavar=metavar, **about),
            )
            same = f"Same as --{first.replace('_', '-')}"
            for word in aliases:
                options[word] = kind, option(same, default, rich_help_panel=panel)
        keyword = inspect.Parameter.KEYWORD_ONLY
        return inspect.Signature([
            inspect.Parameter(word, keyword, default=declared, annotation=kind)
            for word, (kind, declared) in options.items()
        ])  # fmt: skip

    def __call__(self, **words: Any) -> Inputs:
        """Return the values of the options, by field; options override a block file."""
        files = [path for word in FILES if (path := words.pop(word, None)) is not None]
        inputs = Inputs(inputs_from(words))
        for name, value in inputs.items():
            if isinstance(value, _WithComma):
                note = f"{option_of(name)} {value.text} is {float(value):g}"
                inputs.notes = (*inputs.notes, Diagnostic(note, "decimal_comma"))
                inputs[name] = float(value)
        if files:
            from rbfrag.solver.block.file import read_block

            inputs.file = files[0]
            read = read_block(inputs.file, gamma_deg=inputs.pop("gamma_deg", None))
            inputs |= {"block": read.block, **read.conditions, **inputs}
        return inputs


def model_names(ctx: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Return the models whose names begin with a text, each with a description.

    This is shell completion: what cannot be read offers nothing, and says nothing.
    """
    from rbfrag.errors import RbfragError
    from rbfrag.fragility.model_selection import stored_rows

    try:
        rows = stored_rows(ctx.params.get("db"))
    except RbfragError:
        return []
    return [
        (row.name, f"{row.kind}: {row.method} on {row.term}")
        for row in rows
        if row.name.startswith(incomplete)
    ]


class _Reading:
    """Values of options and help by headings, for commands and groups of commands."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return options and arguments, which read numbers and texts themselves.

        typer loads pydantic for this, even for options that are not given, which takes longer than
        most answers.
        """
        parameters: list[Any] = super().get_params(ctx)  # type: ignore[misc]
        for parameter in parameters:
            parameter.process_value = partial(_read, parameter, type(parameter).process_value)
        return parameters

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the options under their headings: all, or the most used ones."""
        panels: dict[str, list[Any]] = {
            name: [] for name in ("Arguments", *PANELS, "Options", "Output")
        }
        options = [item for item in self.get_params(ctx) if item.get_help_record(ctx)]
        shown = options if ctx.meta.get(ALL_OPTIONS) else most_used(options)
        for item in shown:
            heading = getattr(item, "rich_help_panel", None)
            if item.param_type_name == "argument":
                heading = "Arguments"
            elif item.opts[0] in OUTPUT:
                heading = heading or "Output"
            panels[heading or "Options"].append(item.get_help_record(ctx))
        for name, records in panels.items():
            if records:
                with formatter.section(name):
                    formatter.write_dl(records)
        if len(shown) < len(options):
            formatter.write_paragraph()
            formatter.write_text(f"More options:  {words_of(ctx)} --help-all")


def words_of(context: Any) -> str:
    """Return the words of a command, ``rbfrag plot curve``."""
    words: list[str] = []
    while context.parent is not None:
        words.insert(0, context.info_name)
        context = context.parent
    return " ".join(("rbfrag", *words))


def most_used(options: list[Any]) -> list[Any]:
    """Return the arguments, the required options and the most used ones, in their order."""
    rank = {name: position for position, name in enumerate(MOST_USED)}

    def position(item: Any) -> tuple[bool, int]:
        return not item.required, min(rank.get(name, len(rank)) for name in item.opts)

    arguments = [item for item in options if item.param_type_name == "argument"]
    by_use = sorted((item for item in options if item not in arguments), key=position)
    chosen = [*arguments, *by_use[:LONGEST_HELP]]
    return [item for item in options if item in chosen]


class Command(_Reading, TyperCommand):
    """A command that rejects options without effect and options that exclude one another."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        words = {item.name: max(item.opts, key=len) for item in self.params}
        used = [
            words[item.name]
            for item in self.params
            if ctx.params.get(item.name) not in (None, (), [], item.default)
        ]
        reject(str(self.name), used, frozenset(words.values()))
        return super().invoke(ctx)


class CommandGroup(_Reading, TyperGroup):
    """A group of commands."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write options and commands."""
        super().format_options(ctx, formatter)
        self.format_commands(ctx, formatter)


class Commands(typer.Typer):
    """One command, or a group of commands whose parameters may be groups of options.

    Args:
        help: what a group does.
        example: a command line of it.
    """

    def __init__(self, help: str | None = None, example: str | None = None) -> None:
        super().__init__(
            help=help, epilog=example, cls=CommandGroup, no_args_is_help=True,
            rich_markup_mode=None, add_completion=False,
        )  # fmt: skip

    def command(self, name: str, *, epilog: str) -> Callable[[F], F]:  # type: ignore[override]
        """Return a decorator that makes a command of a function, which stays as it is."""
        register = super().command(name, cls=Command, epilog=epilog)

        def declared(function: F) -> F:
            options, call = _flat(function)
            count = sum(
                any(
                    isinstance(item, typer.models.OptionInfo)
                    for item in (entry.default, *getattr(entry.annotation, "__metadata__", ()))
                )
                for entry in options
            )
            if count >= LONGEST_HELP:  # --help is one more
                options.append(_HELP_ALL)

            def run(**values):  # type: ignore[no-untyped-def]
                call(values)

            run.__name__, run.__doc__ = function.__name__, function.__doc__
            run.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]
            register(run)
            return function

        return declared


def _flat(function: Any) -> tuple[list[inspect.Parameter], Callable[[Mapping[str, Any]], Any]]:
    """Return the options of a function and of its groups, and what calls it with their values."""
    options: list[inspect.Parameter] = []
    makers: dict[str, Callable[[Mapping[str, Any]], Any]] = {}
    for name, parameter in inspect.signature(function, eval_str=True).parameters.items():
        about = getattr(parameter.annotation, "__metadata__", ())
        group = next((item for item in about if callable(item)), None)
        if group is not None:
            of_group, makers[name] = _flat(group)
            options += of_group
            continue
        default = parameter.default
        if isinstance(default, typer.models.OptionInfo) and not default.param_decls:
            default = copy(default)  # else typer adds --no-NAME to a flag
            default.param_decls = (f"--{name.replace('_', '-')}",)
        options.append(parameter.replace(kind=parameter.KEYWORD_ONLY, default=default))
        makers[name] = lambda values, name=name: values[name]  # type: ignore[misc]
    return options, lambda values: function(**{n: make(values) for n, make in makers.items()})


def _show_all_options(context: typer.Context, value: bool) -> None:
    if value:
        context.meta[ALL_OPTIONS] = True
        print(context.get_help())
        raise typer.Exit


_HELP_ALL = inspect.Parameter(
    "help_all",
    inspect.Parameter.KEYWORD_ONLY,
    annotation=bool,
    default=option(
        "Show all options and exit.", False, "--help-all", is_eager=True, callback=_show_all_options
    ),
)

_NEEDS: dict[type, str] = {float: "a number with a decimal point", int: "a whole number"}
"""What the value of an option of a type must be."""


def _read(parameter: Any, usual: Any, context: Any, value: Any) -> Any:
    """Return the parsed value of an option or argument."""
    kind = parameter.type_descriptor.annotation
    if parameter.multiple or parameter.nargs == -1:
        value = () if value is None else list(value)
    missing = parameter.value_is_missing(value)
    if parameter.required if missing else parameter.callback is not None:
        return usual(parameter, context, value)  # which says what is missing
    if kind not in _NEEDS or not isinstance(value, str):
        return value
    try:
        number = kind(value)
    except ValueError:
        # the vocabulary of tables, which plain numbers do not load
        from rbfrag.question.table import number_with_unit

        requirement = _NEEDS[kind]
        about = QUANTITIES.get(name_of(parameter.name)) if kind is float else None
        read = None if about is None else number_with_unit(value, about.unit)
        if about is not None and read is not None:
            typed = _WithComma(read)
            typed.text = value
            return typed if "," in value else read
        if about is not None and about.name in MEASURED and value.rstrip().endswith("%"):
            return value  # a fraction of the field
        if about is not None and about.unit:
            requirement += f", optionally with its unit ({about.unit})"
    else:
        if parameter.min is None or number >= parameter.min:
            return number
        requirement = f"{parameter.min} or more"
    raise InputError(f"{name_in_errors(parameter)} must be {requirement}, not {value!r}")


def name_in_errors(parameter: Any) -> str:
    """Return what an option is called, ``--height``, or an argument, ``CURVE``."""
    if parameter.param_type_name == "option":
        return str(max(parameter.opts, key=len))
    return str(parameter.metavar or parameter.human_readable_name).strip("[]{}.")


def _names(*fields: str) -> tuple[str, ...]:
    """Return all names of the options of fields."""
    words = (word.replace("_", "-") for word, name in OTHER_WORDS.items() if name in fields)
    return (*map(option_of, fields), *(f"--{word}" for word in words))


_MEASURES = _names(*SHAKING)
_FILES = ("--block", "--polygon")
_PLANES = _names(*SHAPE, *PLANES, *JOINT, *SPACE, "back_fracture", "cohesion_pa", "drainage")
_OF_ONE_BLOCK = (*_names(*NUMBERS, *FAILURE, *SCATTER, "density_kg_m3"), *_PLANES, *_FILES)
_DRAWN = ("--draws", "--block-draws", *_names(*SCATTER, *MEASURED[:-1]))
_MASS_COMMANDS = ("hazard", "shakemap", "nrml", "pelicun")
_TABLE_COMMANDS = (*_MASS_COMMANDS, "survival")

CONFLICTS: tuple[tuple[tuple[str, ...], tuple[str, ...], str, tuple[str, ...]], ...] = (
    (_FILES, ("--p2", "--kr"), "give one description of the block", ()),
    (tuple(name for name in _names(*SHAPE) if name != "--gamma"), _FILES,
     "the geometry is in the file", ()),
    (("--polygon",), ("--block",), "give one description of the block", ()),
    (("--template",), (*_PLANES, *_FILES, "--density", "--kv", "--mesh", "--plot"),
     "it is an empty table", ()),
    (("--mesh",), (*_PLANES, *_FILES, "--kv"), "a mesh is free-standing on level ground", ()),
    (("--rockmass",), ("--blocks",), "give one of them", ()),
    (("--rockmass",), _OF_ONE_BLOCK, "the file describes the blocks", _MASS_COMMANDS),
    (("--block-draws",),
     (*_names(*NUMBERS, *SHAPE, *PLANES, *SCATTER, "restitution", "back_fracture"), *_FILES),
     "the table describes the block", ()),
    (("--block-draws", "--motion"), ("--blocks",), "they are for a single block", ("predict",)),
    (("--blocks",), ("--p2", "--kr", *_FILES), "give one description of the block",
     _TABLE_COMMANDS),
    (("--blocks",), _FILES, "give one description of the block", ("predict",)),
    (("--motion",), _MEASURES, "give the accelerogram or the intensity measures", ()),
    (("--no-back",), ("--blocks",), "the planes are in the file", (*_TABLE_COMMANDS, "predict")),
    (_DRAWN, ("--csv", "--plot", "--film"), "these outputs are for a single response",
     ("respond",)),
    (("--polarity",), ("--reverse",), "give one of them", ()),
    (("--slope-azimuth",), ("--polarity", "--reverse"), "it sets the polarity", ()),
    (("--samples", "--seed", "--plot", "--jobs", "--scheduler"), ("--expected",),
     "only samples and their curves use it", ()),
)  # fmt: skip
"""Options that exclude others, the reason, and the commands where they do; () for all.

The packages below reject a block or shaking that is given twice. This is what only the command
line knows: files, tables, and options that would be ignored.
"""

NEEDS: tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...] = (
    ("--sheet --ignore-columns --crs", ("--blocks",), ()),
    ("--excel-text", ("--out", "--csv"), ()),
    ("--vertical --reverse --scales --jobs --units --dt --polarity --slope-azimuth",
     ("--motion",), ()),
    ("--up --contact-mm", ("--mesh",), ()),
    ("--exaggerate", ("--film",), ()),
    ("--n --shares", ("--rockmass",), ()),
    ("--ses", ("--investigation-time",), ()),
    ("--investigation-time", ("--ses",), ()),
    ("--out", ("--blocks",), ("predict",)),
    ("--out", ("--mesh",), ("block",)),
    ("--seed --draws --out", ("--sequence",), ("simulate",)),
    ("--polarity --displacement", _DRAWN, ("respond",)),
    ("--imt --site --convert --convert-sigma --years --disaggregation", ("--hazard",),
     ("report",)),
    ("--displacement --db", ("--motion", *_MEASURES), ("rockmass",)),
    ("--rotation", ("--motion", "--displacement"), ("rockmass",)),
    ("--model", _MEASURES, ("rockmass",)),
)  # fmt: skip
"""Options without effect unless one of others is given, and the commands; () for all that have
one of the others.
"""


def reject(command: str, used: Collection[str], available: Collection[str]) -> None:
    """Reject options that exclude one another or have no effect.

    Args:
        command: name of the command.
        used: the options that were given.
        available: all that the command has; what it cannot be given, nothing needs.

    Raises:
        InputError: the first option that cannot be combined with the others, with both names.
    """
    for options, conflicting, why, commands in CONFLICTS:
        first = next((name for name in options if name in used), None)
        other = next((name for name in conflicting if name in used), None)
        if first and other and command in (commands or (command,)):
            raise InputError(f"{first} cannot be combined with {other}: {why}")
    for words, needed, commands in NEEDS:
        possible = [name for name in needed if name in available]
        name = next((word for word in words.split() if word in used), None)
        if name is None or not possible or command not in (commands or (command,)):
            continue
        if not {*possible} & {*used}:
            listed = [other for other in possible if other not in _MEASURES]
            if len(listed) < len(possible):
                listed.append("an intensity measure, such as --pgv")
            raise InputError(f"{name} requires {' or '.join(listed)}: give it, too, or omit {name}")
