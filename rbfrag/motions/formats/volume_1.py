"""Where the samples of a volume 1 block begin: below 7 lines of integers and 7 of reals."""

from __future__ import annotations

from collections.abc import Sequence

from rbfrag.motions.text.file import holds_integers
from rbfrag.motions.text.record_file import RecordFile

NUMERIC_LINES = 14

_END = "/&"


def data_lines(file: RecordFile, span: range, header_line: int) -> tuple[int, Sequence[str]]:
    """Return the index of a block's first line of samples, and its lines of samples.

    Args:
        file: the file.
        span: indices of the block's lines.
        header_line: 1-based line of the last header field that was found; the numeric header
            lies below it.

    Raises:
        MotionFileError: the block ends before its samples.
    """
    lines = file.lines
    stop = next((at for at in span if lines[at].startswith(_END)), span.stop)
    first = next((at for at in range(header_line, stop) if holds_integers(lines[at])), stop)
    first += NUMERIC_LINES
    if first >= stop:
        raise file.error(
            f"no samples follow the header: {NUMERIC_LINES} lines of numbers and then the samples "
            "were expected; the file is truncated, export the record again",
            header_line,
        )
    return first, file.data(first, stop)
