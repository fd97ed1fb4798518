"""Options that travel together as one object: declared once, handed to a command whole."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import MISSING, Field, field, fields, is_dataclass
from functools import partial, wraps
from typing import Annotated, Any, get_type_hints

import typer

from rbfrag.cli.parameters.refusals import refuse


def option(
    help: str, default: Any = None, *, word: str | tuple[str, ...] | None = None, **about: Any
) -> Any:
    """Declare an option: a field of a dataclass, or a parameter of a command.

    Args:
        help: what it is, with its unit.
        default: its value where it is not given; ``...`` for an option that must be given.
        word: what it is called, or all that it is called; None for the name of the field.
        about: what else typer takes, such as metavar.
    """
    return _declared(typer.Option, help, default, about | {"word": word})


def argument(help: str, default: Any = ..., **about: Any) -> Any:
    """Declare an argument, likewise; it must be given unless it has a default."""
    return _declared(typer.Argument, help, default, about)


def _declared(make: Any, help: str, default: Any, about: dict[str, Any]) -> Any:
    declared = {"make": make, "help": help, **about}
    return field(default=MISSING if default is ... else default, metadata=declared)


def command_group(help: str, epilog: str) -> typer.Typer:
    """Return an empty group of commands.

    Args:
        help: what the group does.
        epilog: an example.
    """
    return typer.Typer(
        help=help, epilog=epilog, no_args_is_help=True, rich_markup_mode=None, add_completion=False
    )


def stacked(command: Callable[..., None]) -> Callable[..., None]:
    """Make each field of the dataclasses among a command's parameters an option of its own.

    The command line sees the fields; the command gets the objects. Options that do not go
    together are refused before the command runs (:mod:`rbfrag.cli.parameters.refusals`).
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, tuple[type[Any], list[str]]] = {}
    flat: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        if not is_dataclass(hints[name]):
            flat.append(_parameter(name, hints[name], parameter.default))
            continue
        kind: Any = hints[name]
        types = get_type_hints(kind, include_extras=True)
        options = [_parameter(each.name, types[each.name], each) for each in fields(kind)]
        groups[name] = kind, [each.name for each in options]
        flat += options
    defaults = {each.name: each.default for each in flat}
    words = {each.name: word for each in flat if (word := _word(each))}
    known = frozenset(words.values())

    @wraps(command)
    def run(**values: Any) -> None:
        given = [word for name, word in words.items() if values[name] != defaults[name]]
        refuse(command.__name__, given, known)
        whole = {
            name: kind(**{option: values.pop(option) for option in options})
            for name, (kind, options) in groups.items()
        }
        command(**values, **whole)

    run.__signature__ = inspect.Signature(flat)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in flat}
    return run


def _parameter(name: str, annotation: Any, declared: Any) -> inspect.Parameter:
    """Return a parameter as typer reads it."""
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
    """Return what a parameter is called on the command line; None for an argument."""
    for about in getattr(option.annotation, "__metadata__", ()):
        names = (about.default, *(about.param_decls or ()))
        return next((name for name in names if str(name).startswith("--")), None)
    return None


_NEEDS: dict[type, str] = {
    float: "give a number, with a point before its decimals",
    int: "give a whole number",
}
"""What to give for an option of a type where its text is none."""


def read_plainly(command: Any) -> None:
    """Let a command and those below it read numbers and texts by themselves.

    typer loads pydantic for this, even for options that are not given, which takes longer than
    most answers.
    """
    usual = command.get_params

    def params(context: Any) -> list[Any]:
        every: list[Any] = usual(context)  # with --help, which the command itself does not list
        for each in every:
            each.process_value = partial(_read, each, type(each).process_value)
        return every

    command.get_params = params
    for each in getattr(command, "commands", {}).values():
        read_plainly(each)


def _read(parameter: Any, usual: Any, context: Any, value: Any) -> Any:
    """Return the value of an option or argument as a command takes it."""
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
        wanted = _NEEDS[kind]
    else:
        if parameter.min is None or number >= parameter.min:
            return number
        wanted = f"give {parameter.min} or more"
    raise typer.BadParameter(f"{value!r} cannot be used: {wanted}", ctx=context, param=parameter)
