"""Execution of a campaign: distributes work, stores results as they arrive and reports progress."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from sqlalchemy import Engine

from rbfrag.campaign.executors import CLUSTER, Stopped, executor
from rbfrag.campaign.summary import CampaignProgress
from rbfrag.db.campaigns import finish_campaign, start_campaign
from rbfrag.errors import StoppedError, WorkFailedError
from rbfrag.solver.results import NUMERICS_VERSION
from rbfrag.version import __version__


@dataclass(frozen=True)
class Workforce:
    """Workers of a campaign, and its progress callback.

    Args:
        jobs: worker processes; None for one per processor.
        scheduler: address of a Dask scheduler whose workers take their place.
        on_progress: called after each motion, or pair of motions.
        stopped: asked now and then whether to end.
    """

    jobs: int | None
    scheduler: str | None
    on_progress: Callable[[CampaignProgress], None] | None
    stopped: Stopped

    def carry_out(
        self,
        engine: Engine,
        settings: Mapping[str, object],
        do: Callable[[Any], Any],
        work: Iterator[object],
        chunks: int,
        store: Callable[[int, Any], int],
        *,
        total: int,
        resumed: int,
        started: float,
    ) -> None:
        """Run all work and store the results.

        Args:
            settings: what the campaign was asked for.
            do: does one chunk of work; a function of a module, which workers can find.
            work: the chunks.
            store: stores the answers to one chunk, which belong to the campaign of this row id, and
                returns the number of combinations.
            total: number of combinations.
            resumed: of these, those that are stored already.
            started: when the campaign began, by time.perf_counter [s].

        Raises:
            StoppedError: `stopped` said so; what was finished is stored.
            WorkFailedError: a worker died, or has other numerics.
        """
        completed = resumed

        def tell() -> None:
            if self.on_progress is not None:
                seconds = time.perf_counter() - started
                self.on_progress(CampaignProgress(completed, total, resumed, seconds))

        where = processor_and_compiler() if self.scheduler is None else CLUSTER
        scheduler = self.scheduler if chunks else None
        with executor(do, self.jobs, scheduler, self.stopped) as execute:
            with engine.begin() as connection:
                campaign_id = start_campaign(connection, {**settings, "made_on": where})
            tell()
            for answers in execute(work, chunks):
                if answers.numerics_version != NUMERICS_VERSION:
                    raise WorkFailedError(
                        f"a worker computes with numerics version {answers.numerics_version}, "
                        f"this rbfrag with {NUMERICS_VERSION}: install the same version on all "
                        "machines"
                    )
                completed += store(campaign_id, answers)
                tell()
            if completed < total:
                raise StoppedError(
                    f"stopped: {completed} of {total} stored; the same command goes on"
                )
            with engine.begin() as connection:
                finish_campaign(connection, campaign_id)


def machine() -> dict[str, str | int | float | None]:
    """Return processor, cores, load and versions; nothing that identifies the computer."""
    versions: dict[str, str | None] = {"rbfrag": __version__}
    for package in ("numpy", "numba", "scipy"):
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = None
    load = None
    with suppress(AttributeError, OSError):
        load = round(os.getloadavg()[0], 2)  # average of the last minute
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "load": load,
        "system": platform.system(),
        "python": platform.python_version(),
        **versions,
    }


def processor_and_compiler() -> str:
    """Return processor and compiler; if both are equal, results are bit-identical."""
    about = machine()
    return f"{about['processor']}, numba {about['numba']}"


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.processor() or platform.machine()
    for line in text.splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.machine()
