"""`rbfrag warm-up`: compiling the kernels at install time."""

from __future__ import annotations

import sys
import time

from rbfrag.cli.output import say_when_compiling

EXAMPLE = "Example:  rbfrag warm-up"


def warm_up() -> None:
    """Compile every kernel now, so that no later command waits.

    The machine code is kept beside the package where that can be written, else in the user's
    cache folder. Run it once at install time, by a user who may write there; what is compiled
    already is not compiled again.
    """
    from rbfrag.cli.warm_up import warm_up as prepared

    say_when_compiling()
    started = time.perf_counter()
    for what in prepared():
        print(f"warm-up: {what}", file=sys.stderr, flush=True)
    print(f"Every kernel is compiled, in {time.perf_counter() - started:.0f} s.")
