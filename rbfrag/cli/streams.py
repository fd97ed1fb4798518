"""Output to any terminal and any disk."""

from __future__ import annotations

import codecs
import os
import sys

_IN_ASCII = {
    "²": "2", "³": "3", "⁻": "-", "·": "*", "±": "+-", "–": "-", "−": "-", "…": "...", "≥": ">=",
    "≤": "<=", "°": " deg", "π": "pi", "φ": "phi", "β": "beta", "θ": "theta", "σ": "sigma",
    "Å": "A", "ø": "o", "é": "e",
}  # fmt: skip
"""What stands for a character that a stream cannot write; "?" for any other."""


def _plainly(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end]
    return "".join(_IN_ASCII.get(character, "?") for character in text), error.end


def write_plainly() -> None:
    """Replace characters that a stream cannot encode, instead of failing."""
    codecs.register_error("plainly", _plainly)
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="plainly")


def end_unwritten(error: OSError) -> None:
    """End with status 1 and an explanation where output cannot be written."""
    if not isinstance(error, BrokenPipeError):  # nobody reads on, which is no error
        print(f"rbfrag: the answer cannot be written: {error.strerror}", file=sys.stderr)
    # what is left unwritten would be tried again, and complained of, when the program ends
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    raise SystemExit(1)
