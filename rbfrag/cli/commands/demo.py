"""`rbfrag demo`: a complete example on recorded ground motions."""

from __future__ import annotations

import os
import shlex
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import typer

from rbfrag.cli.command import option

EXAMPLE = "Example:  rbfrag demo"

NEXT = (
    "rbfrag block --template blocks.xlsx",
    "rbfrag report blocks.xlsx --pgv 0.6 --out blocks.pdf",
    "rbfrag serve",
)
"""Commands that are named at the end, with the extras that `make demo` installs."""


def demo(*, context: typer.Context, folder: str = option("Output folder", ".")) -> None:
    """Run an example from records to a prediction.

    The steps are records, responses, campaign, fit, prediction and two figures. The records are the
    18 samples of the extra rbfrag[samples], or else analytic pulses. Each command is printed before
    it runs. The results are rbfrag-demo.db, rbfrag-demo-response.png and rbfrag-demo-fit.png.
    """
    from rbfrag.errors import InputError
    from rbfrag.motions.sample_motions import demo_motions, sample_folder

    home = Path(folder)
    if not home.is_dir():
        raise InputError(f"--folder: create the folder {home} first")
    database = home / "rbfrag-demo.db"
    response_png, fit_png = home / "rbfrag-demo-response.png", home / "rbfrag-demo-fit.png"
    for suffix in ("", "-wal", "-shm"):
        database.with_name(database.name + suffix).unlink(missing_ok=True)
    started = time.perf_counter()
    records, sentence = demo_motions(home)
    print(sentence)
    db = ("--db", str(database))
    with _second_process() as finish:
        for arguments in (
            ("motions", "add", *map(str, records), "--suite", "demo", *db),
            ("motions", "list", *db),
            ("respond", "1", "--p2", "3", "--kr", "0.1", "--plot", str(response_png), *db),
            ("critical", "1", "--p2", "3", *db),
            ("simulate", "--suite", "demo", *db),
            ("fit", "--term", "pgv", "--suite", "demo", *db),
            ("plot", "fit", "--out", str(fit_png), *db),
            ("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6", *db),
        ):
            if arguments[0] == "critical":
                finish()
            _run(context, arguments)
    print(f"\ndone in {time.perf_counter() - started:.0f} s; written:")
    for path in (database, response_png, fit_png):
        print(f"  {path}")
    if sample_folder() is None:
        print(f"\n{sentence}")
    print("\nnext:")
    for command in (f"rbfrag critical 1 --height 2 --width 0.5 {shlex.join(db)}", *NEXT):
        print(f"  {command}")


def _run(context: typer.Context, arguments: tuple[str, ...]) -> None:
    print(f"\n$ rbfrag {shlex.join(arguments)}", flush=True)
    status = context.find_root().command.main(list(arguments), "rbfrag", standalone_mode=False)
    if status:
        raise typer.Exit(int(status))


@contextmanager
def _second_process() -> Iterator[Callable[[], None]]:
    """Compile the search in a second process, unless it is compiled or there is one processor.

    Yields a function that compiles the rest of the campaign and waits for the second process. The
    commands before it compile other kernels, so that hardly any is compiled twice.
    """
    import multiprocessing

    from rbfrag.campaign.executors import held_back
    from rbfrag.cli.commands.warm_up import compile_grid, compile_search
    from rbfrag.solver.integrator.compiled import is_missing_on_disk
    from rbfrag.solver.search.march import march

    if os.cpu_count() == 1 or not is_missing_on_disk(march):
        yield lambda: None
        return
    process = multiprocessing.get_context("spawn").Process(target=compile_search)

    def finish() -> None:
        compile_grid()
        process.join()

    with held_back():
        process.start()
    try:
        yield finish
    finally:  # an error or Ctrl-C ends it, too; numba leaves no half-written file
        process.kill()
        process.join()
