"""`rbfrag simulate`: the critical block of every motion, polarity and block size."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Annotated

import typer

from rbfrag.cli import options
from rbfrag.cli.number_list import number_list
from rbfrag.cli.output import print_json, print_pairs

if TYPE_CHECKING:
    from rbfrag.campaign.simulate import CampaignProgress

EXAMPLE = "Example:  rbfrag simulate --p2 30,10,3,1,0.3,0.1 --jobs 2"

SECONDS_BETWEEN_LINES = 5.0


def simulate(
    suite: options.Suite = None,
    p2: Annotated[
        str, typer.Option("--p2", help="Frequency parameters p² [1/s²], separated by commas.")
    ] = "30,10,3,1,0.3,0.1",
    jobs: Annotated[
        int | None,
        typer.Option(
            "--jobs",
            help="Worker processes. Default: one per processor.",
            show_default=False,
        ),
    ] = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Find and store the critical block of every motion x polarity x p2.

    Each combination is stored as soon as it is found. After Ctrl-C, a crash or a kill, the
    same command goes on where it stopped; what is stored is not computed again.
    """
    from rbfrag.campaign.simulate import simulate as run

    with _Progress() as progress:
        summary = run(
            db, suite=suite, p2=number_list(p2, "--p2"), jobs=jobs, on_progress=progress.show
        )
    if json:
        print_json(summary.as_dict())
    else:
        print_pairs(summary.as_dict())


class _Progress:
    """A line on standard error: rewritten on a terminal, now and then elsewhere."""

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()
        self._last = -SECONDS_BETWEEN_LINES
        self._shown = False

    def __enter__(self) -> _Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._terminal and self._shown:
            print(file=sys.stderr)

    def show(self, progress: CampaignProgress) -> None:
        """Show how far the campaign is."""
        now = time.monotonic()
        finished = progress.done == progress.total
        if not self._terminal and now - self._last < SECONDS_BETWEEN_LINES and not finished:
            return
        self._last = now
        left = progress.seconds_left
        text = f"simulate: {progress.done}/{progress.total} combinations"
        if progress.resumed:
            text += f" ({progress.resumed} stored before)"
        if progress.rate_per_s:
            text += f", {progress.rate_per_s:.1f} per second"
        if left is not None and not finished:
            text += f", {int(left) // 60}:{int(left) % 60:02d} left"
        if self._terminal:
            print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)
            self._shown = True
        else:
            print(text, file=sys.stderr, flush=True)
