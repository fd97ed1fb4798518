"""Simulation of the blocks of a rock mass under one recorded motion, each in its own mode."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import Polarity
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import Excitation, excitation, motion_remarks
from rbfrag.solver.kind import RunEnd, Runner, SupportedBlock
from rbfrag.solver.models import model_of_mode
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import FloatArray, Outcome
from rbfrag.solver.stability import modes
from rbfrag.solver.stability.single import assess_stability, push_of

OUTCOMES = (
    "at_rest", "stays", "fails", "unstable", "locked",
    "undetermined", "contact_lost", "indeterminate", "jump", "bond_breaks",
)  # fmt: skip
"""What may become of a block, by its code:

``at_rest``: never moves; ``stays``: moves, and does not fail; ``fails``; ``unstable``: fails at
rest, whatever the motion; ``locked``: no horizontal acceleration moves it in its mode;
``undetermined``: closer to failure than the error of its run; ``contact_lost``,
``indeterminate`` and ``jump``: the model ended before the block did, for the reason of that
outcome; ``bond_breaks``: the motion exceeds the yield of a block whose bond or roughness ends with
the first slip.
"""

AT_REST, STAYS, FAILS, UNSTABLE, LOCKED, UNDETERMINED = range(6)
BOND_BREAKS = OUTCOMES.index("bond_breaks")
NO_BLOCK = -1
"""Code of a realisation that is no block."""

NO_MODE = -1
"""Code of the mode of a motion that there is none of."""

OPEN = ("undetermined", "contact_lost", "indeterminate", "jump", "bond_breaks")
"""Outcomes that leave open whether the block fails."""

DISPLACEMENT_M = 0.05
"""Displacement beyond which a slide counts as failed when nothing else is said [m].

A choice, not a law: studies of landslides have taken 5 to 10 cm as the displacement that leads to
cracks and general failure (Jibson 1993, Transportation Research Record 1411, 9-17).
"""


@dataclass(frozen=True)
class FailureLimits:
    """Failure limits, in addition to loss of stability.

    Args:
        displacement_m: a sliding block fails where it slides further than this [m].
        rotation_deg: a block that slumps, or topples against its back plane, fails where it turns
            by more than this [deg]; None where only one past recovery has failed.
    """

    displacement_m: float = DISPLACEMENT_M
    rotation_deg: float | None = None

    def __post_init__(self) -> None:
        positive(self.displacement_m, "displacement", "m")
        if self.rotation_deg is not None:
            positive(self.rotation_deg, "rotation", "degrees")

    def code(self, mode_code: int, end: RunEnd) -> int:
        """Return the code in :data:`OUTCOMES` of a simulated block."""
        if end.outcome is Outcome.TOPPLED:
            return FAILS
        peak = limit = None
        if mode_code == modes.SLIDE:
            peak, limit = end.peak_displacement_m, self.displacement_m
        elif mode_code in (modes.SLUMP, modes.CONFINED_TOPPLE) and self.rotation_deg is not None:
            peak, limit = end.peak_rad, math.radians(self.rotation_deg)
        if peak is not None and limit is not None:
            # What has happened before a model ends has happened.
            if peak - end.error > limit:
                return FAILS
            if peak + end.error > limit:
                return UNDETERMINED
        if end.outcome is Outcome.STABLE:
            return STAYS if end.moved else AT_REST
        return OUTCOMES.index(end.outcome.value)


@dataclass(frozen=True, eq=False)
class ScaledMotion:
    """One recorded motion at several scales.

    Args:
        scales: factors on it, and on the vertical one, rising.
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` (positive samples drive out of the slope) or ``reverse``.
    """

    motion: GroundMotion
    scales: tuple[float, ...]
    vertical: GroundMotion | None = None
    polarity: Polarity = "forward"

    def excitations(self) -> list[Excitation]:
        """Return the excitation at each scale."""
        unscaled = excitation(self.motion, self.vertical, self.polarity)
        return [unscaled.scaled(scale) for scale in self.scales]


@dataclass(frozen=True, eq=False)
class BlocksToRun:
    """Stable blocks of a rock mass and the scales at which they move; shapes (k,) and (m, k).

    Args:
        place: places of the blocks among the realisations.
        numbers: ``s1_m`` and ``s2_m`` [m], ``gamma_deg``, ``beta_deg``, ``phi_deg`` and
            ``phi_back_deg``, as :class:`Realisations` has them, and what its `joint` has.
        back_fracture: whether there is a plane behind them.
    """

    place: NDArray[np.intp]
    mode_code: NDArray[np.int8]
    numbers: Mapping[str, FloatArray]
    back_fracture: bool
    moves: NDArray[np.bool_]
    shaking: ScaledMotion
    limits: FailureLimits


@dataclass(frozen=True, eq=False)
class BlockOutcomes:
    """Outcomes of simulated blocks, shapes (m, k).

    Args:
        place: as in :class:`BlocksToRun`.
        code: places in :data:`OUTCOMES`; ``at_rest`` where a block was not run.
        displacement_m: greatest displacement along the base; NaN where there is none to tell.
        rotation_rad: greatest rotation; NaN likewise.
        final_code: places in :data:`MODES` of the last motion that is one of a mode; -1 for none.
        about: sentences on what a model takes for granted at any scale, and how many of the blocks
            each is about, by mode code and sentence.
    """

    place: NDArray[np.intp]
    code: NDArray[np.int8]
    displacement_m: FloatArray
    rotation_rad: FloatArray
    final_code: NDArray[np.int8]
    about: Mapping[tuple[int, str], int]
    runs: int


def run_blocks(work: BlocksToRun) -> BlockOutcomes:
    """Simulate blocks, each at the scales at which it moves."""
    excitations = work.shaking.excitations()
    code = np.full(work.moves.shape, AT_REST, dtype=np.int8)
    zeros = np.zeros(code.shape)
    displacement_m = np.where(work.mode_code == modes.TOPPLE, np.nan, zeros)
    rotation_rad = np.where(work.mode_code == modes.SLIDE, np.nan, zeros)
    final_code = np.full(code.shape, NO_MODE, dtype=np.int8)
    about: Counter[tuple[int, str]] = Counter()
    for j in range(work.place.size):
        mode_code = int(work.mode_code[j])
        try:
            run = _runner(work, j)
            outcomes = [
                (i, run(scaled_motion))
                for i, scaled_motion in enumerate(excitations)
                if work.moves[i, j]
            ]
        except InputError as error:
            raise InputError(f"block {int(work.place[j]) + 1}: {error}") from None
        for i, end in outcomes:
            code[i, j] = work.limits.code(mode_code, end)
            displacement_m[i, j] = _or_nan(end.peak_displacement_m)
            rotation_rad[i, j] = _or_nan(end.peak_rad)
            if end.final_mode is not None:
                final_code[i, j] = modes.MODES.index(end.final_mode)
        sentences = {text for _, end in outcomes for text in end.about_block}
        about.update((mode_code, text) for text in sentences)
    return BlockOutcomes(
        place=work.place,
        code=code,
        displacement_m=displacement_m,
        rotation_rad=rotation_rad,
        final_code=final_code,
        about=about,
        runs=int(np.count_nonzero(work.moves)),
    )


def _runner(work: BlocksToRun, j: int) -> Runner:
    """Return the runner of the model for the block's mode."""
    inputs: dict[str, Any] = {name: float(values[j]) for name, values in work.numbers.items()}
    block = Block.from_fractures(inputs.pop("s1_m"), inputs.pop("s2_m"), inputs.pop("gamma_deg"))
    finding, planes, _ = assess_stability(block, back_fracture=work.back_fracture, **inputs)
    supported_block = SupportedBlock(
        block=block,
        beta_rad=math.radians(finding.beta_deg),
        phi_rad=math.radians(finding.phi_deg),
        phi_back_rad=math.radians(finding.phi_back_deg),
        back_fracture=work.back_fracture,
        cohesive=bool(planes.bond),
        yield_g=finding.k,
        push=push_of(block, planes) or modes.DRY,
    )
    return model_of_mode(modes.MODES[work.mode_code[j]]).runner(supported_block)


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


_NUMBERS = ("s1_m", "s2_m", "gamma_deg", "beta_deg", "phi_deg", "phi_back_deg")

CHUNK = 250
"""Blocks handed out at a time: a second or less of work."""

MOST_OUTCOMES = 50_000_000
"""Realisations times scales that are kept in memory at most."""


@dataclass(frozen=True, eq=False)
class ShakingPlan:
    """Outcomes known without simulation, and the blocks to simulate.

    Args:
        shaking: the motion and its scales.
        code: places in :data:`OUTCOMES`, -1 for no block, shape (scales, n); ``at_rest`` where a
            block is still to be run.
        moves: which block moves, and is to be run, at which scale, shape (scales, n).
        pga_g: PGA at each scale [g].
        warnings: sentences about the motion.
    """

    realisations: Realisations
    shaking: ScaledMotion
    limits: FailureLimits
    code: NDArray[np.int8]
    moves: NDArray[np.bool_]
    pga_g: FloatArray
    warnings: tuple[str, ...]

    @property
    def indices(self) -> NDArray[np.intp]:
        """Indices of the blocks to simulate at any scale."""
        return np.flatnonzero(self.moves.any(axis=0))

    def work(self, chunk: int = CHUNK) -> Iterator[BlocksToRun]:
        """Yield the blocks to simulate, in chunks."""
        realisations, indices = self.realisations.in_time, self.indices
        for start in range(0, indices.size, chunk):
            at = indices[start : start + chunk]
            numbers = {name: getattr(realisations, name) for name in _NUMBERS}
            numbers |= realisations.joint
            yield BlocksToRun(
                place=at,
                mode_code=realisations.stability.mode_code[at],
                numbers={name: values[at] for name, values in numbers.items()},
                back_fracture=realisations.rock_mass.back_fracture,
                moves=self.moves[:, at],
                shaking=self.shaking,
                limits=self.limits,
            )

    def gathered(self, answers: Iterable[BlockOutcomes]) -> ShakenMass:
        """Return the outcomes of all blocks; the order of the answers does not matter.

        Args:
            answers: to all of :meth:`work`.
        """
        code = self.code.copy()
        at_rest = (self.code == AT_REST) | (self.code == LOCKED)
        mode_code = self.realisations.in_time.stability.mode_code
        displacement_m = np.where(at_rest & (mode_code != modes.TOPPLE), 0.0, np.nan)
        rotation_rad = np.where(at_rest & (mode_code != modes.SLIDE), 0.0, np.nan)
        final_code = np.full(code.shape, NO_MODE, dtype=np.int8)
        about: Counter[tuple[int, str]] = Counter()
        runs = 0
        for answer in answers:
            code[:, answer.place] = np.where(
                self.moves[:, answer.place], answer.code, code[:, answer.place]
            )
            displacement_m[:, answer.place] = answer.displacement_m
            rotation_rad[:, answer.place] = answer.rotation_rad
            final_code[:, answer.place] = answer.final_code
            runs += answer.runs
            about.update(answer.about)
        return ShakenMass(
            **{**vars(self), "code": code},
            displacement_m=displacement_m,
            rotation_rad=rotation_rad,
            final_code=final_code,
            runs=runs,
            about={
                (modes.MODES[mode], text): count for (mode, text), count in sorted(about.items())
            },
        )


@dataclass(frozen=True, eq=False)
class ShakenMass(ShakingPlan):
    """Outcomes of the realisations of a rock mass; arrays have shape (scales, n).

    Args:
        displacement_m: greatest displacement along the base, of the block or, where it turns, of
            its contact on the base; NaN where there is none to tell, as of a topple whose toe
            holds.
        rotation_rad: greatest rotation; NaN for sliding, and where there is none to tell.
        final_code: place in :data:`MODES` of the last motion that is one of a mode; -1 for none.
        about: how many blocks of a mode a sentence is about.
    """

    displacement_m: FloatArray
    rotation_rad: FloatArray
    final_code: NDArray[np.int8]
    runs: int
    about: Mapping[tuple[modes.ModeName, str], int]


class ShakingOptions(TypedDict, total=False):
    """Options of :func:`plan_shaking`: how a motion acts on a rock mass."""

    scales: Sequence[float]
    vertical: GroundMotion | None
    polarity: Polarity
    limits: FailureLimits | None


def plan_shaking(
    realisations: Realisations,
    motion: GroundMotion,
    *,
    scales: Sequence[float] = (1.0,),
    vertical: GroundMotion | None = None,
    polarity: Polarity = "forward",
    limits: FailureLimits | None = None,
) -> ShakingPlan:
    """Find the blocks that a motion moves, which have to be simulated.

    A block stays at rest where k_h never exceeds (1 + k_v) times its yield; that is seen at the
    samples, because k_h/(1 + k_v) is monotone between them.

    Args:
        scales: factors on the motion; each is taken once, in rising order.
        vertical: vertical motion of the same recording, upward positive; scaled likewise.
        limits: what counts as failure; None for the usual.

    Raises:
        InputError: a scale that is not above zero, none at all or too many for the realisations,
            components that do not go together, or a rock mass that states a vertical acceleration.
    """
    realisations.reject_vertical()
    wrong = [scale for scale in scales if not (math.isfinite(scale) and scale > 0.0)]
    if wrong or not len(scales):
        complaint = f"scale {wrong[0]:g}" if wrong else "no scale"
        raise InputError(f"{complaint}: give factors on the motion above 0, such as 0.5,1,2")
    shaking = ScaledMotion(motion, tuple(sorted(set(map(float, scales)))), vertical, polarity)
    if realisations.n * len(shaking.scales) > MOST_OUTCOMES:
        raise InputError(
            f"{realisations.n} realisations at {len(shaking.scales)} scales are more than "
            f"{MOST_OUTCOMES} blocks: reduce either number"
        )
    stability = realisations.stability
    k = stability.yield_acceleration
    is_block, state = realisations.is_block, stability.state_code
    stable = is_block & (state == modes.STABLE) & (k > 0.0) & np.isfinite(k)
    locked = is_block & (state == modes.LOCKED)
    after = realisations.in_time
    residual_yield = after.stability.yield_acceleration
    excitations = shaking.excitations()
    code = np.full((len(excitations), realisations.n), AT_REST, dtype=np.int8)
    moves = np.zeros(code.shape, dtype=np.bool_)
    for i, scaled_motion in enumerate(excitations):
        moves[i] = stable & (k < scaled_motion.max_q)
        code[i, is_block & ~stable] = UNSTABLE
        code[i, locked] = LOCKED
        if scaled_motion.jump_node < scaled_motion.w.size:
            code[i, (stable & ~moves[i]) | locked] = OUTCOMES.index("jump")
        breaks = moves[i] & after.ends_with_slip
        code[i, breaks] = BOND_BREAKS
        # on what friction is left it does not stand
        code[i, moves[i] & (residual_yield <= 0.0)] = FAILS
        moves[i] &= ~breaks & (residual_yield > 0.0) & np.isfinite(residual_yield)
        code[i, ~is_block] = NO_BLOCK
    warnings = motion_remarks(motion, vertical, excitations[0])
    if count := int(np.count_nonzero((code == BOND_BREAKS).any(axis=0))):
        text = (
            f"{count} blocks with cohesion or roughness are driven beyond their yield: the first "
            "slip ends it, and no model describes the motion after it (outcome bond_breaks); with "
            "friction.phi_residual_deg, the residual friction, they are run as they are after it"
        )
        warnings = (*warnings, Diagnostic(text, "bond_breaks"))
    return ShakingPlan(
        realisations=realisations,
        shaking=shaking,
        limits=FailureLimits() if limits is None else limits,
        code=code,
        moves=moves,
        pga_g=np.array([scaled_motion.pga_g for scaled_motion in excitations]),
        warnings=warnings,
    )
