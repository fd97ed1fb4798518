"""Slumping and confined toppling against a free block on stiff springs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import read_motions
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome, Response
from tests.physics.penalty import Simulated, simulate

DT_S = 0.005

Lobes = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Case:
    """A block under half-sine lobes (start [s], duration [s], amplitude [g])."""

    alpha1: float
    alpha3: float
    r3: float
    beta: float
    phi: float
    back: float
    lobes: Lobes
    vertical: Lobes = ()
    until: float = 2.0

    @property
    def block(self) -> Block:
        return Block.from_angles(self.alpha1, self.alpha3, self.r3)


def half_sines(lobes: Lobes) -> NDArray[np.float64]:
    time = np.arange(0.0, 2.5 + 0.5 * DT_S, DT_S)
    a = np.zeros_like(time)
    for start, duration, amplitude in lobes:
        inside = (time >= start) & (time <= start + duration)
        a[inside] += amplitude * np.sin(np.pi * (time[inside] - start) / duration)
    return a


def both(case: Case, horizontal: NDArray[np.float64], dt_s: float) -> tuple[Response, Simulated]:
    vertical = half_sines(case.vertical) if case.vertical else None
    answer = respond(
        GroundMotion(horizontal, dt_s),
        block=case.block,
        beta_deg=case.beta,
        phi_deg=case.phi,
        phi_back_deg=case.back,
        vertical=None if vertical is None else GroundMotion(vertical, dt_s),
        history=True,
    )
    free_standing = simulate(
        case.block,
        beta_deg=case.beta,
        phi_deg=case.phi,
        phi_back_deg=case.back,
        time_s=np.arange(horizontal.size) * dt_s,
        k_h=horizontal,
        k_v=vertical,
        until_s=case.until,
    )
    return answer, free_standing


SLUMPS = {
    "pulse": Case(45, 65, 1, 0, 35, 35, ((0.1, 0.4, 0.9),), until=1.0),
    "two pulses": Case(50, 72, 2, 5, 35, 35, ((0.1, 0.5, 0.9), (0.8, 0.4, 0.8))),
    "small": Case(45, 65, 0.3, 0, 35, 35, ((0.1, 0.2, 0.9),), until=1.0),
    "large": Case(40, 75, 8, 10, 30, 30, ((0.1, 0.6, 0.7), (0.9, 0.5, 0.6))),
    "smoother back": Case(45, 70, 1, -5, 35, 20, ((0.1, 0.4, 0.9),), until=1.0),
    "rougher back": Case(45, 70, 1, 5, 30, 42, ((0.1, 0.4, 0.8),), until=1.0),
    "vertical": Case(
        45, 65, 1, 0, 35, 35, ((0.1, 0.4, 0.8),), ((0.15, 0.2, 0.4), (0.35, 0.2, -0.5)), until=1.0
    ),
    "partly reversed": Case(45, 65, 1, 0, 35, 35, ((0.1, 0.4, 1.0), (0.6, 0.1, -1.8)), until=1.2),
    "far": Case(45, 65, 1, 0, 35, 35, ((0.1, 1.2, 0.85),)),
    "reversed": Case(45, 65, 1, 0, 35, 35, ((0.1, 0.3, 0.9), (0.45, 0.3, -1.9)), until=0.5),
}


@pytest.mark.parametrize("name", SLUMPS)
def test_slump(name: str) -> None:
    case = SLUMPS[name]
    answer, free_standing = both(case, half_sines(case.lobes), DT_S)
    assert answer.kind == "slumping"
    assert answer.outcome is Outcome.STABLE
    assert answer.peak_theta_rad is not None
    assert free_standing.turned_rad.max() == pytest.approx(answer.peak_theta_rad, rel=1e-3)
    if name == "reversed":
        # up to its seat, where the springs rebound
        return
    assert free_standing.turned_rad[-1] == pytest.approx(answer.final_theta_rad, rel=1e-3)
    assert free_standing.heel_m[-1] == pytest.approx(answer.displacement_m, rel=1e-3)
    assert deviation(answer, free_standing, case.until) < 3e-3 * answer.peak_theta_rad


def test_a_slump_that_is_driven_back_to_its_seat() -> None:
    # strong uphill shaking undoes a slump; a model that only moves down the slope misses it
    case = Case(45, 65, 1, 0, 35, 35, ((0.1, 0.3, 0.9), (0.45, 0.3, -2.0)))
    answer, free_standing = both(case, half_sines(case.lobes), DT_S)
    assert answer.peak_theta_rad is not None
    assert answer.final_theta_rad == 0.0
    assert answer.displacement_m == 0.0
    assert abs(free_standing.turned_rad[-1]) < 0.02 * answer.peak_theta_rad
    assert any("driven back" in warning for warning in answer.warnings)


CONFINED = {
    "pulse": Case(-40, 20, 1, 5, 30, 30, ((0.1, 0.25, 0.8),), until=1.5),
    "steep wedge": Case(-60, 20, 1, 10, 35, 35, ((0.1, 0.25, 0.9),), until=1.5),
    "smoother back": Case(-40, 20, 3, 5, 30, 20, ((0.1, 0.4, 0.8),), until=2.0),
    "vertical": Case(-40, 20, 1, 5, 30, 30, ((0.1, 0.4, 0.9),), ((0.15, 0.2, 0.3),), until=2.0),
}


@pytest.mark.parametrize("name", CONFINED)
def test_confined(name: str) -> None:
    case = CONFINED[name]
    answer, free_standing = both(case, half_sines(case.lobes), DT_S)
    assert answer.kind == "confined_toppling"
    assert answer.outcome is Outcome.STABLE
    assert answer.peak_theta_rad is not None
    assert -free_standing.turned_rad.min() == pytest.approx(answer.peak_theta_rad, rel=1e-3)
    assert free_standing.toe_m.max() == pytest.approx(answer.peak_displacement_m, rel=1e-3)
    # it rocks back about the toe; what it does from its fall on the base is in test_followed_on.py
    change = answer.mode_changes[0]
    assert change.motion.startswith("rocks back")
    assert answer.history is not None
    back_s = landing(answer.history.time_s, answer.history.turned_rad, change.time_s)
    assert deviation(answer, free_standing, back_s, sign=-1.0) < 5e-3 * answer.peak_theta_rad
    landed = landing(free_standing.time_s, free_standing.turned_rad, change.time_s)
    assert landed == pytest.approx(back_s, abs=2e-3)


def landing(
    time_s: NDArray[np.float64], turned_rad: NDArray[np.float64] | None, after_s: float
) -> float:
    """First time after another at which a block that had turned forward is on its base again."""
    assert turned_rad is not None
    return float(time_s[(time_s > after_s) & (turned_rad >= 0.0)][0])


def test_motion_that_goes_on_after_the_record() -> None:
    # the same pulse, whether or not rest follows it in the record
    block = CONFINED["vertical"].block
    nodes = ([0.0, 0.0, 0.2, 0.2], [0.0, 0.9, 0.9, 0.0])
    short, long = (
        respond(
            GroundMotion.from_nodes([*nodes[0], *more], [*nodes[1], *(0.0 for _ in more)]),
            block=block,
            beta_deg=5.0,
            phi_deg=30.0,
            history=True,
        )
        for more in ((), (0.3, 0.5, 3.0))
    )
    assert short.mode_changes[0].time_s == pytest.approx(long.mode_changes[0].time_s, rel=1e-11)
    assert short.mode_changes[0].time_s > 0.2
    # steps after the fall on the base begin at other times
    assert short.stopped_s == pytest.approx(long.stopped_s, abs=5e-3)
    assert short.displacement_m == pytest.approx(long.displacement_m, rel=1e-3)
    assert short.peak_theta_rad == pytest.approx(long.peak_theta_rad, rel=1e-11)
    assert short.history is not None
    at = short.history.time_s
    assert np.all(np.diff(at) >= 0.0)
    # of the jump, both sides
    before, after = short.history.k_h[at == 0.2]
    assert (before, after) == (0.9, 0.0)


def test_confined_to_free_toppling() -> None:
    case = Case(-30, 20, 1, 0, 35, 35, ((0.1, 0.5, 1.0),), until=1.0)
    answer, free_standing = both(case, half_sines(case.lobes), DT_S)
    (change,) = answer.mode_changes
    assert change.motion.startswith("topples freely")
    assert answer.outcome is Outcome.TOPPLED
    assert answer.history is not None
    handed_over = np.interp(change.time_s, free_standing.time_s, -free_standing.turned_rad)
    assert handed_over == pytest.approx(np.radians(case.block.gamma_deg - 90.0), rel=1e-3)
    assert deviation(answer, free_standing, change.time_s + 0.1, sign=-1.0) < 1e-3 * np.radians(
        case.block.gamma_deg - 90.0
    )


def deviation(
    answer: Response, free_standing: Simulated, until_s: float, sign: float = 1.0
) -> float:
    """Greatest difference of the rotations up to a time."""
    assert answer.history is not None
    ours = np.interp(free_standing.time_s, answer.history.time_s, answer.history.theta_rad)
    local = free_standing.time_s <= until_s
    return float(np.abs(sign * free_standing.turned_rad - ours)[local].max())


REAL_SLUMPS = {
    # some forty slips, and at the end a pulse of 1.2 g that throws the block off its back plane
    "nga_at2_misc/RSN77_SFERN_PUL164.AT2": Case(40, 75, 1, 15, 30, 35, (), until=8.0),
    "nga_at2_misc/Rinaldi228.AT2": Case(40, 75, 1, 15, 30, 30, (), until=10.0),
    "peer_at2_opensees/CHY080-N.AT2": Case(45, 65, 5, 10, 35, 30, (), until=50.0),
}


def record_case(records_dir: Path, record: str, case: Case) -> tuple[Response, Simulated, float]:
    """Both answers, and the time up to which the model says anything."""
    motion = read_motions(records_dir / record)[0]
    assert motion.dt_s is not None
    answer, free_standing = both(case, motion.acceleration_g, motion.dt_s)
    until_s = case.until
    if answer.mode_changes:
        until_s = answer.mode_changes[0].time_s
    elif answer.outcome is not Outcome.STABLE:
        assert answer.stopped_s is not None
        until_s = answer.stopped_s
    return answer, free_standing, until_s


@pytest.mark.parametrize("record", REAL_SLUMPS)
def test_slump_under_a_record(record: str, records_dir: Path) -> None:
    answer, free_standing, until_s = record_case(records_dir, record, REAL_SLUMPS[record])
    assert answer.kind == "slumping"
    assert answer.history is not None
    # up to where it leaves the plane, or to the end; what follows is in benchmarks.followed_on
    peak = float(answer.history.theta_rad[answer.history.time_s <= until_s].max())
    assert peak > 0.01
    if not answer.mode_changes:
        assert peak == answer.peak_theta_rad
    assert free_standing.turned_rad[free_standing.time_s <= until_s].max() == pytest.approx(
        peak, rel=1e-3
    )
    assert deviation(answer, free_standing, until_s) < 1e-3 * peak


@pytest.mark.parametrize("record", ["CHY028-N.AT2", "CHY080-N.AT2"])
def test_confined_under_a_record(record: str, records_dir: Path) -> None:
    case = Case(-60, 20, 1, 15, 35, 35, (), until=38.0)
    answer, free_standing, until_s = record_case(records_dir, f"peer_at2_opensees/{record}", case)
    assert answer.kind == "confined_toppling"
    assert answer.history is not None
    peak = float(answer.history.theta_rad[answer.history.time_s <= until_s].max())
    assert peak > 0.02
    assert deviation(answer, free_standing, until_s, sign=-1.0) < 1e-3 * peak
