"""Long work in separate processes, each task with a time limit.

A task takes a body and the parameters of its operation, and returns JSON.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import signal
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

from fastapi import Request
from pebble import ProcessExpired, ProcessPool

from rbfrag.db.sqlite_file import LONGEST_WAIT_S
from rbfrag.errors import InputError, MotionFileError
from rbfrag.service.guard import log_as_json
from rbfrag.service.parameters import (
    CriticalQuery,
    HazardQuery,
    Reading,
    RockmassQuery,
    SpectrumQuery,
)
from rbfrag.service.problem import (
    BUSY,
    GONE,
    MalformedError,
    RequestRefusedError,
    SeveralTracesError,
)
from rbfrag.service.reading import json_of, json_text

if TYPE_CHECKING:
    from rbfrag.hazards.curve import CurveKeywords
    from rbfrag.hazards.hazard_answer import HazardAnswer
    from rbfrag.motions.ground_motion import GroundMotion
    from rbfrag.motions.polarity import Polarity
    from rbfrag.question.fields import AnsweringFields

FILE = "the file"
"""What messages call an accelerogram or a curve that was sent."""


EXAMPLE = "time_s,acceleration_g\n" + "".join(
    f"{0.1 * i:.1f},{value}\n"
    for i, value in enumerate((0.0, 0.2, 0.4, 0.4, 0.2, -0.2, -0.4, -0.4, -0.2, 0.0))
)
"""A made-up accelerogram, short enough for the documentation."""


def warm_up() -> None:
    """Load or compile the kernels, so that no request has to wait for them."""
    spectrum(EXAMPLE.encode(), SpectrumQuery())
    critical(EXAMPLE.encode(), CriticalQuery.model_validate({"p2": 3.0}))


def rock_mass(
    body: bytes, form: str, query: RockmassQuery, row_limit: int, db: str | None
) -> bytes:
    """Return the same JSON as `rbfrag rockmass`, for toml, json or csv."""
    from rbfrag.campaign.rock_mass_answer import rockmass
    from rbfrag.rockmasses.file import rock_mass_of_csv, rock_mass_of_tables, rock_mass_of_toml

    if form == "json":
        document = json_of(body)
        if not isinstance(document, dict):
            raise InputError(
                "the body must be a JSON object with the tables base, back and friction"
            )
        described = rock_mass_of_tables(document)
    else:
        described = (rock_mass_of_toml if form == "toml" else rock_mass_of_csv)(_text(body))
    count = described.realisations if query.n is None else query.n
    if count > row_limit:
        raise InputError(
            f"{count} realisations exceed the maximum of {row_limit} per request: reduce n"
        )
    measures, how = query.question()
    if how and not measures:
        raise InputError(
            f"{next(iter(how))} requires an intensity measure: give pgv, pga or sa, or pgd and tm"
        )
    question: dict[str, Any] = {**measures, **how, "db": db}
    answer = rockmass(described, n=query.n, seed=query.seed, **question)
    return json_text(answer.as_dict())


def spectrum(body: bytes, query: SpectrumQuery) -> bytes:
    """Return the same JSON as `rbfrag spectrum`."""
    from rbfrag.motions.polarity import POLARITIES
    from rbfrag.motions.toppling_spectrum import TopplingSpectrum

    ground = _motion(body, query)
    answers = [
        TopplingSpectrum.of(ground.label, ground, query.sizes(), polarity, query.kr).document(
            text=query.text
        )
        for polarity in POLARITIES
        if query.polarity in (polarity, "both")
    ]
    return json_text(answers[0] if len(answers) == 1 else answers)


def critical(body: bytes, query: CriticalQuery) -> bytes:
    """Return the same JSON as `rbfrag critical`."""
    from rbfrag.fragility.method import TOPPLING_BLOCK
    from rbfrag.question.classify import classify_block, has_shape
    from rbfrag.solver.respond import respond
    from rbfrag.solver.search.critical import critical as search

    numbers = query.inputs()
    if has_shape(numbers):
        (group,) = classify_block(numbers, TOPPLING_BLOCK.kind).groups
        numbers = {**group.numbers}
    require(numbers, "p2")
    ground, kr = _motion(body, query), numbers.get("kr")
    polarity: Polarity = "reverse" if query.reverse else "forward"
    result = search(ground, p2=numbers["p2"], polarity=polarity, full_map=query.map)
    if kr is not None:
        response = respond(ground, p2=numbers["p2"], kr=kr, polarity=polarity)
        result = replace(result, block_kr=kr, block_outcome=response.outcome)
    return json_text(replace(result, with_map=query.map).document(text=query.text))


def hazard(body: bytes, query: HazardQuery, db: str | None) -> bytes:
    """Return the same JSON as `rbfrag hazard`."""
    import numpy as np

    from rbfrag.hazards.curve_file import hazard_curves_in, suited_curves
    from rbfrag.hazards.hazard_rates import hazard_at_sites, with_drained_rates
    from rbfrag.hazards.shaking import velocity_conversion
    from rbfrag.question.drained_bound import is_wet, without_water

    try:
        curves = hazard_curves_in(_text(body), FILE, imt=query.imt, site=query.site)
    except RecursionError:
        raise MalformedError("the body is nested too deeply") from None
    convert = None if query.convert is None else velocity_conversion(query.convert)
    curves = suited_curves(
        curves,
        converted_period_s=None if convert is None else convert.period_s,
    )
    meaning = query.model_dump(include={"convert", "convert_sigma", "component"})
    inputs, how = query.question()
    if (kind := how.pop("kind", None)) is not None:
        inputs["kind"] = kind
    block_inputs = {name: [value] * len(curves) for name, value in inputs.items()}
    sites = np.arange(len(curves))
    site_curves = [[curve] for curve in curves]
    answering = cast("AnsweringFields", {**how, "db": db})

    def answer(blocks: Mapping[str, Any]) -> HazardAnswer:
        return hazard_at_sites(
            site_curves, sites, blocks, cast("CurveKeywords", meaning), answering, years=query.years
        )

    rates = answer(block_inputs)
    if is_wet(inputs):
        rates = with_drained_rates(rates, lambda: answer(without_water(block_inputs)), True)
    return json_text(rates.as_dict())


def require(numbers: Collection[str], *names: str) -> None:
    """Reject a block with a missing number."""
    from rbfrag.question.shape_validation import OF_A_SHAPE, WAYS

    for name in names:
        if name not in numbers:
            raise InputError(
                f"{name} is missing: a block is given by {' and '.join(names)}, or by {WAYS}",
                fields=OF_A_SHAPE,
            )


def _motion(body: bytes, query: Reading) -> GroundMotion:
    from rbfrag.motions.readers import motions_in

    trace = query.trace
    try:
        traces = motions_in(body, query.name, units=query.units, dt_s=query.dt, gain=query.gain)
    except MotionFileError as error:
        where = FILE if error.line is None else f"{FILE}, line {error.line}"
        raise InputError(f"{where}: {error.reason}") from None
    except RecursionError:
        raise MalformedError("the body is nested too deeply") from None
    if trace is None and len(traces) == 1:
        return traces[0]
    if trace is not None and 0 <= trace < len(traces):
        return traces[trace]
    listed = ", ".join(f"{i} ({record.component})" for i, record in enumerate(traces))
    trouble = f"holds {len(traces)} traces" if trace is None else f"has no trace {trace}"
    raise SeveralTracesError(
        f"{FILE} {trouble}: give one of  {listed}  with trace, for example trace=0",
        [record.component for record in traces],
    )


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
    """Worker processes, started on first use, each task with a time limit."""

    def __init__(self, jobs: int, time_limit_s: float) -> None:
        self._jobs = jobs
        self._limit_s = time_limit_s
        self._pool: ProcessPool | None = None

    def open(self) -> ProcessPool:
        """Return the started processes."""
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

    async def run(self, request: Request, function: Callable[..., bytes], *arguments: Any) -> bytes:
        """Return what a function of a module answers; the work ends when the client goes."""
        future = self.open().schedule(function, args=arguments)
        answer = asyncio.wrap_future(future)

        async def wait_for_disconnect() -> None:
            while (await request.receive())["type"] != "http.disconnect":
                pass

        disconnected = asyncio.ensure_future(wait_for_disconnect())
        either: list[asyncio.Future[Any]] = [answer, disconnected]
        try:
            await asyncio.wait(either, timeout=self._limit_s, return_when=asyncio.FIRST_COMPLETED)
            if answer.done():
                return answer.result()
            if disconnected.done():
                raise RequestRefusedError(*GONE)
            if not future.running():
                raise RequestRefusedError(*BUSY)
            raise RequestRefusedError(
                422,
                "time-limit",
                f"the answer takes longer than the limit of {self._limit_s:g} s: reduce the "
                "request, use the command line, or start the service with a longer --time-limit",
            )
        except ProcessExpired:
            raise RequestRefusedError(*BUSY) from None
        finally:
            disconnected.cancel()
            # ends the process, if it still works on it
            answer.cancel()

    def close(self) -> None:
        """Terminate the processes and their work; no request waits any more."""
        if self._pool is not None:
            self._pool.stop()  # type: ignore[no-untyped-call]
            self._pool.join()


async def in_thread(limit_s: float, function: Callable[..., Any], *arguments: Any) -> Any:
    """Return the result of a function that may wait for a database, while others are answered.

    The client gets an answer after the time limit; the database is waited for no longer either.
    """
    LONGEST_WAIT_S.set(limit_s)  # for this request alone, and for its thread
    try:
        return await asyncio.wait_for(asyncio.to_thread(function, *arguments), limit_s)
    except TimeoutError:
        raise RequestRefusedError(*BUSY) from None


def _begin() -> None:
    # Ctrl-C reaches every process of a terminal; only the one that answers decides what it ends
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    log_as_json()
    warm_up()
