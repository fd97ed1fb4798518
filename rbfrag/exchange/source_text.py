"""The text of a file that another tool wrote."""

from __future__ import annotations

import os
from pathlib import Path

from rbfrag.errors import InputError

MOST_BYTES = 1 << 28
"""Larger files are refused: no curve or fragility model is 256 MB long."""


def source_text(path: str | os.PathLike[str], what: str) -> str:
    """Return the whole text of a file.

    Args:
        path: the file.
        what: what it should hold, for messages: "a hazard curve".

    Raises:
        InputError: the file cannot be read, is empty, too large or not text (UTF-8).
    """
    source = Path(path)
    try:
        if source.is_dir():
            raise InputError(f"{source} is a folder: name a file with {what} in it")
        size = source.stat().st_size
        if size > MOST_BYTES:
            raise InputError(
                f"{source} has {size} bytes, more than {MOST_BYTES}: this is not {what}"
            )
        text = source.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{source}: no such file; name a file with {what}") from None
    except UnicodeDecodeError as error:
        raise InputError(
            f"{source}: byte {error.start} is not UTF-8 text: this is not {what}"
        ) from None
    except OSError as error:
        raise InputError(f"{source}: cannot be read: {error.strerror or error}") from None
    if not text.strip():
        raise InputError(f"{source} is empty: name a file with {what}")
    return text
