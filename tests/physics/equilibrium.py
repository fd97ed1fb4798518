"""Statics of a block on its planes, written without any formula of the package.

Trigonometry, 3x3 systems and a linear programme over contact forces; arms in metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin, tan

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """A block and what acts on it; angles in degrees, arms from the centroid."""

    a1: float
    a3: float
    gamma: float
    heel: Vector
    back: Vector
    toe: Vector
    beta: float
    phi1: float
    phi2: float
    kv: float = 0.0
    bond: float = 0.0  # strength of the base's cohesion over the weight
    low: Vector | None = None  # lowest point on the back plane, if it is not the heel

    @property
    def lowest(self) -> Vector:
        return self.heel if self.low is None else self.low


def parallelogram(
    a1: float, a3: float, r3: float, beta: float, phi1: float, phi2: float, kv: float = 0.0
) -> Case:
    """The block of two angles, from edge vectors (eqs. 3.1-3.3)."""
    A1, A3 = radians(a1), radians(a3)
    r1 = r3 * cos(A3) / cos(A1)
    heel = np.array([r1 * sin(A1), -r1 * cos(A1)])
    toe = np.array([r3 * sin(A3), -r3 * cos(A3)])
    base = toe - heel
    back = -heel - base  # the corner opposite the toe
    edge = back - heel
    gamma = np.degrees(np.arctan2(edge[1], -edge[0]))
    return Case(a1, a3, float(gamma), heel, back, toe, beta, phi1, phi2, kv)


def horizontal(case: Case) -> Vector:
    b = radians(case.beta)
    return np.array([cos(b), sin(b)])


def upward(case: Case) -> Vector:
    b = radians(case.beta)
    return np.array([-sin(b), cos(b)])


def moment(arm: Vector, force: Vector) -> float:
    return float(arm[0] * force[1] - arm[1] * force[0])


def base_reaction(case: Case) -> Vector:
    """Direction of the base's reaction on a block that slides down it."""
    f = radians(case.phi1)
    return np.array([-sin(f), cos(f)])


def back_reaction(case: Case, sense: int) -> Vector:
    """Direction of the back plane's reaction; sense +1 opposes sliding down it, -1 up it."""
    g, f = radians(case.gamma), radians(case.phi2)
    normal = np.array([sin(g), cos(g)])
    up = np.array([-cos(g), sin(g)])
    return cos(f) * normal + sense * sin(f) * up


def two_contacts(case: Case, at_base: Vector, at_back: Vector, sense: int) -> tuple[float, ...]:
    """Solve R_base, R_back and k from the two forces and the moment."""
    u1, u2 = base_reaction(case), back_reaction(case, sense)
    bond = np.array([-case.bond, 0.0])
    matrix = np.zeros((3, 3))
    matrix[:2, 0], matrix[:2, 1], matrix[:2, 2] = u1, u2, horizontal(case)
    matrix[2, :2] = moment(at_base, u1), moment(at_back, u2)
    right = np.zeros(3)
    right[:2] = (1.0 + case.kv) * upward(case) - bond
    right[2] = -moment(at_base, bond)
    return tuple(np.linalg.solve(matrix, right))


def slump(case: Case) -> tuple[float, ...]:
    return two_contacts(case, case.heel, case.back, +1)


def confined(case: Case) -> tuple[float, ...]:
    return two_contacts(case, case.toe, case.heel, -1)


def slide(case: Case) -> tuple[float, ...]:
    """Normal force, its place along the base from the centroid, and k."""
    u1, x = base_reaction(case), horizontal(case)
    # R u1 + (-bond, 0) + k x = (1 + k_v) up
    matrix = np.column_stack([u1, x])
    force, k = np.linalg.solve(matrix, (1.0 + case.kv) * upward(case) + np.array([case.bond, 0.0]))
    total = force * u1 - np.array([case.bond, 0.0])
    # the moment of the base's whole reaction about the centroid vanishes
    place = case.heel[1] * total[0] / total[1]
    return float(total[1]), float(place), float(k)


def topple(case: Case) -> tuple[float, ...]:
    """Reaction of the toe (x, y) and k, from moments about the toe."""
    x, y = horizontal(case), -(1.0 + case.kv) * upward(case)
    k = -moment(-case.toe, y) / moment(-case.toe, x)
    reaction = -(y + k * x)
    return float(reaction[0]), float(reaction[1]), float(k)


@dataclass(frozen=True)
class Limit:
    """The greatest k for which admissible contact forces hold the block, and these forces."""

    k: float
    heel: float
    toe: float
    back_low: float
    back_high: float
    base_shear_left: float


def limit_of_equilibrium(case: Case, back_plane: bool = True) -> Limit | None:
    """Greatest k by a linear programme; None when no k, or every k, can be held.

    Unknowns are the forces along both edges of each contact's friction cone, and k.
    """
    t1, t2 = tan(radians(case.phi1)), tan(radians(case.phi2))
    g = radians(case.gamma)
    normal, up = np.array([sin(g), cos(g)]), np.array([-cos(g), sin(g)])
    base_low, base_high = np.array([-t1, 1.0]), np.array([t1, 1.0])
    contacts = [(case.heel, base_low), (case.heel, base_high)]
    contacts += [(case.toe, base_low), (case.toe, base_high)]
    if back_plane:
        for arm in (case.lowest, case.back):
            contacts += [(arm, normal - t2 * up), (arm, normal + t2 * up)]
    size = float(np.hypot(*case.toe))
    columns = [[*force, moment(arm, force) / size] for arm, force in contacts]
    columns.append([*horizontal(case), 0.0])
    right = [*((1.0 + case.kv) * upward(case)), 0.0]
    cost = np.zeros(len(columns))
    cost[-1] = -1.0
    result = linprog(
        cost,
        A_eq=np.array(columns).T,
        b_eq=np.array(right),
        bounds=[(0.0, None)] * len(contacts) + [(None, None)],
        method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    if result.status != 0:
        assert result.status in (2, 3, 4), result.message
        return None
    forces = result.x
    low, high = (forces[4] + forces[5], forces[6] + forces[7]) if back_plane else (0.0, 0.0)
    return Limit(
        k=float(forces[-1]),
        heel=float(forces[0] + forces[1]),
        toe=float(forces[2] + forces[3]),
        back_low=float(low),
        back_high=float(high),
        base_shear_left=float(forces[1] + forces[3]),
    )
