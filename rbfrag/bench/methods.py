"""The methods that are compared, and those that cannot be run here."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from rbfrag.bench.cases import BenchCase
from rbfrag.bench.peers import (
    CVODE_INSTALL,
    PeerAnswer,
    Solver,
    cvode_is_installed,
    cvode_run,
    euler,
    solve_ivp_run,
)
from rbfrag.bench.reference import rocking_reference
from rbfrag.bench.rocking_peer import runge_kutta
from rbfrag.solver.integrator.taylor import ORDER, PH_MAX
from rbfrag.solver.models.rocking import free_block
from rbfrag.solver.respond import block_of_numbers
from rbfrag.solver.rocking_run import simulate as simulate_rocking
from rbfrag.solver.toppling_run import OUTCOMES, simulate

UNSPLIT = math.inf

RESTITUTION = 0.85
"""Of the free-standing blocks. With Housner's the responses of slender ones are chaotic, and an
error says nothing of the method."""


@dataclass(frozen=True)
class BenchMethod:
    """One method at one setting.

    Args:
        family: methods of one family are joined by a line in the figure.
        setting: what distinguishes it within the family.
        of_use: the setting that users of rbfrag get.
    """

    family: str
    setting: str
    run: Callable[[BenchCase], PeerAnswer]
    of_use: bool = False

    @property
    def name(self) -> str:
        """Family and setting."""
        return f"{self.family}, {self.setting}"


def taylor_run(case: BenchCase, order: int = ORDER, ph_max: float = PH_MAX) -> PeerAnswer:
    """Run one case with rbfrag's kernel."""
    run = simulate(case.excitation, p2=case.p2, kr=case.kr, order=order, ph_max=ph_max)
    return PeerAnswer(OUTCOMES[run.outcome].value, run.peak_rad)


def rocking_run(case: BenchCase, order: int = ORDER) -> PeerAnswer:
    """Run one case with rbfrag's kernel of free-standing blocks."""
    block = free_block(block_of_numbers(case.p2, case.kr, {"restitution": RESTITUTION}))
    run = simulate_rocking(case.excitation, block, order=order)
    return PeerAnswer(OUTCOMES[run.outcome].value, max(run.forward.x, run.backward.x))


def methods(*, quick: bool = False) -> tuple[BenchMethod, ...]:
    """Return every method that can be run here."""
    result = [
        BenchMethod(
            "rbfrag, unsplit" if ph_max == UNSPLIT else f"rbfrag, p·h ≤ {ph_max:g}",
            f"order {order}",
            partial(taylor_run, order=order, ph_max=ph_max),
            of_use=(order, ph_max) == (ORDER, PH_MAX),
        )
        for ph_max in dict.fromkeys((UNSPLIT, PH_MAX, PH_MAX / 3.0))
        for order in dict.fromkeys((4, 5, 6, ORDER))
    ]
    result += [
        BenchMethod("forward Euler", _split(parts), partial(euler, parts=parts))
        for parts in ((1, 8) if quick else (1, 8, 64))
    ]
    solvers: tuple[Solver, ...] = ("RK45", "DOP853", "LSODA")
    result += [
        BenchMethod(
            f"scipy {solver}", f"rtol {rtol:.0e}", partial(solve_ivp_run, solver=solver, rtol=rtol)
        )
        for solver in solvers
        for rtol in ((1e-6,) if quick else (1e-4, 1e-6))
    ]
    if cvode_is_installed():
        result += [
            BenchMethod("CVODE in Python", f"rtol {rtol:.0e}", partial(cvode_run, rtol=rtol))
            for rtol in ((1e-6, 1e-8) if quick else (1e-6, 1e-8, 1e-10))
        ]
    return tuple(result)


def rocking_methods(*, quick: bool = False) -> tuple[BenchMethod, ...]:
    """Return the methods for free-standing blocks."""
    result = [
        BenchMethod(
            "rbfrag, rocking", f"order {order}", partial(rocking_run, order=order),
            of_use=order == ORDER,
        )
        for order in (4, 5, 6, ORDER)
    ]  # fmt: skip
    result += [
        BenchMethod(
            "RK4, rocking",
            _split(parts),
            partial(runge_kutta, restitution=RESTITUTION, parts=parts),
        )
        for parts in ((1, 4) if quick else (1, 4, 16))
    ]
    return tuple(result)


def _split(parts: int) -> str:
    return "dt" if parts == 1 else f"dt/{parts}"


def rocking_reference_run(case: BenchCase) -> PeerAnswer:
    """Run one case with the reference that errors are judged by."""
    return rocking_reference(case, RESTITUTION)


def missing_peers() -> tuple[str, ...]:
    """Return the packages of peers that are not installed here."""
    return () if cvode_is_installed() else (CVODE_INSTALL,)
