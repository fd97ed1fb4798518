"""Groups of options shared by commands, and the help of commands."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from dataclasses import MISSING, Field, field, fields, is_dataclass
from functools import partial, update_wrapper
from typing import Annotated, Any, NamedTuple, get_type_hints

import typer

from rbfrag.cli.parameters.completion import model_names
from rbfrag.cli.parameters.option_rules import reject
from rbfrag.errors import InputError
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.vocabulary.quantities import (
    INPUTS,
    OTHER_WORDS,
    PANELS,
    QUANTITIES,
    inputs_from,
    name_of,
    option_of,
    word_of,
)


def option(
    help: str, default: Any = None, *, word: str | tuple[str, ...] | None = None, **about: Any
) -> Any:
    """Declare an option: a field of a dataclass, or a parameter of a command.

    Args:
        help: noun phrase with its unit in brackets.
        default: its value where it is not given; ``...`` for a required option.
        word: its name, or all its names; None for the name of the field.
        about: further arguments of typer, such as metavar.
    """
    return _declared(typer.Option, help, default, about | {"word": word})


def argument(help: str, default: Any = ..., **about: Any) -> Any:
    """Declare an argument, which is required unless it has a default."""
    return _declared(typer.Argument, help, default, about)


def _declared(make: Any, help: str, default: Any, about: dict[str, Any]) -> Any:
    declared = {"make": make, "help": help, **about}
    return field(default=MISSING if default is ... else default, metadata=declared)


def command_group(help: str, epilog: str) -> typer.Typer:
    """Return an empty command group.

    Args:
        help: what the group does.
        epilog: an example.
    """
    return typer.Typer(
        help=help, epilog=epilog, no_args_is_help=True, rich_markup_mode=None, add_completion=False
    )


class ParsedInputs(dict[str, Any]):
    """Values of the options, by field.

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


class FieldOptions(NamedTuple):
    """Inputs that are options of a command.

    Args:
        names: the inputs.
        without: those of them that the command does not take.
    """

    names: tuple[str, ...]
    without: tuple[str, ...] = ()

    def options(self) -> Iterator[inspect.Parameter]:
        """Yield the options as typer parameters."""
        for name in self.names:
            if name in self.without:
                continue
            about, type_ = QUANTITIES[name], INPUTS[name].type
            panel = next((group for group, of in PANELS.items() if name in of), None)
            if name == "block":
                for word, help in FILES.items():
                    file_option = option(help, metavar="FILE", rich_help_panel=panel)
                    yield _parameter(word, str | None, file_option)
                continue
            further = {"rich_help_panel": panel, **FURTHER.get(name, {})}
            kind = bool if type_ is bool else str | None if type_ is str else float | None
            # the usual name has the help
            *aliases, first = word_of(name), *(w for w, of in OTHER_WORDS.items() if of == name)
            help = about.help(option_of)
            file_option = option(help, False if type_ is bool else None, **further)
            yield _parameter(first, kind, file_option)
            for word in aliases:
                other = option(f"Same as --{first}", rich_help_panel=panel)
                yield _parameter(word, kind, other)

    def read(self, words: Mapping[str, Any]) -> ParsedInputs:
        """Return the values of the options, by field; options override a block file."""
        files = [words[word] for word in FILES if words.get(word) is not None]
        inputs = ParsedInputs(
            inputs_from({name: words[name] for name in words if name not in FILES})
        )
        for name, value in inputs.items():
            if isinstance(value, _WithComma):
                note = f"{option_of(name)} {value.text} is {float(value):g}"
                inputs.notes = (*inputs.notes, Diagnostic(note, "decimal_comma"))
                inputs[name] = float(value)
        if files:
            from rbfrag.solver.block.file import read_block

            (inputs.file,) = files
            read = read_block(inputs.file, gamma_deg=inputs.pop("gamma_deg", None))
            inputs |= {"block": read.block, **read.conditions, **inputs}
        return inputs


FILES = {
    "block": "Block file (.toml or .csv); options about planes and joints replace its values",
    "polygon": "Outline of a block (.csv or .toml), in the formats of --block",
}
"""Options that name the file of a block, with their help."""

FURTHER: dict[str, dict[str, Any]] = {
    "model": {"autocompletion": model_names},
    "db": {"metavar": "URL"},
}
"""Further arguments of typer for options of fields."""

OUTPUT = (
    "--out", "--csv", "--plot", "--film", "--exaggerate", "--release", "--template", "--format",
    "--excel-text", "--verbose", "--json",
)  # fmt: skip
"""Options under the heading Output."""

MOST_USED = (
    "--height", "--width", "--dip", "--phi", "--kind", "--pgv", "--help", "--help-all",
    "--blocks", "--out", "--json", "--plot", "--age", "--hazard", "--imt", "--component",
    "--p2", "--kr", "--ky", "--displacement", "--motion", "--rockmass", "--gmf-data",
    "--weights", "--years", "--joint", "--magnitude", "--rjb", "--vs30", "--pga", "--sa10",
    "--sites", "--block", "--db", "--level", "--draws", "--vertical", "--rotation",
    "--age-sd", "--over", "--kr-sigma", "--model", "--units", "--verbose", "--phi-back",
    "--water", "--polygon", "--restitution", "--s1", "--s2", "--gamma",
)  # fmt: skip
"""Options by use, the most used first; those of a command that come first are in its --help."""

LONGEST_HELP = 25
"""Options that --help shows; --help-all shows the rest."""


def fields_of(*names: str, without: tuple[str, ...] = ()) -> FieldOptions:
    """Return the options of inputs, for `Annotated[Given, …]`."""
    return FieldOptions(names, without)


class Stacked:
    """A command whose parameters are option groups.

    The command line sees the options, made when it asks for them; the command gets the objects:
    dataclasses of options, and the inputs by field. Options that do not go together are rejected
    before the command runs (:mod:`rbfrag.cli.parameters.option_rules`).
    """

    def __init__(self, command: Callable[..., None]) -> None:
        update_wrapper(self, command, ("__module__", "__name__", "__qualname__", "__doc__"))
        self.__annotations__: dict[str, Any] = {}  # typer reads those of the signature
        self._command = command
        self._objects: dict[str, tuple[Callable[..., Any], list[str]]] = {}

    @property
    def __signature__(self) -> inspect.Signature:
        """The options as typer parameters."""
        hints = get_type_hints(self._command, include_extras=True)
        flat: list[inspect.Parameter] = []
        for name, parameter in inspect.signature(self._command).parameters.items():
            hint = hints[name]
            of_fields = [e for e in getattr(hint, "__metadata__", ()) if type(e) is FieldOptions]
            if of_fields:
                options = [*of_fields[0].options()]
                make: Callable[..., Any] = of_fields[0].read
            elif is_dataclass(hint):
                types = get_type_hints(hint, include_extras=True)
                options = [_parameter(item.name, types[item.name], item) for item in fields(hint)]
                make = partial(_build_object, hint)
            else:
                flat.append(_parameter(name, hint, parameter.default))
                continue
            self._objects[name] = make, [item.name for item in options]
            flat += options
        return inspect.Signature(flat)

    def __call__(self, **values: Any) -> None:
        """Run the command with the values of its options."""
        options = self.__signature__.parameters
        words = {name: word for name in options if (word := _word(options[name]))}
        used = [word for name, word in words.items() if values[name] != options[name].default]
        reject(self._command.__name__, used, frozenset(words.values()))
        objects = {
            name: make({option: values.pop(option) for option in names})
            for name, (make, names) in self._objects.items()
        }
        self._command(**values, **objects)


def stacked(command: Callable[..., None]) -> Callable[..., None]:
    """Make a command from a function with option groups; see :class:`Stacked`."""
    return Stacked(command)


def _build_object(kind: Any, values: Mapping[str, Any]) -> Any:
    return kind(**values)


def _parameter(name: str, annotation: Any, declared: Any) -> inspect.Parameter:
    """Return a typer parameter."""
    default = declared.default if isinstance(declared, Field) else declared
    if isinstance(declared, Field) and declared.metadata:
        about = dict(declared.metadata)
        make, word = about.pop("make"), about.pop("word", None)
        words = word if isinstance(word, tuple) else (word or "--" + name.replace("_", "-"),)
        names = words if make is typer.Option else ()
        annotation = Annotated[annotation, make(*names, **about)]
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=inspect.Parameter.empty if default is MISSING else default,
        annotation=annotation,
    )


def _word(option: inspect.Parameter) -> str | None:
    """Return the name of a parameter on the command line; None for an argument."""
    for about in getattr(option.annotation, "__metadata__", ()):
        names = (about.default, *(about.param_decls or ()))
        return next((name for name in names if str(name).startswith("--")), None)
    return None


_NEEDS: dict[type, str] = {float: "a number with a decimal point", int: "a whole number"}
"""What the value of an option of a type must be."""


def read_plainly(command: Any) -> None:
    """Let a command and its subcommands parse numbers and texts themselves.

    typer loads pydantic for this, even for options that are not given, which takes longer than
    most answers.
    """
    usual = command.get_params
    help_all: list[Any] = []  # made once, as a parser takes its options more than once

    def params(context: Any) -> list[Any]:
        every: list[Any] = usual(context)  # with --help, which the command itself does not list
        if len(every) > LONGEST_HELP:
            if not help_all:
                help_all.append(_help_all_option(every[-1]))
            every = [*every, *help_all]
        for parameter in every:
            parameter.process_value = partial(_read, parameter, type(parameter).process_value)
        return every

    command.get_params = params
    command.format_options = partial(_write_panels, command)
    for subcommand in getattr(command, "commands", {}).values():
        read_plainly(subcommand)


ALL_OPTIONS = "rbfrag.all_options"
"""Key of the metadata of a context whose help shows all options."""


def _help_all_option(help: Any) -> Any:
    """Return the option --help-all of a command, based on its option --help."""
    option = copy(help)
    option.name, option.opts = "help_all", ["--help-all"]
    option.help = "Show all options and exit."

    def show(context: Any, parameter: Any, value: bool) -> None:
        context.meta[ALL_OPTIONS] = True
        help.callback(context, parameter, value)

    option.callback = show
    return option


def _panel(option: Any) -> str:
    """Return the heading of an option or argument in the help."""
    if option.param_type_name == "argument":
        return "Arguments"
    if panel := getattr(option, "rich_help_panel", None):
        return str(panel)
    return "Output" if option.opts[0] in OUTPUT else "Options"


def _shown(options: list[Any], context: Any) -> list[Any]:
    """Return the options in the help: all, or the arguments and the most used options."""
    rank = {name: position for position, name in enumerate(MOST_USED)}

    def position(option: Any) -> tuple[bool, int]:
        return not option.required, min(rank.get(name, len(rank)) for name in option.opts)

    if context.meta.get(ALL_OPTIONS):
        return options
    arguments = [item for item in options if item.param_type_name == "argument"]
    most_used = sorted((item for item in options if item not in arguments), key=position)
    chosen = [*arguments, *most_used[:LONGEST_HELP]]
    return [item for item in options if item in chosen]


def _write_panels(command: Any, context: Any, formatter: Any) -> None:
    """Write the options of a command under the headings of their fields."""
    panels: dict[str, list[Any]] = {
        name: [] for name in ("Arguments", *PANELS, "Options", "Output")
    }
    options = [item for item in command.get_params(context) if item.get_help_record(context)]
    for item in _shown(options, context):
        panels[_panel(item)].append(item.get_help_record(context))
    for name, records in panels.items():
        if records:
            with formatter.section(name):
                formatter.write_dl(records)
    if hasattr(command, "format_commands"):
        command.format_commands(context, formatter)


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
