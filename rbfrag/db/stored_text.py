"""Text that every database takes."""

from __future__ import annotations


def storable(text: str) -> str:
    r"""Return text without what databases refuse, changed visibly.

    File names may hold bytes that are no text, and damaged headers hold NUL; both become
    ``\x..`` instead of failing the insert.
    """
    visible = text.replace("\x00", "\\x00")
    return visible.encode("utf-8", "backslashreplace").decode("utf-8")
