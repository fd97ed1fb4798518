"""`rbfrag warm-up`: compile the kernels at installation."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from rbfrag.cli.output import say_when_compiling

if TYPE_CHECKING:
    from rbfrag.motions.ground_motion import GroundMotion

EXAMPLE = "Example:  rbfrag warm-up"


def warm_up() -> None:
    """Compile all kernels, so that later commands start faster.

    The machine code is stored next to the package if that folder is writable, else in the cache
    folder of the user. Run it once after installation as a user with write access; compiled kernels
    are not compiled again.
    """
    say_when_compiling()
    started = time.perf_counter()
    for step in compile_kernels():
        print(f"warm-up: {step}", file=sys.stderr, flush=True)
    print(f"Every kernel is compiled, in {time.perf_counter() - started:.0f} s.")


EVENT_SET = {
    "events": "event_id,rup_id,rlz_id,year\n0,0,0,1\n",
    "gmf-data": "event_id,gmv_PGV,custom_site_id\n0,60,a\n",
    "sitemesh": "custom_site_id,lon,lat\na,172.7,-43.6\n",
    "realizations": "rlz_id,branch_path,weight\n0,A~A,1\n",
    "ruptures": '#,,,"investigation_time=1.0, ses_per_logic_tree_path=1"\n'
    "rup_id,source_id,multiplicity,mag\n0,fault,1,6\n",
}
"""A synthetic event set, by the names of its files."""

BLOCKS = {"p2": [3.0, 1.0, 1.0], "kr": [0.1, 0.05, 0.04]}


def compile_kernels() -> Iterator[str]:
    """Run everything that needs kernels, and yield a description of each step.

    The machine code stays where kernels are kept (:mod:`rbfrag.solver.integrator.compiled`).
    """
    import numpy as np

    from rbfrag.campaign.kind import Sequences
    from rbfrag.campaign.kinds import campaign_kinds, campaign_of_kind
    from rbfrag.campaign.simulate import simulate
    from rbfrag.db.engine import opened_database
    from rbfrag.db.motions import add_motion
    from rbfrag.db.rows import EarthquakeInfo
    from rbfrag.exchange.event_losses import losses
    from rbfrag.hazards.curve import HazardCurve
    from rbfrag.hazards.hazard_rates import hazard
    from rbfrag.motions.toppling_spectrum import toppling_spectrum
    from rbfrag.solver.excitation import kept_excitation
    from rbfrag.solver.integrator.block_excitation import block_excitation
    from rbfrag.solver.kinds import KINDS
    from rbfrag.solver.respond import respond
    from rbfrag.solver.search.borders import first_change
    from rbfrag.solver.search.critical import critical
    from rbfrag.solver.search.renewal import excursion_table, no_work

    with TemporaryDirectory(prefix="rbfrag-warm-up-") as folder:
        yield "responses and searches"
        motion, upward = _motion(1.0), _motion(0.4)
        free_standing = next(kind for kind, facts in KINDS.items() if facts.free_standing)
        for vertical in (None, upward):
            respond(motion, p2=3.0, kr=0.1, vertical=vertical)
            respond(motion, p2=3.0, kr=0.1, vertical=vertical, kind=free_standing, restitution=0.9)
            respond(motion, ky=0.1, vertical=vertical)
            for p2 in (0.1, 30.0):
                critical(motion, p2=p2, vertical=vertical, full_map=True)
            # islands of long records are looked for by blocks where their map is not complete
            block = block_excitation(kept_excitation(motion, vertical, "forward"), p2=3.0)
            kr = np.array([0.3, 0.2])
            first_change(block, kr, 1, True, excursion_table(0), no_work())
        toppling_spectrum(motion, 3.0)
        place = Path(folder, "motions.db")
        with opened_database(place, create=True) as engine, engine.begin() as connection:
            for name, of, record in (
                ("a", "a", motion),
                ("b", "b", _motion(0.8)),
                ("up", "a", upward),
            ):
                add_motion(
                    connection, record, earthquake=EarthquakeInfo(of), is_vertical=name == "up",
                    recording=of, component=name,
                )  # fmt: skip
        for kind in campaign_kinds():
            yield f"campaigns of kind {kind}"
            campaign = campaign_of_kind(kind)
            sizes: Any = {"p2": (3.0,)} if "p2" in campaign.options else {}
            simulate(place, kind=kind, vertical="both", jobs=1, **sizes)
            if isinstance(campaign, Sequences):
                simulate(place, kind=kind, sequence=True, jobs=1)
        yield "annual rates and losses"
        curve = HazardCurve("pgv_m_s", np.array([0.05, 0.2, 1.0]), np.array([0.05, 0.006, 0.0001]))
        blocks: Any = BLOCKS
        hazard(curve, **blocks, joint=True)
        for name, text in EVENT_SET.items():
            Path(folder, f"{name}_1.csv").write_text(text, encoding="utf-8")
        losses(folder, {**blocks, "site_id": ["a"] * 3})


def compile_search() -> None:
    """Compile the search for the critical strength in a process of its own."""
    from rbfrag.campaign.executors import prepare
    from rbfrag.solver.search.critical import critical

    prepare()
    with suppress(Exception):  # the main process meets the same error and explains it
        critical(_motion(1.0), p2=3.0)


def compile_grid() -> None:
    """Compile the other kernels of a toppling campaign."""
    import numpy as np

    from rbfrag.solver.excitation import kept_excitation
    from rbfrag.solver.integrator.batch import simulate_many
    from rbfrag.solver.integrator.block_excitation import block_excitation

    excited = kept_excitation(_motion(1.0), None, "forward")
    simulate_many(excited, p2=3.0, kr=np.array([0.3, 0.2]))
    block_excitation(excited, p2=0.1)  # large blocks need the tables of several samples at once


def _motion(scale: float) -> GroundMotion:
    import numpy as np

    from rbfrag.motions.ground_motion import GroundMotion

    # intervals so short that several are one step, and pulses after which stronger blocks topple
    t = np.arange(1600) * 0.005
    pulses = np.sin(2.0 * np.pi * t / 0.8) + 0.5 * np.sin(2.0 * np.pi * t / 0.31)
    samples = 0.4 * scale * pulses * np.exp(-(((t - 3.0) / 1.5) ** 2))
    return GroundMotion(samples, 0.005, source_file=f"made {scale}")
