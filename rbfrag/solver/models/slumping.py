"""A block that slumps: it turns backward while its heel slides down the base and its back edge
down the back plane.

Friction is fully mobilised at both contacts, against the motion: forward (sense 1) or, when
the ground drives the block back up, in reverse (sense -1). The equation of two sliding contacts is
derived in `rbfrag.solver.integrator.one_freedom.two_contacts`; it has the form of toppling,

    θ'' = p_s²(θ) [k_h - (1 + k_v) k_s(θ)] - q(θ) θ'²

and reads, as all mechanisms here do,

    inertia θ'' = driving k_h - resistance (1 + k_v) - braking θ'².

The dissertation's own chapter on slumping is not available; this is derived from rigid-body
mechanics.

Strength and frequency do not fix a slump: shape, friction and dip do. Campaigns shake a family that
spans the slumping blocks of the dissertation's rock mass (its Table 3.4: base 20 and back 45
degrees, spacings 1 and 0.6 m, friction 40 degrees) and weaker ones. Every block of it slumps and is
stable at rest.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.integrator.one_freedom.equation import (
    Ending,
    Equation,
    Exit,
    Mechanism,
    Phase,
    Pose,
)
from rbfrag.solver.integrator.one_freedom.follow import follow
from rbfrag.solver.integrator.one_freedom.harmonics import Harmonics, Vector, constant, turning
from rbfrag.solver.integrator.one_freedom.two_contacts import Contact, two_contact_equation
from rbfrag.solver.kind import (
    BlockOnPlanes,
    Case,
    CaseRequest,
    CaseResult,
    Measures,
    Shaking,
    each_once,
)
from rbfrag.solver.mechanism import ShakenMechanism, shaken_mechanism
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import SEARCH_LIMIT, CriticalResult, FloatArray, Outcome, no_intervals
from rbfrag.solver.search.scale import (
    BRACKET,
    SCAN_RATIO,
    ScaledKind,
    critical_rad,
    critical_scales,
    grid_points,
    rotation_rad,
    scaled_run,
    scan_rules,
)


def mechanism(site: BlockOnPlanes) -> Mechanism:
    """Return the slumping block.

    Raises:
        InputError: there is no back plane, or the corner at the heel is missing.
    """
    block = site.block
    assert block is not None
    if not site.back_fracture:
        raise InputError("a block without a plane behind it cannot slump: it turns over backward")
    if block.lowest_on_back != block.heel:
        raise InputError(
            "slumping in time is known for blocks whose heel lies on the back plane: the corner "
            "at the heel of this outline is missing"
        )
    # past recovery: the back edge lies on the base, with a forward angle α1 + γ > φ1
    flat = block.on_back_edge_rad
    slip = heel_slip(block)
    path = centroid_path(block)

    def pose(theta: float) -> Pose:
        return Pose(theta, (path.x(theta), path.y(theta)), slip(theta))

    def after(exit: Exit) -> Ending:
        return Ending(
            Outcome.TOPPLED,
            f"at {exit.time_s:.3f} s the back edge of the block lies on the base plane: it slides "
            "on from there, which is not followed",
        )

    forward = equation(site, 1.0)
    return Mechanism(
        first=Phase(
            name="slumps",
            forward=forward,
            reverse=equation(site, -1.0),
            pose=pose,
            after=after,
            highest=flat,
        ),
        rotates=True,
        critical=forward.first_without_strength(flat),
        if_impact="the block was driven back to where it had been: it is taken to stop there "
        "without rebound, whatever its speed",
        least_q=_driven_up_the_back_plane(site),
        goes_on=True,
        if_below="the record drives the block up its back plane at times, which is not followed",
    )


def _driven_up_the_back_plane(site: BlockOnPlanes) -> float:
    """Return the k_h/(1 + k_v) below which the whole block slides up the back plane."""
    assert site.block is not None
    steepness = math.radians(site.block.gamma_deg) + site.beta_rad + site.phi_back_rad
    return -math.tan(steepness) if steepness < 0.5 * math.pi else -math.inf


def equation(site: BlockOnPlanes, sense: float) -> Equation:
    """Return the equation of motion, forward (1) or in reverse (-1)."""
    block = site.block
    assert block is not None
    gamma = math.radians(block.gamma_deg)
    # (3.24, 3.25): friction opposes the slip of both contacts, and changes sides with its sense
    phi1, phi2 = sense * site.phi_rad, sense * site.phi_back_rad
    return two_contact_equation(
        base=Contact(
            arm=turning(block.heel),
            direction=(-math.sin(phi1), math.cos(phi1)),
            lost="the heel lifts off the base",
        ),
        back=Contact(
            arm=turning(block.back),
            direction=(math.sin(gamma - phi2), math.cos(gamma - phi2)),
            lost="the block leaves its back plane",
        ),
        path=centroid_path(block),
        clockwise=False,
        inertia_m2=block.inertia_m2,
        beta_rad=site.beta_rad,
    )


def heel_slip(block: Block) -> Harmonics:
    """Return how far the heel has slid down the base [m], so that contact 2 stays on its plane."""
    gamma = math.radians(block.gamma_deg)
    # distance of contact 2 from the back plane, if the heel stayed where it is
    edge = turning(block.back) - turning(block.heel)
    off_plane = edge.x * math.sin(gamma) + edge.y * math.cos(gamma)
    return (constant(off_plane(0.0)) - off_plane) * (1.0 / math.sin(gamma))


def centroid_path(block: Block) -> Vector:
    """Return the position of the centroid, from the heel at rest [m]."""
    return Vector(heel_slip(block), constant(0.0)) - turning(block.heel)


@dataclass(frozen=True)
class BlockClass:
    """A parallelogram and its planes: all that decides how it slumps.

    Args:
        s1_m: thickness normal to the base [m].
        s2_m: thickness normal to the back plane [m].
        gamma_deg: dip of the back plane less dip of the base [deg].
        beta_deg: dip of the base, out of the slope positive [deg].
        phi_deg: friction angle of both planes [deg].
    """

    s1_m: float
    s2_m: float
    gamma_deg: float
    beta_deg: float
    phi_deg: float

    @property
    def block(self) -> Block:
        """Shape and size."""
        return Block.from_fractures(self.s1_m, self.s2_m, self.gamma_deg)

    def as_dict(self) -> dict[str, float]:
        """Return the block as it is stored."""
        return asdict(self)


GAMMA_DEG = (20.0, 25.0, 30.0)
SPACING_RATIO = 0.4
"""S2/S1: thinner between the back planes than between the base planes, or the blocks slide."""
PLANES_DEG = ((20.0, 30.0), (20.0, 40.0), (10.0, 35.0))
"""Dip of the base and friction angle."""
SIZES_M = (0.25, 1.0)
"""S1: larger blocks leave their back plane before they have turned far."""

FAMILY = tuple(
    BlockClass(size, SPACING_RATIO * size, gamma, beta, phi)
    for gamma, (beta, phi), size in product(GAMMA_DEG, PLANES_DEG, SIZES_M)
)
"""Three shapes, three pairs of dip and friction, two sizes."""

ROTATIONS_DEG: tuple[float | None, ...] = (2.0, None)
"""Rotations that count as failure of a slump [deg]; None for failure past recovery."""

RATIOS = np.geomspace(0.02, 0.95, 25)
"""k_s/PGA of the outcome grid: the record is scaled to them."""


RULES = ("search_limit", "scan_ratio", "bracket")
"""Settings of a case that are the rules of its search."""


class Slumping(ScaledKind):
    """The slumping model; campaigns shake the blocks of the family."""

    yield_name = "ks"
    sequence_measure = "peak_rad"
    one_phase = True

    def mechanism(self, site: BlockOnPlanes) -> Mechanism:
        """Return the slumping block."""
        return mechanism(site)

    def cases(self, **request: Any) -> tuple[Case, ...]:
        """Return every block of the family with every rotation that counts as failure.

        Raises:
            InputError: no rotation, one that repeats or that a block of the family cannot reach; a
                block that does not slump.
        """
        self.refuse_foreign(request, ("rotations_deg", "family"))
        family: Sequence[BlockClass] = request.get("family", FAMILY)
        rotations = [
            None if value is None else positive(value, "rotation_deg", "degrees")
            for value in request.get("rotations_deg", ROTATIONS_DEG)
        ]
        each_once(rotations, "rotation_deg", for_none="recovery")
        least = min(each.gamma_deg for each in family)
        for rotation in rotations:
            if rotation is not None and rotation >= least:
                raise InputError(
                    f"rotation_deg {rotation:g}: a block of the family lies on its back edge at "
                    f"{least:g} degrees; give less, or the word recovery for failure past recovery",
                    fields=("rotation_deg",),
                )
        settings = {"search_limit": SEARCH_LIMIT, "scan_ratio": SCAN_RATIO, "bracket": BRACKET}
        return tuple(
            Case(
                self.kind,
                self._shaken(each).p2,
                each.as_dict(),
                {**settings, "rotation_deg": rotation},
            )
            for each in family
            for rotation in rotations
        )

    def grid(self, case: Case, measures: Measures) -> FloatArray:
        """Return k_s/PGA to which the record is scaled."""
        return RATIOS if measures.pga_g > 0.0 else np.empty(0)

    def run_cases(
        self, shaking: Shaking, cases: Sequence[Case], request: CaseRequest
    ) -> list[CaseResult]:
        """Return critical scale and outcome grid of every case under one motion.

        Cases of one block share their runs. The map is what the search saw; it costs nothing.
        """
        excited = shaking.excitation
        together: defaultdict[BlockClass, list[int]] = defaultdict(list)
        for number, case in enumerate(cases):
            together[_class_of(case)].append(number)
        results: dict[int, CaseResult] = {}
        for block, numbers in together.items():
            settings: dict[str, Any] = dict(cases[numbers[0]].settings)
            rotations: list[Any] = [cases[i].settings["rotation_deg"] for i in numbers]
            shaken = self._shaken(block)
            searched: Sequence[CriticalResult | None] = [None] * len(numbers)
            if request.search:
                rules = scan_rules(*(settings[name] for name in RULES))
                searched = critical_scales(shaking, shaken, rotations, rules)
            ratios = self.grid(cases[numbers[0]], shaking.motion)[: None if request.grid else 0]
            scales = [shaken.yield_g / (k * excited.pga_g) for k in ratios.tolist()]
            ends = [follow(shaken.mechanism, excited.scaled(scale)) for scale in scales]
            for i, rotation, result in zip(numbers, rotations, searched, strict=True):
                fails = rotation_rad(rotation, shaken)
                runs = [scaled_run(*each, fails) for each in zip(ends, scales, strict=True)]
                if result is not None and not request.full_map:
                    result = replace(result, intervals=no_intervals())
                blocks = grid_points(ratios, runs, critical_rad(shaken)) if request.grid else None
                results[i] = CaseResult(result, blocks)
        return [results[i] for i in range(len(cases))]

    def sequence_blocks(self, cases: Sequence[Case]) -> tuple[Mapping[str, object], ...]:
        """Return the blocks of the family."""
        return tuple(block.as_dict() for block in dict.fromkeys(map(_class_of, cases)))

    def sequence_limits(self, cases: Sequence[Case]) -> tuple[float | None, ...]:
        """Return the stated rotations [rad]."""
        stated: list[Any] = [case.settings["rotation_deg"] for case in cases]
        return tuple(
            None if rotation is None else math.radians(rotation)
            for rotation in dict.fromkeys(stated)
        )

    def sequence_site(self, block: Mapping[str, Any]) -> BlockOnPlanes:
        """Return the block on its planes."""
        return self._shaken(BlockClass(**block)).site

    def _shaken(self, each: BlockClass) -> ShakenMechanism:
        return shaken_mechanism(
            each.block, kind=self.kind, beta_deg=each.beta_deg, phi_deg=each.phi_deg
        )


def _class_of(case: Case) -> BlockClass:
    try:
        return BlockClass(**case.block)  # type: ignore[arg-type]
    except TypeError:
        raise InputError(f"its block {case.block} is not described as slumping ones are") from None


MODEL = Slumping.named("slumping")
