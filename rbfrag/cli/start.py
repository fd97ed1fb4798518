"""The console script: a plain question to `predict` is answered without the command-line library.

Loading typer, and pydantic for each kind of option, takes several times as long as the answer.
"""

from __future__ import annotations

import sys


def run() -> None:
    """Entry point of the console script."""
    if sys.argv[1:2] == ["predict"]:
        from rbfrag.cli.quick_predict import quick_predict

        status = quick_predict(sys.argv[2:])
        if status is not None:
            raise SystemExit(status)
    from rbfrag.cli.main import run as full

    full()


if __name__ == "__main__":
    run()
