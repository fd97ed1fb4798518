"""A text file for another tool, whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from rbfrag.errors import InputError


def output_path(path: str | os.PathLike[str], suffixes: tuple[str, ...], what: str) -> Path:
    """Return the path if such a file can be written there; ask before long work.

    Raises:
        InputError: another suffix, or a folder that cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        raise InputError(
            f"{target}: the suffix {target.suffix!r} is none of {', '.join(suffixes)}: name {what} "
            "with one of them"
        )
    if target.is_dir():
        raise InputError(f"{target} is a folder: name a file in it")
    if not target.parent.is_dir():
        raise InputError(f"{target}: there is no folder {target.parent}: make it first")
    if not os.access(target.parent, os.W_OK):
        raise InputError(f"{target}: the folder cannot be written: choose another")
    return target


def write_text(text: str, target: Path) -> None:
    """Write a text (UTF-8); an existing file is replaced at the end, not before.

    Raises:
        InputError: the disk refuses.
    """
    partial = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        partial.write_text(text, encoding="utf-8", newline="\n")
        partial.replace(target)
    except OSError as error:
        raise InputError(f"{target} cannot be written: {error.strerror or error}") from None
    finally:
        partial.unlink(missing_ok=True)
