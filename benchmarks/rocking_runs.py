"""Rocking beside an independent integrator, on drawn blocks:  python -m benchmarks.rocking_runs

The reference is that of tests/solver/rocking_reference.py (scipy's DOP853 at 1e-12 from event to
event). Runs are grouped by the impacts up to the greater peak, or up to overturning; those whose
outcome the flag `sensitive` marks are counted apart. The exit status is 1 where a peak deviates by
more than is asked.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.page import ROOT, find_records, markdown, parser, report
from rbfrag.bench.peers import Records
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import excitation
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome, Response
from tests.solver.rocking_reference import ReferenceRocking, integrate, parallelogram

PAGE = ROOT / "docs" / "theory" / "rocking.md"

GROUPS = ((0, 10, 1e-8), (11, 30, 1e-5), (31, 100, None), (101, None, None))
"""Impacts up to the greater peak, from and to, and what its deviation may be."""

MANY_IMPACTS = 400
"""In a whole run; how runs with more end is counted apart."""

MOST_IMPACTS = 20_000
"""Impacts after which the reference gives up: each takes it some ten milliseconds."""


@dataclass(frozen=True)
class Drawn:
    """A block and what shakes it; `vertical_part` of the horizontal motion, delayed."""

    motion: GroundMotion
    alpha1_deg: float
    alpha3_deg: float
    r3_m: float
    beta_deg: float
    restitution: float | None
    vertical: GroundMotion | None

    def run(self) -> Response:
        """Run it with rbfrag."""
        return respond(
            self.motion,
            kind="rocking",
            block=Block.from_angles(self.alpha1_deg, self.alpha3_deg, self.r3_m),
            beta_deg=self.beta_deg,
            restitution=self.restitution,
            vertical=self.vertical,
        )

    def reference(self) -> ReferenceRocking:
        """Run it with the independent integrator."""
        excited = excitation(self.motion, self.vertical)
        block = parallelogram(
            self.alpha1_deg, self.alpha3_deg, self.r3_m, self.beta_deg, self.restitution
        )
        return integrate(excited.time_s, excited.k_h, excited.w, block, most_impacts=MOST_IMPACTS)


@dataclass(frozen=True)
class Compared:
    """One run by both.

    Args:
        same: whether it ends alike.
        sensitive: whether rbfrag says that the outcome depends on the last digits of the motion.
        impacts: up to the greater peak, or to overturning; -1 where the reference gave up.
        all_impacts: those of the whole run.
        deviation: of the greater peak, relative; NaN where the block overturns.
    """

    same: bool
    sensitive: bool
    impacts: int
    all_impacts: int
    deviation: float


def main(arguments: Sequence[str] | None = None) -> None:
    chosen = parser(__doc__)
    chosen.add_argument("--runs", type=int, default=60)
    options = chosen.parse_args(arguments)
    records = find_records(options.records)
    runs = [compare(run) for run in draw(records, options.runs)]
    given_up = [run for run in runs if run.impacts < 0]
    cells, reached = [], not given_up
    for low, high, limit in GROUPS:
        group = [run for run in runs if low <= run.impacts <= (high or MOST_IMPACTS)]
        calm = [run for run in group if not run.sensitive]
        stays = [run.deviation for run in calm if not math.isnan(run.deviation)]
        greatest = max(stays, default=0.0)
        reached &= limit is None or greatest <= limit
        cells.append(
            [
                f"{low} to {high}" if high else f"{low} and more",
                str(len(group)), str(len(group) - len(calm)),
                f"{sum(run.same for run in calm)} of {len(calm)}", str(len(stays)),
                f"{np.median(stays):.1g}" if stays else "", f"{greatest:.1g}" if stays else "",
                "" if limit is None else f"≤ {limit:.0e}",
            ]
        )  # fmt: skip
    many = [run for run in runs if run.all_impacts > MANY_IMPACTS]
    headers = [
        "impacts to the peak", "runs", "sensitive", "same outcome", "stable",
        "deviation of the peak, median", "greatest", "asked",
    ]  # fmt: skip
    text = (
        f"{markdown((headers, cells))}\n\n{len(runs) - len(given_up)} of {len(runs)} drawn runs "
        f"compared, under {records.source}; {len(many)} have more than {MANY_IMPACTS} impacts, "
        f"and {sum(run.same for run in many)} of them end alike."
    )
    report("rocking-runs", text, write=options.write, page=PAGE)
    if not reached:
        raise SystemExit(1)


def draw(records: Records, number: int, *, seed: int = 1) -> list[Drawn]:
    """Draw blocks that lift off, of every size and skewness, on level and dipping bases.

    Args:
        records: where the motions come from.
        number: how many.
        seed: the same seed draws the same blocks.
    """
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(records.motions))
    drawn: list[Drawn] = []
    for turn in range(50 * number):
        if len(drawn) == number:
            break
        motion = records.motions[order[turn % order.size]]
        beta = float(rng.choice([0.0, 0.0, 3.0, -5.0]))
        weaker = math.degrees(math.atan(motion.pga_g * math.exp(rng.uniform(-2.0, -0.05))))
        other = weaker * float(rng.choice([1.0, 1.0, 1.6]))
        if not (weaker < 25.0 and motion.npts < 12_000):
            continue
        restitution = None if rng.random() < 0.6 else float(rng.uniform(0.7, 0.98))
        vertical = None
        if rng.random() < 0.3:
            vertical = GroundMotion(0.4 * np.roll(motion.acceleration_g, 37), motion.dt_s)
        size = float(np.exp(rng.uniform(math.log(0.25), math.log(15.0))))
        angles = (
            (beta - weaker, beta + other) if rng.random() < 0.5 else (beta - other, beta + weaker)
        )
        run = Drawn(motion, *angles, size, beta, restitution, vertical)
        if run.run().started_s is not None:
            drawn.append(run)
    return drawn


def compare(drawn: Drawn) -> Compared:
    """Run one block by both."""
    ours, truth = drawn.run(), drawn.reference()
    toppled = ours.outcome is Outcome.TOPPLED
    sense = 0 if not toppled else 1 if ours.peak_forward_rad is None else -1
    deviation = math.nan
    if not toppled and ours.peak_theta_rad is not None and not truth.toppled:
        greatest = max(truth.peak.values())
        deviation = abs(ours.peak_theta_rad - greatest) / greatest
    n_impacts = len(truth.impact_s)
    impacts = n_impacts if truth.toppled else truth.impacts_to_peak
    return Compared(
        sense == truth.toppled, bool(ours.sensitive),
        impacts if n_impacts <= MOST_IMPACTS else -1, n_impacts, deviation,
    )  # fmt: skip


if __name__ == "__main__":
    main()
