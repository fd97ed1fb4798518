"""What a response model is: a kind, the failure mode it belongs to, and how it answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.integrator.one_freedom.equation import Mechanism
from rbfrag.solver.results import Polarity, Response
from rbfrag.solver.stability.modes import ModeName

if TYPE_CHECKING:
    from rbfrag.solver.run_end import Runner


@dataclass(frozen=True)
class BlockOnPlanes:
    """A block, its planes and the settings of its motion, as a model sees them.

    Args:
        block: its shape and size; None for a sliding block, which needs neither.
        beta_rad: dip of the base, out of the slope positive [rad].
        phi_rad: friction angle of the base [rad].
        phi_back_rad: friction angle of the back plane [rad].
        back_fracture: whether there is a back plane.
        cohesive: whether the base has cohesion.
        yield_g: yield acceleration of the model's mode where 1 + k_v = 1 [g]; None if the
            block's mode is another one.
        settings: options of one model or another, by name.
    """

    block: Block | None
    beta_rad: float
    phi_rad: float
    phi_back_rad: float
    back_fracture: bool
    cohesive: bool
    yield_g: float | None
    settings: Mapping[str, Any]

    @property
    def centroid_m(self) -> tuple[float, float]:
        """Centroid in the base frame with the heel as origin [m]; the origin without a block."""
        return (0.0, 0.0) if self.block is None else self.block.centroid


@dataclass(frozen=True, eq=False)
class Shaking:
    """What a model is asked: which motion, and what to keep.

    Args:
        motion: horizontal ground motion.
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` or ``reverse``.
        history: keep the motion in time.
        remarks: what is known about the block that the answer should say.
    """

    motion: GroundMotion
    vertical: GroundMotion | None
    polarity: Polarity
    history: bool
    remarks: tuple[str, ...] = ()


class ResponseModel(Protocol):
    """What the search for models expects to find as ``MODEL`` in a file."""

    @property
    def kind(self) -> str:
        """Name of the model."""

    @property
    def mode(self) -> ModeName:
        """Failure mode of the blocks that it describes."""

    @property
    def settings(self) -> tuple[str, ...]:
        """Names of the options that it understands."""

    def respond(self, site: BlockOnPlanes, shaking: Shaking) -> Response:
        """Return what the block does."""

    def runner(self, site: BlockOnPlanes) -> Runner:
        """Return a function that says what becomes of the block under an excitation."""


@dataclass(frozen=True)
class MechanismModel:
    """A model that states a mechanism; the engine for one degree of freedom runs it.

    Args:
        kind: name of the model.
        mode: failure mode of the blocks that it describes.
        mechanism: makes the mechanism of a block.
        settings: names of the options that it understands.
    """

    kind: str
    mode: ModeName
    mechanism: Callable[[BlockOnPlanes], Mechanism]
    settings: tuple[str, ...] = ()

    def respond(self, site: BlockOnPlanes, shaking: Shaking) -> Response:
        """Return what the block does.

        Raises:
            InputError: the base has cohesion.
        """
        from rbfrag.solver.mechanism_response import mechanism_response

        return mechanism_response(self.kind, self._made(site), shaking)

    def runner(self, site: BlockOnPlanes) -> Runner:
        """Return a function that says what becomes of the block under an excitation.

        Raises:
            InputError: the base has cohesion.
        """
        from rbfrag.solver.run_end import mechanism_runner

        return mechanism_runner(self._made(site))

    def _made(self, site: BlockOnPlanes) -> Mechanism:
        if site.cohesive:
            raise InputError(
                f"cohesion_pa does not go with {self.kind} in time: a bond is broken by the first "
                "slip, which the model does not describe; its effect on the yield is told by  "
                "rbfrag block --cohesion"
            )
        return self.mechanism(site)
