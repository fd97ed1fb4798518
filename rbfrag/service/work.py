"""Long work in processes beside the one that answers, each task with a limit of time.

A task takes numbers and texts, those of the parameters of its route, and returns JSON, so that
nothing else travels between the processes.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import signal
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal

from fastapi import Request
from pebble import ProcessExpired, ProcessPool

from rbfrag.errors import InputError, MotionFileError
from rbfrag.service.json_body import MalformedError, json_text, read_json
from rbfrag.service.problem import busy, gone, too_much_work

if TYPE_CHECKING:
    from rbfrag.motions.ground_motion import GroundMotion

FILE = "the file"
"""What messages call an accelerogram or a curve that was sent."""


EXAMPLE = "time_s,acceleration_g\n" + "".join(
    f"{0.1 * i:.1f},{value}\n"
    for i, value in enumerate((0.0, 0.2, 0.4, 0.4, 0.2, -0.2, -0.4, -0.4, -0.2, 0.0))
)
"""A made-up accelerogram, short enough for the documentation."""


def warm_up() -> None:
    """Load or compile the kernels, so that no request waits for that or is ended for it."""
    spectrum(EXAMPLE.encode(), None, None, None, [3.0], "forward")
    critical(EXAMPLE.encode(), None, None, None, 3.0, False, False, False)


def rock_mass(
    body: bytes,
    form: Literal["toml", "json", "csv"],
    measures: Mapping[str, float],
    n: int | None,
    seed: int | None,
    model: str | None,
    level: float | None,
    row_limit: int,
    db: str | None,
) -> bytes:
    """Return what `rbfrag rockmass --json` prints."""
    from rbfrag.rockmasses.counts import crossings, mode_counts
    from rbfrag.rockmasses.file import (
        rock_mass_of_csv,
        rock_mass_of_tables,
        rock_mass_of_toml,
    )
    from rbfrag.rockmasses.report import as_dict
    from rbfrag.rockmasses.scenario import scenario

    if form == "json":
        document = read_json(body)
        if not isinstance(document, dict):
            raise InputError("the body is a JSON object with the tables base, back and friction")
        described = rock_mass_of_tables(document)
    else:
        described = (rock_mass_of_toml if form == "toml" else rock_mass_of_csv)(_text(body))
    wanted = described.realisations if n is None else n
    if wanted > row_limit:
        raise InputError(
            f"{wanted} realisations are more than the {row_limit} of one request: ask for fewer "
            "with n"
        )
    extra = "level" if model is None else "model"
    if not measures and not (model is None and level is None):
        raise InputError(
            f"{extra} goes with a measure of the motion: give pgv, pga and tm, or pgd and tm, too"
        )
    made = described.realise(n, seed)
    answer = None
    if measures:
        level = 0.95 if level is None else level
        answer = scenario(made, **measures, model=model, level=level, db=db)
    return json_text(as_dict(made, mode_counts(made), crossings(made), answer))


def spectrum(
    body: bytes,
    trace: int | None,
    units: str | None,
    dt_s: float | None,
    p2: list[float],
    polarity: str,
) -> bytes:
    """Return what `rbfrag spectrum --json` prints."""
    from rbfrag.motions.polarity import POLARITIES
    from rbfrag.motions.toppling_spectrum import spectrum_as_dict as as_dict

    ground = _motion(body, trace, units, dt_s)
    asked = [each for each in POLARITIES if polarity in (each, "both")]
    answers = [as_dict(ground.label, ground, p2, each) for each in asked]
    return json_text(answers[0] if len(answers) == 1 else answers)


def critical(
    body: bytes,
    trace: int | None,
    units: str | None,
    dt_s: float | None,
    p2: float,
    reverse: bool,
    linear: bool,
    full_map: bool,
) -> bytes:
    """Return what `rbfrag critical --json` prints."""
    from rbfrag.solver.reports import critical_as_dict
    from rbfrag.solver.search.critical import critical as search

    result = search(
        _motion(body, trace, units, dt_s),
        p2=p2,
        polarity="reverse" if reverse else "forward",
        linear=linear,
        full_map=full_map,
    )
    return json_text(critical_as_dict(result, full_map=full_map))


def hazard(
    body: bytes,
    imt: str | None,
    site: str | None,
    p2: float,
    kr: float,
    given: Mapping[str, Any],
    db: str | None,
) -> bytes:
    """Return what `rbfrag hazard --json` prints."""
    from rbfrag.exchange.hazard_curves import hazard_curves_in, suited_curves
    from rbfrag.hazards.answer import hazard as answer
    from rbfrag.hazards.conversions import velocity_conversion
    from rbfrag.hazards.report import as_dict
    from rbfrag.solver.quantity import positive

    p2, kr = positive(p2, "p2", "1/s²"), positive(kr, "kr", "g")
    convert = given.get("convert")
    try:
        found = hazard_curves_in(_text(body), FILE, imt=imt, site=site)
    except RecursionError:
        raise MalformedError("the body is nested too deeply") from None
    curves = suited_curves(
        found,
        with_mean_period=given.get("tm_s") is not None,
        converted_period_s=None if convert is None else velocity_conversion(convert).period_s,
    )
    rates = [answer(curve, p2, kr, **given, db=db) for curve in curves]
    return json_text(as_dict(curves, [None], rates))


def _motion(body: bytes, trace: int | None, units: str | None, dt_s: float | None) -> GroundMotion:
    from rbfrag.motions.recognise import motions_in

    try:
        found = motions_in(body, "upload", units=units, dt_s=dt_s)
    except MotionFileError as error:
        where = FILE if error.line is None else f"{FILE}, line {error.line}"
        raise InputError(f"{where}: {error.reason}") from None
    except RecursionError:
        raise MalformedError("the body is nested too deeply") from None
    if trace is None and len(found) == 1:
        return found[0]
    if trace is not None and 0 <= trace < len(found):
        return found[trace]
    listed = ", ".join(f"{i} ({each.component})" for i, each in enumerate(found))
    trouble = f"holds {len(found)} traces" if trace is None else f"has no trace {trace}"
    raise InputError(f"{FILE} {trouble}: name one of  {listed}  as trace=0, for example")


def _text(body: bytes) -> str:
    try:
        text = body.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MalformedError(f"byte {error.start} of the body is not UTF-8 text") from None
    if not text.strip():
        raise MalformedError("the body is empty")
    return text


TASKS_PER_PROCESS = 500
"""Tasks that a process does before a new one takes its place."""


class WorkerPool:
    """Processes that work, started when they are first needed.

    Args:
        jobs: how many.
        time_limit_s: longest time [s] that a task may take, its waiting included.
    """

    def __init__(self, jobs: int, time_limit_s: float) -> None:
        self._jobs = jobs
        self._limit_s = time_limit_s
        self._pool: ProcessPool | None = None

    def open(self) -> ProcessPool:
        """Return the processes, started."""
        if self._pool is None or not self._pool.active:
            # a forked copy of a process with threads and sockets would be none to rely on
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPool(
                max_workers=self._jobs,
                max_tasks=TASKS_PER_PROCESS,
                initializer=_begin,
                context=context,
            )
        return self._pool

    async def run(self, request: Request, function: Callable[..., bytes], *given: Any) -> bytes:
        """Return what a function answers.

        Args:
            request: who wants to know, its body read; the work ends when the client goes.
            function: a function of a module.
            given: its arguments.
        """
        future = self.open().schedule(function, args=given)
        answer = asyncio.wrap_future(future)
        left = asyncio.ensure_future(_disconnected(request))
        either: list[asyncio.Future[Any]] = [answer, left]
        try:
            await asyncio.wait(either, timeout=self._limit_s, return_when=asyncio.FIRST_COMPLETED)
            if answer.done():
                return answer.result()
            if left.done():
                raise gone()
            raise too_much_work(self._limit_s) if future.running() else busy()
        except ProcessExpired:
            raise busy() from None
        finally:
            left.cancel()
            # ends the process, if it still works on it
            answer.cancel()

    def close(self) -> None:
        """End the processes, whatever they do; nobody waits for an answer any more."""
        if self._pool is not None:
            self._pool.stop()  # type: ignore[no-untyped-call]
            self._pool.join()


async def _disconnected(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass


def _begin() -> None:
    # Ctrl-C reaches every process of a terminal; only the one that answers decides what it ends
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warm_up()
