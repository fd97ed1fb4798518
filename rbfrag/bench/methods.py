"""The methods that are compared, and those that cannot be run here."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

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


def methods(*, quick: bool = False) -> tuple[BenchMethod, ...]:
    """Return every method that can be run here."""
    splits = dict.fromkeys((UNSPLIT, PH_MAX, PH_MAX / 3.0))
    orders = dict.fromkeys((4, 5, 6, ORDER))
    result = [_taylor(order, ph_max) for ph_max in splits for order in orders]
    result += [_euler(parts) for parts in ((1, 8) if quick else (1, 8, 64))]
    solvers: tuple[Solver, ...] = ("RK45", "DOP853", "LSODA")
    tolerances = (1e-6,) if quick else (1e-4, 1e-6)
    result += [_scipy(solver, rtol) for solver in solvers for rtol in tolerances]
    if cvode_is_installed():
        result += [_cvode(rtol) for rtol in ((1e-6, 1e-8) if quick else (1e-6, 1e-8, 1e-10))]
    return tuple(result)


def rocking_methods(*, quick: bool = False) -> tuple[BenchMethod, ...]:
    """Return the methods for free-standing blocks."""
    result = [_rocking(order) for order in (4, 5, 6, ORDER)]
    result += [_runge_kutta(parts) for parts in ((1, 4) if quick else (1, 4, 16))]
    return tuple(result)


def rocking_reference_run(case: BenchCase) -> PeerAnswer:
    """Run one case with the reference that errors are judged by."""
    return rocking_reference(case, RESTITUTION)


def missing_peers() -> tuple[str, ...]:
    """Return the packages of peers that are not installed here."""
    return () if cvode_is_installed() else (CVODE_INSTALL,)


def _taylor(order: int, ph_max: float) -> BenchMethod:
    split = "unsplit" if ph_max == UNSPLIT else f"p·h ≤ {ph_max:g}"
    return BenchMethod(
        f"rbfrag, {split}",
        f"order {order}",
        lambda case: taylor_run(case, order, ph_max),
        of_use=(order, ph_max) == (ORDER, PH_MAX),
    )


def _rocking(order: int) -> BenchMethod:
    return BenchMethod(
        "rbfrag, rocking",
        f"order {order}",
        lambda case: rocking_run(case, order),
        of_use=order == ORDER,
    )


def rocking_run(case: BenchCase, order: int = ORDER) -> PeerAnswer:
    """Run one case with rbfrag's kernel of free-standing blocks."""
    block = free_block(block_of_numbers(case.p2, case.kr, {"restitution": RESTITUTION}))
    run = simulate_rocking(case.excitation, block, order=order)
    return PeerAnswer(OUTCOMES[run.outcome].value, max(run.forward.x, run.backward.x))


def _runge_kutta(parts: int) -> BenchMethod:
    return BenchMethod(
        "RK4, rocking",
        "dt" if parts == 1 else f"dt/{parts}",
        lambda case: runge_kutta(case, RESTITUTION, parts),
    )


def _euler(parts: int) -> BenchMethod:
    setting = "dt" if parts == 1 else f"dt/{parts}"
    return BenchMethod("forward Euler", setting, lambda case: euler(case, parts))


def _scipy(solver: Solver, rtol: float) -> BenchMethod:
    return BenchMethod(
        f"scipy {solver}", f"rtol {rtol:.0e}", lambda case: solve_ivp_run(case, solver, rtol)
    )


def _cvode(rtol: float) -> BenchMethod:
    return BenchMethod("CVODE in Python", f"rtol {rtol:.0e}", lambda case: cvode_run(case, rtol))
