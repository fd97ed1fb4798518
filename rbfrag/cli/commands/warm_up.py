"""`rbfrag warm-up`: compile the kernels at installation."""

from __future__ import annotations

import sys
import time

from rbfrag.cli.output import say_when_compiling

EXAMPLE = "Example:  rbfrag warm-up"


def warm_up() -> None:
    """Compile all kernels, so that later commands start faster.

    The machine code is stored next to the package if that folder is writable, else in the cache
    folder of the user. Run it once after installation as a user with write access; compiled kernels
    are not compiled again.
    """
    from rbfrag.cli.warm_up import warm_up as prepared

    say_when_compiling()
    started = time.perf_counter()
    for step in prepared():
        print(f"warm-up: {step}", file=sys.stderr, flush=True)
    print(f"Every kernel is compiled, in {time.perf_counter() - started:.0f} s.")
