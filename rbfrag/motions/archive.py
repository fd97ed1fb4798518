"""Records in a zip: its members are addressed as files below it, ``FILE.zip/chan001.v2``.

Nothing is unpacked to a disk. What a zip states of its sizes is bounded before anything is read,
and no more is read than it states.
"""

from __future__ import annotations

import os
import struct
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from rbfrag.errors import MotionFileError
from rbfrag.files import packed_as
from rbfrag.motions.text import LARGEST_FILE_BYTES

DOCUMENTS = frozenset({".md", ".rst", ".pdf", ".htm", ".html", ".doc", ".docx", ".xml"})
"""Endings of files about records, StationXML among them: passed over among others, read when
named."""

_OFFICE_PART = "[Content_Types].xml"
"""Member of every workbook and document of an office program."""

LARGEST_RATIO = 200
"""Text of numbers shrinks to a third or a tenth, zeros to a hundredth."""

LARGEST_DIRECTORY_BYTES = 4 * 1024**2
"""Of the list of members: more than ten thousand of them."""

_TAIL_BYTES = 2**16 + 64
"""In which the end of that list stands, below a comment of any length."""

_END, _END_64, _END_FORMAT = b"PK\x05\x06", b"PK\x06\x07", "<4s4H2LH"


def archive_of(path: Path) -> Path | None:
    """Return the zip that a path leads into; None for a separate file or a missing one."""
    if os.path.exists(path):  # noqa: PTH110  # no name is too long for it
        return None
    return next((above for above in path.parents if is_archive(above)), None)


def is_archive(path: Path) -> bool:
    """Return whether a path is a zip, by its content."""
    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return packed_as(file.read(4)) == "zip"
    except (OSError, ValueError):
        return False


def is_there(path: Path) -> bool:
    """Return whether a path is a file or a folder, or the member of a zip that can be read."""
    archive = archive_of(path)
    if archive is None:
        return os.path.exists(path)  # noqa: PTH110
    try:
        with _opened(archive) as members:
            return path.relative_to(archive).as_posix() in members
    except MotionFileError:
        return False


def records_among(files: Iterable[Path]) -> list[Path]:
    """Return the record files of a folder or zip, sorted.

    Hidden files are not, nor texts about records, nor the spectra (V3) of a record (V2) next to
    them.
    """
    files = list(files)
    names = {(file.parent, file.name.lower()) for file in files}
    return sorted(
        file
        for file in files
        if not file.name.startswith(".")
        and "__MACOSX" not in file.parts
        and file.suffix.lower() not in DOCUMENTS
        and not (
            file.suffix.lower() == ".v3"
            and (file.parent, file.with_suffix(".v2").name.lower()) in names
        )
    )


def members_of(archive: Path) -> list[Path]:
    """Return the records of a zip, each as a path below it.

    Raises:
        MotionFileError: it is damaged, too large, or holds none.
    """
    with _opened(archive) as members:
        if _OFFICE_PART in members:
            raise MotionFileError(
                archive, "this is a workbook or document, not a record: save the sheet as CSV"
            )
        total = sum(info.file_size for info in members.values())
        records = records_among(archive / name for name in members)
    if total > LARGEST_FILE_BYTES:
        raise MotionFileError(
            archive,
            f"its members are {total} bytes long: give one of them, or use smaller archives",
        )
    if not records:
        raise MotionFileError(archive, "the zip archive has no record")
    return records


def member_bytes(archive: Path, path: Path) -> bytes:
    """Return the content of a member of a zip, named as a path below it."""
    name = path.relative_to(archive).as_posix()
    with _opened(archive) as members:
        info = members.get(name)
        if info is None:
            examples = ", ".join(sorted(members)[:5])
            raise MotionFileError(
                path, f"no such member in the zip archive; members are, for example, {examples}"
            )
        if info.file_size > LARGEST_FILE_BYTES:
            raise MotionFileError(path, f"{info.file_size} bytes are too large for an accelerogram")
        if info.file_size > LARGEST_RATIO * max(info.compress_size, 1):
            raise MotionFileError(
                path, f"its compression ratio exceeds {LARGEST_RATIO}: not a record"
            )
        if info.flag_bits & 1 or info.compress_type not in {
            zipfile.ZIP_STORED,
            zipfile.ZIP_DEFLATED,
        }:
            raise MotionFileError(
                path, "encrypted or not compressed with deflate: unpack the zip archive"
            )
        with members.zip.open(info) as file:
            return file.read(info.file_size)


class _Members(dict[str, zipfile.ZipInfo]):
    """Members by name, and the zip that they are read from."""

    zip: zipfile.ZipFile


@contextmanager
def _opened(archive: Path) -> Iterator[_Members]:
    members = _Members()
    try:
        with archive.open("rb") as file:
            _check_directory(archive, file)
            members.zip = zipfile.ZipFile(file)
            for info in members.zip.infolist():
                if info.is_dir():
                    continue
                name, shown = PurePosixPath(info.filename), repr(info.filename[:60])
                if name.is_absolute() or ".." in name.parts or ":" in info.filename:
                    raise MotionFileError(archive, f"its member {shown} points outside the archive")
                if name.as_posix() in members:
                    raise MotionFileError(archive, f"it has {shown} twice")
                members[name.as_posix()] = info
            yield members
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError, struct.error,
            NotImplementedError, RuntimeError) as error:  # fmt: skip
        if isinstance(error, MotionFileError):
            raise
        words = " ".join(str(error).split())[:150]
        raise MotionFileError(archive, f"the zip is damaged ({words}): download it again") from None


def _check_directory(archive: Path, file: BinaryIO) -> None:
    """Reject a zip whose directory would not fit into memory."""
    file.seek(max(file.seek(0, os.SEEK_END) - _TAIL_BYTES, 0))
    tail = file.read(_TAIL_BYTES)
    at = tail.rfind(_END)
    end = tail[at : at + struct.calcsize(_END_FORMAT)]
    size = struct.unpack(_END_FORMAT, end)[5]
    if tail[max(at - 20, 0) : at].startswith(_END_64) or size > LARGEST_DIRECTORY_BYTES:
        raise MotionFileError(archive, "too many members: unpack it")
