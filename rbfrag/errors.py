"""Every error that rbfrag raises on purpose.

    RbfragError
    ├── InputError                  a value, option or file that cannot be used   (exit 2)
    │   ├── MotionFileError         an accelerogram that cannot be read
    │   │   └── UnknownFormatError  no reader recognises the content
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
    └── WorkFailedError             part of the work failed; what finished is kept (exit 1)

A message says what was wrong with the offending value, where (file and line), and
what to do next. It is one paragraph meant for a person, without a traceback.
"""

from __future__ import annotations

import re
from os import PathLike, fspath
from typing import ClassVar

_LONG_WORD = re.compile(r"(\S{60})\S{140,}")


class RbfragError(Exception):
    """Base of all errors raised on purpose; the message is meant for a person."""

    exit_status: ClassVar[int] = 2


class InputError(RbfragError, ValueError):
    """A value, option or file that cannot be used."""


class MotionFileError(InputError):
    """An accelerogram that cannot be read.

    Args:
        path: the file.
        reason: what is wrong, with the offending value, and what to do.
        line: 1-based line number of the trouble, when there is one.
    """

    def __init__(self, path: str | PathLike[str], reason: str, *, line: int | None = None) -> None:
        self.path = fspath(path)
        # a damaged file may hold a word of any length, which no person wants to see whole
        self.reason = _LONG_WORD.sub(r"\1…", reason)
        self.line = line
        where = self.path if line is None else f"{self.path}, line {line}"
        super().__init__(f"{where}: {self.reason}")

    def __reduce__(self) -> tuple[object, ...]:
        # Exceptions with keyword arguments do not survive the trip between processes otherwise.
        return (_rebuild_motion_file_error, (type(self), self.path, self.reason, self.line))


def _rebuild_motion_file_error(
    kind: type[MotionFileError], path: str, reason: str, line: int | None
) -> MotionFileError:
    return kind(path, reason, line=line)


class UnknownFormatError(MotionFileError):
    """No reader recognises the content of the file."""


class MissingExtraError(InputError):
    """An optional dependency is not installed.

    Args:
        purpose: what needs it, as the start of a sentence ("Plots need matplotlib").
        extra: the rbfrag extra that brings it.
    """

    def __init__(self, purpose: str, extra: str) -> None:
        self.purpose = purpose
        self.extra = extra
        super().__init__(f"{purpose}: install it with  pip install 'rbfrag[{extra}]'")

    def __reduce__(self) -> tuple[object, ...]:
        return (MissingExtraError, (self.purpose, self.extra))


class DatabaseError(RbfragError):
    """A database that cannot be used."""


class DatabaseNotFoundError(DatabaseError):
    """There is no database at the given place."""


class NotADatabaseError(DatabaseError):
    """The file is no SQLite database, or not one of rbfrag's."""


class SchemaVersionError(DatabaseError):
    """The schema is older or newer than this rbfrag."""


class DatabaseReadOnlyError(DatabaseError):
    """The database or its folder cannot be written."""


class DatabaseBusyError(DatabaseError):
    """Another process holds the database; what was finished is kept."""

    exit_status: ClassVar[int] = 1


class DatabaseFailedError(DatabaseError):
    """The disk is full or fails, or the server is gone; what was finished is kept."""

    exit_status: ClassVar[int] = 1


class MergeConflictError(DatabaseError):
    """Two databases that say different things about the same input."""


class ModelError(RbfragError):
    """Trouble with a fragility model."""


class UnknownModelError(ModelError):
    """No fitted model of that name."""


class FitError(ModelError):
    """The data cannot carry the fit; the reason is in the message."""


class WorkFailedError(RbfragError):
    """Part of the work failed; what finished is kept."""

    exit_status: ClassVar[int] = 1
