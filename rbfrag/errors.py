"""All errors that rbfrag raises on purpose.

    RbfragError
    ├── InputError                  a value, option or file that cannot be used   (exit 2)
    │   ├── UnknownFieldError       a keyword that is none
    │   ├── MotionFileError         an accelerogram that cannot be read
    │   │   ├── UnknownFormatError  no reader recognises the content
    │   │   └── UnitNotStatedError  neither the file nor the caller says the unit
    │   └── MissingExtraError       an optional dependency is not installed
    ├── DatabaseError               a database that cannot be used                (exit 2)
    │   ├── DatabaseNotFoundError
    │   ├── NotADatabaseError
    │   ├── SchemaVersionError      older or newer than this rbfrag
    │   ├── DatabaseReadOnlyError
    │   ├── DatabaseBusyError       locked by another process                     (exit 1)
    │   ├── DatabaseFailedError     disk full, input or output error, server gone (exit 1)
    │   └── MergeConflictError      two databases that contradict each other
    ├── ModelError                                                                (exit 2)
    │   ├── UnknownModelError       no fitted model of that name
    │   └── FitError                the data cannot carry the fit; the reason is in the message
    ├── WorkFailedError             part of the work failed; what finished is kept (exit 1)
    └── StoppedError                stopped on request; what finished is kept       (exit 130)

A message says what was wrong with the offending value, where (file and line), and
what to do next. It is one paragraph of less than 500 characters meant for a person, without a
traceback; what a file or a caller put into it is shortened, and control characters are shown as
Python escapes them, so that no input can steer a terminal.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable
from os import PathLike, fspath
from typing import ClassVar

MOST_CHARACTERS = 499
"""A longer message loses its middle: what was wrong stands first, what to do last."""

LONGEST_NAME = 200
"""Characters; what is longer names nothing, and no figure or table has room for it."""

_LONG_WORD = re.compile(r"(\S{60})\S{140,}")
_SPECTRAL = r"sa\([\d.]+\)(?:_sigma)?"
"""Names of spectral accelerations by their periods, which are those of the field ``sa_g``."""
_BLANKS = re.compile(r"[ \t]*[\r\n\t]\s*")
# control characters, line separators, and marks that turn the direction of writing around
_UNPRINTABLE = re.compile(
    "[\x00-\x1f\x7f-\x9f\xad\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ud800-\udfff]"
)


def one_paragraph(message: str) -> str:
    """Return a message for a terminal: one paragraph, printable, at most 499 characters."""
    text = _BLANKS.sub(" ", message.strip())
    text = _UNPRINTABLE.sub(lambda match: ascii(match[0])[1:-1], text)
    if len(text) > MOST_CHARACTERS:
        tail = MOST_CHARACTERS // 3
        text = f"{text[: MOST_CHARACTERS - tail - 3]} … {text[-tail:]}"
    return text


def spelled(text: str, fields: Collection[str], spell: Callable[[str], str]) -> str:
    """Return a text with its fields in the spelling of an interface.

    Args:
        text: a message, in which a field with a value stands as in Python: ``kind='rocking'``.
        fields: names that are spelled where they stand without a value, too.
        spell: returns the name of a field in the interface, ``--kind`` or ``kind``.
    """

    def with_value(match: re.Match[str]) -> str:
        name = spell(match[1])
        return f"{name}{' ' if name.startswith('-') else '='}{match[2]}"

    text = re.sub(r"\b([a-z]\w*)='(\w+)'", with_value, text)
    if not fields:
        return text
    names = "|".join(sorted(map(re.escape, fields), key=len, reverse=True))
    if "sa_g" in fields:
        names += rf"|{_SPECTRAL}"
    # no part of another word, of a path or of a file's name
    pattern = rf"(?<![\w./-])(?:{names})(?![\w/]|[.-]\w)"
    return re.sub(pattern, lambda match: spell(match[0]), text)


class RbfragError(Exception):
    """Base class of all errors raised on purpose; the message is for the user.

    Args:
        message: what is wrong; fields stand in it under their keywords.
        fields: those of them that each interface (CLI, HTTP, Python) prints in its own spelling.
    """

    exit_status: ClassVar[int] = 2

    def __init__(self, message: str = "", *, fields: Collection[str] = ()) -> None:
        super().__init__(one_paragraph(message))
        self.fields = tuple(fields)

    def spelled(self, spell: Callable[[str], str]) -> str:
        """Return the message with its fields in the spelling of an interface."""
        return spelled(str(self), self.fields, spell)


class InputError(RbfragError, ValueError):
    """A value, option or file that is invalid."""


class UnknownFieldError(InputError, TypeError):
    """An unknown keyword."""

    @classmethod
    def reject(cls, names: Iterable[str], typed_dict: type, subject: str) -> None:
        """Reject keywords that are not keys of a TypedDict.

        Args:
            subject: what they are said of, such as "a fit".
        """
        for name in names:
            if name not in typed_dict.__annotations__:
                raise cls(
                    f"unknown option {name[:60]} of {subject}; the options are "
                    f"{', '.join(typed_dict.__annotations__)}"
                )


class MotionFileError(InputError):
    """An accelerogram that cannot be read.

    Args:
        path: the file.
        reason: what is wrong, with the offending value, and what to do.
        line: 1-based line number of the trouble, when there is one.
        fields: as of every error.
    """

    def __init__(
        self,
        path: str | PathLike[str],
        reason: str,
        *,
        line: int | None = None,
        fields: Collection[str] = (),
    ) -> None:
        self.path = fspath(path)
        # a damaged file may hold a word of any length, which no person wants to see whole
        self.reason = _LONG_WORD.sub(r"\1…", reason)
        self.line = line
        where = self.path if line is None else f"{self.path}, line {line}"
        super().__init__(f"{where}: {self.reason}", fields=fields)

    def __reduce__(self) -> tuple[object, ...]:
        # Exceptions with keyword arguments do not survive the trip between processes otherwise.
        parts = (type(self), self.path, self.reason, self.line, self.fields)
        return (_rebuild_motion_file_error, parts)


def _rebuild_motion_file_error(
    kind: type[MotionFileError], path: str, reason: str, line: int | None, fields: tuple[str, ...]
) -> MotionFileError:
    return kind(path, reason, line=line, fields=fields)


class UnknownFormatError(MotionFileError):
    """No reader recognises the format of the file."""


class UnitNotStatedError(MotionFileError):
    """Neither the file nor the caller gives the unit of the accelerations."""


class MissingExtraError(InputError):
    """An optional dependency is not installed.

    Args:
        purpose: what needs it, as the start of a sentence ("Plots require matplotlib").
        extra: the rbfrag extra that brings it.
    """

    def __init__(self, purpose: str, extra: str) -> None:
        self.purpose = purpose
        self.extra = extra
        super().__init__(f"{purpose}: install it with  pip install 'rbfrag[{extra}]'")

    def __reduce__(self) -> tuple[object, ...]:
        return (MissingExtraError, (self.purpose, self.extra))


class DatabaseError(RbfragError):
    """A database that is invalid or inaccessible."""


class DatabaseNotFoundError(DatabaseError):
    """There is no database at this location."""


class NotADatabaseError(DatabaseError):
    """The file is not an SQLite database, or not one of rbfrag."""


class SchemaVersionError(DatabaseError):
    """The schema is older or newer than this rbfrag version."""


class DatabaseReadOnlyError(DatabaseError):
    """The database or its folder is not writable."""


class DatabaseBusyError(DatabaseError):
    """Another process has locked the database; completed work is kept."""

    exit_status: ClassVar[int] = 1


class DatabaseFailedError(DatabaseError):
    """The disk is full or fails, or the server is lost; completed work is kept."""

    exit_status: ClassVar[int] = 1


class MergeConflictError(DatabaseError):
    """Two databases with different results for the same input."""


class ModelError(RbfragError):
    """Error in a fragility model."""


class UnknownModelError(ModelError):
    """There is no fitted model with this name."""


class FitError(ModelError):
    """The data are insufficient for the fit; the message gives the reason."""


class WorkFailedError(RbfragError):
    """Part of the work failed; completed work is kept."""

    exit_status: ClassVar[int] = 1


class StoppedError(RbfragError):
    """Stopped on request; completed work is kept."""

    exit_status: ClassVar[int] = 130


def checked_name(name: str, label: str) -> str:
    """Return a valid name of a model, suite, earthquake, station or block; reject others.

    Args:
        name: the name; it may be empty.
        label: what it names, for the message: "the suite".

    Raises:
        InputError: it is longer than 200 characters.
    """
    if len(name) > LONGEST_NAME:
        raise InputError(
            f"{label} has a name of {len(name)} characters, {name[:40]!r}…: give it at most "
            f"{LONGEST_NAME}"
        )
    return name
