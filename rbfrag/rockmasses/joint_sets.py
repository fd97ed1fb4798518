"""Rock mass with two random joint sets, and the blocks sampled from it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.rockmasses.distributions import Distribution, in_section
from rbfrag.solver.block.arrays import BlockArray
from rbfrag.solver.results import FloatArray
from rbfrag.solver.stability import joint as joints
from rbfrag.solver.stability.arrays import FLOATS, OF_JOINT, StabilityArray, stability_arrays
from rbfrag.solver.stability.arrays import water_held_m as held_m
from rbfrag.solver.stability.modes import MODES, STATES, ModeName, StateName

REALISATIONS = 20_000
"""Blocks that are drawn when nothing else is asked for."""

MOST_REALISATIONS = 5_000_000
SEED = 1
"""Seed when nothing else is asked for."""

_LARGEST_SEED = 2**63 - 1


class Variable(NamedTuple):
    """Variable of a rock mass that may be random.

    Args:
        stream: number of its own stream of random numbers; never to be given to another.
        low: lower end of its permitted range.
        from_low: whether the lower end itself is permitted.
        default: value when the description leaves it out; NaN if it must be there.
    """

    stream: int
    low: float
    high: float
    from_low: bool = False
    default: float = math.nan


VARIABLES: dict[str, Variable] = {
    "base.dip_deg": Variable(0, -90.0, 90.0),
    "base.spacing_m": Variable(1, 0.0, math.inf),
    "back.dip_deg": Variable(2, -90.0, 270.0),
    "back.spacing_m": Variable(3, 0.0, math.inf),
    "friction.phi_deg": Variable(4, 0.0, 90.0, from_low=True),
    "friction.phi_back_deg": Variable(5, 0.0, 90.0, from_low=True),
    "block.size_factor": Variable(6, 0.0, math.inf, default=1.0),
    "block.kv": Variable(7, -1.0, math.inf, default=0.0),
    "friction.cohesion_pa": Variable(8, 0.0, math.inf, from_low=True),
    "block.density_kg_m3": Variable(9, 0.0, math.inf),
    "back.water_m": Variable(10, 0.0, math.inf, from_low=True),
    "friction.jrc": Variable(11, 0.0, math.inf, from_low=True),
    "friction.jcs_mpa": Variable(12, 0.0, math.inf),
    "friction.joint_length_m": Variable(13, 0.0, math.inf),
    "friction.phi_residual_deg": Variable(14, 0.0, 90.0, from_low=True),
}
"""The variables of a rock mass by their keys."""

DRAINAGE = "back.drainage"
_SETTINGS = ("block.back_fracture", DRAINAGE, "realisations", "seed")
_BACK_FRICTION = "friction.phi_back_deg"
_COHESION, _DENSITY = "friction.cohesion_pa", "block.density_kg_m3"
_WATER, _RESIDUAL = "back.water_m", "friction.phi_residual_deg"
_ROUGHNESS = ("friction.jrc", "friction.jcs_mpa", "friction.joint_length_m")
_WEIGHED = (_COHESION, _WATER, _ROUGHNESS[0])
"""Variables whose effect is that of a stress over the weight: they need a density."""

_OPTIONAL = (_BACK_FRICTION, _COHESION, _DENSITY, _WATER, *_ROUGHNESS, _RESIDUAL)

IMPOSSIBLE = (
    "",
    "the spacing of the base fractures is not above zero",
    "the spacing of the back fractures is not above zero",
    "the dip of the base is not between -90 and 90 degrees",
    "gamma = dip of the back - dip of the base is not between 0 and 180 degrees",
    "a friction angle is not from 0 to below 90 degrees",
    "the size factor is not above zero",
    "kv is not above -1 g",
    "the cohesion is below zero",
    "the density is not above zero",
    "water, roughness or residual friction is not in its range",
    "the water lifts the block off its base: it floats",
    "the planes make a sliver without thickness (alpha1 is not below alpha3)",
)
"""Why a realisation is no block, by its reason code; 0 for one that is."""


@dataclass(frozen=True)
class RockMass:
    """Two joint sets, their friction and the size of the blocks between them.

    Make one with :meth:`of`, or read it from a file.

    Args:
        variables: law of each variable by its key in :data:`VARIABLES`.
        back_fracture: False for blocks that no plane supports from behind.
        realisations: number of blocks that the description asks for.
        seed: seed of the random numbers that the description asks for.
        remarks: warnings about its planes in space, and about an assumed density.
        drainage: what the water in the back fractures does while blocks move, `UNDRAINED` or
            `DRAINED` of :mod:`rbfrag.solver.stability.joint`.
    """

    variables: Mapping[str, Distribution]
    back_fracture: bool = True
    realisations: int = REALISATIONS
    seed: int = SEED
    remarks: tuple[str, ...] = ()
    drainage: str = joints.UNDRAINED

    @classmethod
    def of(cls, description: Mapping[str, object]) -> RockMass:
        """Return the rock mass described by a mapping.

        Args:
            description: keys such as ``base.dip_deg`` with a number or the keys of a
                :class:`~rbfrag.rockmasses.distributions.Distribution`; ``friction.phi_back_deg``,
                ``friction.cohesion_pa``, ``back.water_m``, ``friction.jrc`` with
                ``friction.jcs_mpa`` and perhaps ``friction.joint_length_m``,
                ``friction.phi_residual_deg``, ``block.density_kg_m3`` (2,650 where cohesion, water
                or roughness need it), ``block.size_factor``, ``block.kv``,
                ``block.back_fracture``, ``back.drainage`` (``undrained``, the default, or
                ``drained``), ``realisations`` and ``seed`` may be left out. ``face.plane``,
                ``base.plane`` and ``back.plane``, each dip/dip direction or a list of such, stand
                for the dips.

        Raises:
            InputError: a key is missing, unknown or has an impossible value; it is named.
        """
        description, remarks = in_section(description)
        for key in description:
            if key not in VARIABLES and key not in _SETTINGS:
                keys = ", ".join((*VARIABLES, *_SETTINGS))
                raise InputError(f"unknown key {key}: the keys of a rock mass are {keys}")
        variables: dict[str, Distribution] = {}
        for key, variable in VARIABLES.items():
            if key in description:
                variables[key] = _law(key, variable, description[key])
            elif not math.isnan(variable.default):
                variables[key] = Distribution("constant", location=variable.default)
            elif key not in _OPTIONAL:
                raise InputError(
                    f"{key} is missing: give a number, or a table such as "
                    "{ distribution = 'normal', mean = …, sd = … }"
                )
        if _DENSITY not in variables and not variables.keys().isdisjoint(_WEIGHED):
            remarks = (*remarks, joints.ASSUMED_DENSITY)
        drainage = description.get(DRAINAGE)
        if drainage is not None and _WATER not in variables:
            raise InputError(f"{DRAINAGE} requires {_WATER}")
        drains = joints.is_drained(drainage)
        joints.reject_half(*(variables.get(key) for key in _ROUGHNESS))
        back_fracture = description.get("block.back_fracture", True)
        if not isinstance(back_fracture, bool):
            raise InputError(f"block.back_fracture = {back_fracture!r}: use true or false")
        if _WATER in variables and not back_fracture:
            raise InputError(joints.NO_FRACTURE)
        return cls(
            variables,
            back_fracture,
            checked_count(description.get("realisations", REALISATIONS), "realisations"),
            checked_seed(description.get("seed", SEED), "seed"),
            remarks,
            joints.DRAINED if drains else joints.UNDRAINED,
        )

    def draw(self, n: int, seed: int) -> dict[str, FloatArray]:
        """Return n values of every variable, each from its own random stream."""
        streams = {key: VARIABLES[key].stream for key in self.variables}
        seeds = {key: np.random.SeedSequence(seed, spawn_key=(k,)) for key, k in streams.items()}
        return {
            key: law.sample(n, np.random.default_rng(seeds[key]))
            for key, law in self.variables.items()
        }

    def realise(self, n: int | None = None, seed: int | None = None) -> Realisations:
        """Sample blocks at random, with their modes and yield accelerations.

        Every variable has its own stream of random numbers: changing the law of one of them,
        or letting one more of them scatter, leaves the values of the others as they were.

        Args:
            n: how many; None for what the description asks for.
            seed: seed; None for that of the description.

        Raises:
            InputError: n or seed is impossible, or none of the realisations is a block.
        """
        n = self.realisations if n is None else checked_count(n, "n")
        seed = self.seed if seed is None else checked_seed(seed, "seed")
        return self.blocks_of(self.draw(n, seed), seed)

    def blocks_of(self, drawn: Mapping[str, FloatArray], seed: int = SEED) -> Realisations:
        """Return the blocks for values of every variable, shape (n,) each.

        Water that would stand above the top of a fracture fills it.
        """
        n = drawn["base.dip_deg"].size
        factor, phi = drawn["block.size_factor"], drawn["friction.phi_deg"]
        beta, back_dip = drawn["base.dip_deg"], drawn["back.dip_deg"]
        s1, s2 = drawn["base.spacing_m"] * factor, drawn["back.spacing_m"] * factor
        phi_back = drawn.get(_BACK_FRICTION, phi)
        gamma = back_dip - beta
        density = drawn.get(_DENSITY, np.full(n, joints.ROCK_KG_M3))
        cohesion, water = (drawn.get(key, np.zeros(n)) for key in (_COHESION, _WATER))
        reason = np.zeros(n, dtype=np.int8)
        # Slivers come last: where another reason holds there is no block to be one.
        for code, valid in enumerate(
            (
                drawn["base.spacing_m"] > 0.0,
                drawn["back.spacing_m"] > 0.0,
                np.abs(beta) < 90.0,
                (gamma > 0.0) & (gamma < 180.0),
                (phi >= 0.0) & (phi < 90.0) & (phi_back >= 0.0) & (phi_back < 90.0),
                factor > 0.0,
                drawn["block.kv"] > -1.0,
                cohesion >= 0.0,
                density > 0.0,
            ),
            start=1,
        ):
            reason[~valid & (reason == 0)] = code
        possible = reason == 0
        blocks = BlockArray.from_fractures(np.where(possible, s1, np.nan), s2, gamma)
        water = held_m(water, s1_m=s1, gamma_deg=gamma, beta_deg=beta)
        strength = {_COHESION: cohesion, _WATER: water, **{k: drawn.get(k) for k in _ROUGHNESS}}
        joint: dict[str, Any] = {k.split(".")[1]: strength[k] for k in strength if k in drawn}
        if joint:
            joint["density_kg_m3"] = density

        def on_joint(joint: dict[str, Any], phi: FloatArray, phi_back: FloatArray) -> Realisations:
            stability = stability_arrays(
                blocks, phi_deg=phi, phi_back_deg=phi_back, beta_deg=beta, kv=drawn["block.kv"],
                back_fracture=self.back_fracture, **joint,
            )  # fmt: skip
            return Realisations(
                rock_mass=self,
                seed=seed,
                beta_deg=beta,
                gamma_deg=gamma,
                s1_m=s1,
                s2_m=s2,
                phi_deg=phi,
                phi_back_deg=phi_back,
                kv=drawn["block.kv"],
                cohesion_pa=joint.get("cohesion_pa", np.zeros(n)),
                water_m=water,
                jrc=joint.get("jrc", np.zeros(n)),
                joint=joint,
                blocks=blocks,
                stability=stability,
                reason_code=reason,
            )

        def realised(joint: dict[str, Any]) -> Realisations:
            first = on_joint(joint, phi, phi_back)
            if _RESIDUAL not in drawn:
                return first
            residual_joint = {
                name: values for name, values in joint.items() if name not in joints.ENDED
            }
            residual = drawn[_RESIDUAL]
            return replace(first, after_slip=on_joint(residual_joint, residual, residual))

        # drained blocks are dry ones
        dry = {name: values for name, values in joint.items() if name != "water_m"}
        drains = self.drainage == joints.DRAINED
        realisations = realised(dry if drains else joint)
        stability, residual_stability = realisations.stability, realisations.in_time.stability
        codes, sliver = stability.reason_code, len(IMPOSSIBLE) - 1
        # in place: all of these realisations are the same blocks
        reason[possible & ((codes != 0) | ~(stability.p2 > 0.0))] = sliver
        reason[possible & (codes == FLOATS)] = sliver - 1
        reason[
            possible
            & ((codes == OF_JOINT) | ((codes == 0) & (residual_stability.reason_code != 0)))
        ] = sliver - 2
        if np.any(water[possible] > 0.0):
            drained = realisations if drains else realised(dry)
            realisations = replace(realisations, drained=drained)
        if realisations.n_blocks == 0:
            raise InputError(f"none of {n} realisations is a block: {realisations.why_impossible}")
        return realisations


@dataclass(frozen=True, eq=False)
class Realisations:
    """Blocks sampled from a rock mass; all arrays have shape (n,).

    Args:
        beta_deg: dip of the base [deg].
        gamma_deg: dip of the back less dip of the base [deg].
        s1_m: thickness normal to the base [m].
        s2_m: thickness normal to the back [m].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back [deg].
        kv: vertical acceleration of the ground [g].
        cohesion_pa: cohesion of the base [Pa]; 0 where the description states none.
        water_m: height of the water in the back fracture above the heel [m]; 0 likewise.
        jrc: joint roughness coefficient of the base; 0 likewise.
        joint: keywords of :func:`rbfrag.solver.stability.single.stability` about bond, water that
            acts, and roughness, with the density of the rock; empty for dry joints of friction.
        stability: the modes of the blocks, states and yield accelerations.
        reason_code: why a realisation is no block, a place in :data:`IMPOSSIBLE`.
        after_slip: the same blocks on their residual friction, without bond or roughness; None
            where the description states no residual friction.
        drained: the same blocks whose water drains as they start to move, which is the other
            bound; None without water.
    """

    rock_mass: RockMass
    seed: int
    beta_deg: FloatArray
    gamma_deg: FloatArray
    s1_m: FloatArray
    s2_m: FloatArray
    phi_deg: FloatArray
    phi_back_deg: FloatArray
    kv: FloatArray
    cohesion_pa: FloatArray
    water_m: FloatArray
    jrc: FloatArray
    joint: Mapping[str, FloatArray]
    blocks: BlockArray
    stability: StabilityArray
    reason_code: NDArray[np.int8]
    after_slip: Realisations | None = None
    drained: Realisations | None = None

    @property
    def in_time(self) -> Realisations:
        """The blocks with the joint strength that remains after their first slip."""
        return self.after_slip or self

    @property
    def n(self) -> int:
        """Number of realisations, valid or not."""
        return int(self.reason_code.size)

    @property
    def is_block(self) -> NDArray[np.bool_]:
        """True where a realisation is a valid block, shape (n,)."""
        return np.equal(self.reason_code, 0)

    def of_mode(self, mode: ModeName, state: StateName | None = None) -> NDArray[np.bool_]:
        """Return the blocks of a mode, in one state or in any, as a mask of shape (n,)."""
        chosen = self.is_block & (self.stability.mode_code == MODES.index(mode))
        if state is not None:
            chosen &= self.stability.state_code == STATES.index(state)
        return np.asarray(chosen)

    @property
    def n_blocks(self) -> int:
        """Number of realisations that are blocks."""
        return int(np.count_nonzero(self.is_block))

    @property
    def impossible(self) -> dict[str, int]:
        """Number of invalid realisations, by reason."""
        counts = np.bincount(self.reason_code, minlength=len(IMPOSSIBLE)).tolist()
        return {text: c for text, c in zip(IMPOSSIBLE[1:], counts[1:], strict=True) if c}

    @property
    def why_impossible(self) -> str:
        """Number of invalid realisations with their reasons, as text."""
        return "; ".join(f"{count} times {text}" for text, count in self.impossible.items())

    @property
    def reason(self) -> NDArray[np.object_]:
        """Reason why each realisation is invalid, as text; empty for a block."""
        return np.array(IMPOSSIBLE, dtype=object)[self.reason_code]

    def reject_vertical(self) -> None:
        """Reject a rock mass with a vertical acceleration, which is part of the motion."""
        if np.any(self.kv != 0.0):
            raise InputError(
                "block.kv is not supported with a motion, which has the vertical acceleration: "
                "omit the key"
            )

    @property
    def ends_with_slip(self) -> NDArray[np.bool_]:
        """True where the joint strength of a block ends with its first slip, shape (n,).

        That of a topple does not, which turns about its toe whatever bond or roughness.
        """
        on_base = (self.cohesion_pa > 0.0) | (self.jrc > 0.0)
        topples = self.stability.mode_code == MODES.index("topple")
        return np.asarray(self.is_block & on_base & ~topples)

    @property
    def is_wet(self) -> NDArray[np.bool_]:
        """True where water acts on a block during motion, shape (n,)."""
        return np.asarray(self.joint.get("water_m", np.zeros(self.n)) > 0.0)

    @property
    def kr_at_rest(self) -> FloatArray:
        """Toppling yield without vertical acceleration; NaN for other modes.

        tan(α3 - β) less the moment of the water, which k_v leaves as it is.
        """
        alone = np.tan(np.radians(self.blocks.alpha3_deg - self.beta_deg))
        return self.stability.kr - self.kv * alone


def checked_count(value: object, name: str) -> int:
    """Return a valid number of realisations; reject others."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 < value <= MOST_REALISATIONS:
        raise InputError(
            f"{name} = {value!r}: give a whole number of realisations from 1 to "
            f"{MOST_REALISATIONS}, such as {REALISATIONS}"
        )
    return value


def checked_seed(value: object, name: str) -> int:
    """Return a valid seed; reject others."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= _LARGEST_SEED:
        raise InputError(f"{name} = {value!r}: give a whole number from 0 to {_LARGEST_SEED}")
    return value


def _law(key: str, variable: Variable, description: object) -> Distribution:
    try:
        law = Distribution.of(description, angle=key.endswith("_deg"))
    except InputError as error:
        raise InputError(f"{key}: {error}") from None
    low, high = variable.low, variable.high
    for centre in law.centres:
        if low < centre < high or (variable.from_low and centre == low):
            continue
        if math.isinf(high):
            allowed = f"{low:g} or more" if variable.from_low else f"above {low:g}"
        elif variable.from_low:
            allowed = f"from {low:g} to below {high:g}"
        else:
            allowed = f"between {low:g} and {high:g}"
        raise InputError(f"{key}: {centre:.10g} is out of range: give {allowed}")
    return law
