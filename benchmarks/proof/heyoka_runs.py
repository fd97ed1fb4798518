"""A third oracle: heyoka's adaptive Taylor integrator:  python -m benchmarks.proof.heyoka_runs

heyoka (in the extra `bench`) writes and compiles its own Taylor series of the equation and finds
its own events; it is started anew at every sample, since the excitation bends there. Compared are
the outcome, every impact and the peak of the solver, and the impacts that balls enclose.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import heyoka
import numpy as np

from benchmarks.page import find_records, markdown, parser, report
from benchmarks.proof import PAGE
from benchmarks.proof.enclosed_run import STABLE, TOPPLED, enclose, least_later_q
from rbfrag.bench.peers import BenchCase, choose_cases
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.toppling_run import respond

FREE_PERIODS = 40.0
"""Motion followed after the record, in units of 1/p."""


@dataclass
class Followed:
    """What heyoka made of a run."""

    outcome: str = STABLE
    peak_rad: float = 0.0
    impacts_s: list[float] = field(default_factory=list)


class Oracle:
    """The equation (4.13) on one interval, compiled twice: with and without events."""

    def __init__(self) -> None:
        theta, rate = heyoka.make_vars("theta", "rate")
        par, time = heyoka.par, heyoka.time
        phi = par[5] - theta
        k_h, w = par[0] + par[1] * time, par[2] + par[3] * time
        excited = par[4] * (k_h * heyoka.cos(phi) - w * heyoka.sin(phi))
        down = heyoka.event_direction.negative
        system = [(theta, rate), (rate, excited)]
        turned: list[float] = []

        # a function, not a method: heyoka copies what it is given, and a method's object with it
        def keep(integrator: Any, time: float, _sign: int) -> None:
            integrator.update_d_output(time)
            turned.append(float(integrator.d_output[0]))

        self.turned = turned
        self.lifting = heyoka.taylor_adaptive(system, [0.0, 0.0], pars=[0.0] * 6)
        self.watched = heyoka.taylor_adaptive(
            system, [0.0, 0.0], pars=[0.0] * 6,
            t_events=[heyoka.t_event(theta, direction=down)],
            nt_events=[heyoka.nt_event(rate, keep, direction=down)],
        )  # fmt: skip

    def follow(self, excited: Excitation, *, p2: float, kr: float) -> Followed:
        """Run one block over an excitation and the free motion after it."""
        end_s = FREE_PERIODS / math.sqrt(p2)
        record = excited.time_s.size
        excited = excited.with_rest_after(end_s, 40)
        least = least_later_q(excited)
        followed = Followed()
        self.turned.clear()
        state: tuple[float, float] | None = None
        lifted = False
        for i in range(excited.interval_s.size):
            length = float(excited.interval_s[i])
            if length == 0.0:
                continue
            g = [float(excited.k_h[j] - excited.w[j] * kr) for j in (i, i + 1)]
            crossing = g[0] / (g[0] - g[1]) * length if (g[0] > 0.0) != (g[1] > 0.0) else length
            self._excite(excited, i, p2, kr)
            at = 0.0
            lifted = lifted and g[0] >= 0.0
            while True:
                if state is None:
                    if not g[0] + (g[1] - g[0]) * at / length > 0.0:
                        if not g[1] > 0.0:
                            break
                        at = crossing
                    state, lifted = (0.0, 0.0), True
                if lifted:
                    target = crossing if g[1] < 0.0 else length
                    state = self._to(self.lifting, at, target, state)[1]
                    at, lifted = target, g[1] >= 0.0
                if at >= length:
                    break
                at, state = self._to(self.watched, at, length, state)
                if state is not None:
                    break
                followed.impacts_s.append(float(excited.time_s[i]) + at)
            if state is not None and state[1] > 0.0:
                phi = math.atan(kr) - state[0]
                if phi < 0.0 and math.tan(phi) < least[i + 1]:
                    followed.outcome = TOPPLED
                    return followed
            if state is None and i >= record:
                break
        followed.peak_rad = max(self.turned, default=0.0)
        return followed

    def _excite(self, excited: Excitation, i: int, p2: float, kr: float) -> None:
        length = excited.interval_s[i]
        slopes = [(x[i + 1] - x[i]) / length for x in (excited.k_h, excited.w)]
        for system in (self.lifting, self.watched):
            system.pars[:] = [excited.k_h[i], slopes[0], excited.w[i], slopes[1], p2, math.atan(kr)]

    def _to(
        self, integrator: Any, at: float, target: float, state: tuple[float, float]
    ) -> tuple[float, tuple[float, float] | None]:
        """Integrate from one time to another; the state is None where an impact ends it."""
        integrator.time = at
        integrator.state[:] = state
        if integrator is self.watched:
            integrator.reset_cooldowns()
        outcome = integrator.propagate_until(target)[0]
        if outcome == heyoka.taylor_outcome.time_limit:
            return target, (float(integrator.state[0]), float(integrator.state[1]))
        return float(integrator.time), None


@dataclass(frozen=True)
class Difference:
    """Solver, heyoka and ball arithmetic on one block."""

    case: BenchCase
    outcomes: tuple[str, str, str]
    impacts: tuple[int, int, int]
    peak: float
    impact_s: float
    outside_s: float


def impacts(time_s: Sequence[float], theta: Sequence[float]) -> list[float]:
    """Times at which a history comes back to zero."""
    return [
        float(time_s[i]) for i in range(1, len(theta)) if theta[i] == 0.0 and theta[i - 1] > 0.0
    ]


def compare(oracle: Oracle, case: BenchCase) -> Difference:
    """Run one block by all three.

    Returns:
        peak: relative difference of the peaks of solver and heyoka; NaN where it topples.
        impact_s: greatest difference of their impacts [s].
        outside_s: greatest distance of the solver's impacts from their enclosures' middle [s].
    """
    excited = case.excitation
    mine = respond(case.motion, p2=case.p2, kr=case.kr, polarity=case.polarity, history=True)
    other = oracle.follow(excited, p2=case.p2, kr=case.kr)
    proven = enclose(excited, p2=case.p2, kr=case.kr)
    assert mine.history is not None
    my_impacts = impacts(mine.history.time_s, mine.history.theta_rad)
    within = [time_s for time_s, _ in proven.impacts_s]
    # after the record ball arithmetic decides by energy, and looks for no impact
    my_recorded = [time_s for time_s in my_impacts if time_s <= excited.time_s[-1]]
    peak = math.nan
    if mine.peak_theta_rad is not None:
        peak = abs(other.peak_rad / mine.peak_theta_rad - 1.0)
    return Difference(
        case,
        (mine.outcome.value, other.outcome, proven.outcome),
        (len(my_impacts), len(other.impacts_s), len(within)),
        peak,
        _greatest(my_impacts, other.impacts_s),
        _greatest(my_recorded, within),
    )


def _greatest(first: Sequence[float], other: Sequence[float]) -> float:
    if len(first) != len(other):
        return math.inf
    return max((abs(a - b) for a, b in zip(first, other, strict=True)), default=math.nan)


def table(differences: Sequence[Difference]) -> str:
    """One line for each p², as Markdown."""
    rows = []
    for p2 in sorted({difference.case.p2 for difference in differences}, reverse=True):
        of_size = [difference for difference in differences if difference.case.p2 == p2]
        rows.append(
            [
                f"{p2:g}",
                str(len(of_size)),
                str(sum(len(set(difference.outcomes)) == 1 for difference in of_size)),
                str(sum(difference.outcomes[0] == STABLE for difference in of_size)),
                str(sum(difference.impacts[0] for difference in of_size)),
                *(
                    _largest([getattr(difference, name) for difference in of_size])
                    for name in ("peak", "impact_s", "outside_s")
                ),
            ]
        )
    head = [
        "p² [1/s²]", "runs", "same outcome by all three", "stay", "impacts",
        "peak, heyoka off, relative", "impact, heyoka off [s]", "impact, enclosure off [s]",
    ]  # fmt: skip
    return markdown((head, rows))


def _largest(values: Sequence[float]) -> str:
    finite = np.array(values)[~np.isnan(values)]
    return f"{finite.max():.1e}" if finite.size else "–"


def main(arguments: Sequence[str] | None = None) -> list[Difference]:
    options = parser(__doc__)
    options.add_argument("--cases", type=int, default=24)
    options.add_argument("--seed", type=int, default=1)
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    oracle = Oracle()
    differences = []
    for case in choose_cases(records, chosen.cases, seed=chosen.seed):
        case_error = compare(oracle, case)
        differences.append(case_error)
        print(
            f"{case.motion.label} {case.polarity} p2={case.p2:g} kr={case.kr:.5g}: "
            f"{case_error.outcomes} {case_error.impacts} {case_error.peak:.1e} "
            f"{case_error.impact_s:.1e} {case_error.outside_s:.1e}",
            flush=True,
        )
    about = f"{len(differences)} runs under {records.source}, seed {chosen.seed}."
    report("heyoka", f"{table(differences)}\n\n{about}", write=chosen.write, page=PAGE)
    return differences


if __name__ == "__main__":
    main()
