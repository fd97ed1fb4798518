"""The sheet every figure is drawn on, and how it gets into a file.

Figures are made without pyplot: no window, no global state, safe in threads and services.
"""

from __future__ import annotations

import os
import tempfile
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from rbfrag.errors import InputError, MissingExtraError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".pdf", ".svg")
"""File types that a figure can be saved as."""


def new_figure(width_in: float = 7.0, height_in: float = 5.0) -> Figure:
    """Return an empty figure whose parts arrange themselves without overlap.

    Args:
        width_in: width [inch].
        height_in: height [inch].

    Raises:
        MissingExtraError: matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingExtraError("Plots need matplotlib", "plot") from None
    return Figure(figsize=(width_in, height_in), layout="constrained")


def plot_path(path: str | PathLike[str]) -> Path:
    """Return the path if a figure can be saved there; ask before long work.

    Raises:
        InputError: the suffix is none of png, pdf, svg, or the folder cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"plot file {target}: the suffix {target.suffix!r} is none of "
            f"{', '.join(SUFFIXES)}: name the file with one of them"
        )
    if target.is_dir():
        raise InputError(f"plot file {target} is a folder: name a file in it")
    if not target.parent.is_dir():
        raise InputError(f"plot file {target}: there is no folder {target.parent}: make it first")
    if not os.access(target.parent, os.W_OK):
        raise InputError(f"plot file {target}: the folder cannot be written: choose another")
    return target


def save_figure(figure: Figure, path: str | PathLike[str]) -> Path:
    """Write a figure as PNG, PDF or SVG by the suffix of the path.

    The file appears whole or not at all.

    Args:
        figure: the figure.
        path: file to write; an existing file is replaced.

    Returns:
        The path.

    Raises:
        InputError: as for :func:`plot_path`, or the disk refuses.
    """
    target = plot_path(path)
    kind = target.suffix.lower()[1:]
    unfinished: Path | None = None
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem}-")
        unfinished = Path(name)
        with os.fdopen(handle, "wb") as stream:
            figure.savefig(stream, format=kind, dpi=160)
        # A temporary file is private; a figure has the permissions of any new file.
        mask = os.umask(0)
        os.umask(mask)
        unfinished.chmod(0o666 & ~mask)
        unfinished.replace(target)
    except OSError as error:
        raise InputError(f"plot file {target} cannot be written: {error.strerror}") from error
    finally:
        if unfinished is not None:
            unfinished.unlink(missing_ok=True)
    return target
