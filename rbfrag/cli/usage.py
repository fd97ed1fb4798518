"""Wrong command lines in one line: what is wrong, and the nearest right word."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any

from rbfrag.cli.parameters.option_groups import name_in_errors
from rbfrag.errors import one_paragraph
from rbfrag.vocabulary.quantities import name_of, option_of

_MOST_SUGGESTED = 3


def usage_message(error: Any) -> str:
    """Return the message of a usage error of typer."""
    context = error.ctx
    option: Any = getattr(error, "option_name", None)
    parameter = getattr(error, "param", None)
    message = one_paragraph(error.format_message())
    if hasattr(error, "possibilities"):
        options = [
            name
            for option_parameter in context.command.get_params(context)
            for name in option_parameter.opts
        ]
        message = f"unknown option {option}{_suggestion(option, options)}"
    elif option is not None:
        takes = "requires a value" if "requires" in message else "takes no value: omit it"
        message = f"{option} {takes}"
    elif parameter is not None:
        message = f"{name_in_errors(parameter)} is missing: {parameter.help}"
    elif message.startswith("No such command '"):
        word = message.split("'")[1]
        message = f"unknown command {word!r}{_suggestion(word, [*context.command.commands])}"
    elif message.startswith("Got unexpected"):
        message = f"unexpected argument {message.partition(' (')[2].rpartition(')')[0]}"
    if context is None:
        return message
    words = ["--help"]
    while context.parent is not None:
        words.insert(0, context.info_name)
        context = context.parent
    return f"{message} (help: rbfrag {' '.join(words)})"


def _suggestion(typed: str, words: list[str]) -> str:
    """Return the nearest of some words as a question."""
    # the name of a field in Python or in a table is an option, too
    near = [option_of(name_of(typed.lstrip("-").replace("-", "_")))]
    near = [name for name in near if name in words] or [
        name for name in words if len(typed) > len("--") and name.startswith(typed)
    ]
    near = near[:_MOST_SUGGESTED] or get_close_matches(typed, words, 1)
    *first, last = near or [""]
    return f"; did you mean {' or '.join(filter(None, (', '.join(first), last)))}?" if last else ""
