"""How far a long command is: one line on standard error."""

from __future__ import annotations

import sys
import time
from typing import Protocol

SECONDS_BETWEEN_LINES = 5.0
"""Pause between two lines where they are not rewritten in place [s]."""


class Progress(Protocol):
    """What a line tells of."""

    @property
    def done(self) -> int:
        """Things done."""

    @property
    def total(self) -> int:
        """Things to do."""

    @property
    def rate_per_s(self) -> float:
        """Things done per second; 0 while that is not known."""

    @property
    def seconds_left(self) -> float | None:
        """Estimated time left [s]."""


class ProgressLine:
    """A line on standard error: rewritten on a terminal, now and then elsewhere.

    Args:
        command: the command that is under way.
        things: what is counted.
    """

    def __init__(self, command: str, things: str) -> None:
        self._command = command
        self._things = things
        self._terminal = sys.stderr.isatty()
        self._last = -SECONDS_BETWEEN_LINES
        self._shown = False

    def __enter__(self) -> ProgressLine:
        return self

    def __exit__(self, *_: object) -> None:
        if self._terminal and self._shown:
            print(file=sys.stderr)

    def show(self, progress: Progress, remark: str = "") -> None:
        """Show how far the command is.

        Args:
            progress: what to tell.
            remark: something more about what is done, in brackets.
        """
        now = time.monotonic()
        finished = progress.done == progress.total
        if not self._terminal and now - self._last < SECONDS_BETWEEN_LINES and not finished:
            return
        self._last = now
        left = progress.seconds_left
        text = f"{self._command}: {progress.done}/{progress.total} {self._things}"
        if remark:
            text += f" ({remark})"
        if progress.rate_per_s:
            text += f", {progress.rate_per_s:.1f} per second"
        if left is not None and not finished:
            text += f", {int(left) // 60}:{int(left) % 60:02d} left"
        if self._terminal:
            print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)
            self._shown = True
        else:
            print(text, file=sys.stderr, flush=True)
