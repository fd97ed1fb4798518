"""Response of a block to a ground motion, for every kind of failure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import MotionLike, as_motion
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.kind import Kind, Shaking, SupportedBlock
from rbfrag.solver.kinds import KINDS, NOT_BACKED, stands_free_of
from rbfrag.solver.models import model_of_kind, model_of_mode
from rbfrag.solver.quantity import angle, positive
from rbfrag.solver.results import BlockState, Polarity, Response
from rbfrag.solver.sequence import STARTS_ANEW, Motions, respond_in_sequence
from rbfrag.solver.stability.joint import IS_DRAINED, STAYS_UNDRAINED
from rbfrag.solver.stability.modes import ModeName, words_of_mode
from rbfrag.solver.stability.residual_strength import JOINT, after_first_slip, reject_before_slip
from rbfrag.solver.stability.single import Stability, require_stable, stability


def respond(
    motion: MotionLike | Sequence[MotionLike],
    *,
    p2: float | None = None,
    kr: float | None = None,
    ky: float | None = None,
    block: Block | None = None,
    beta_deg: float | None = None,
    phi_deg: float | None = None,
    phi_back_deg: float | None = None,
    back_fracture: bool = True,
    cohesion_pa: float = 0.0,
    density_kg_m3: float | None = None,
    vertical: MotionLike | Sequence[MotionLike | None] | None = None,
    polarity: Polarity = "forward",
    kind: str | None = None,
    gap_s: float | None = None,
    start: BlockState | None = None,
    two_way: bool = False,
    horizontal: bool = False,
    restitution: float | None = None,
    history: bool = False,
    **of_kind: Any,
) -> Response:
    """Return the response of a block to a ground motion, or to several in sequence.

    The block is given in one of three ways: `p2` and `kr` (it topples, or rocks on level ground if
    `kind` says so), `ky` (it slides), or `block` with `beta_deg` and `phi_deg`, whose failure mode
    chooses the model. It has more than ten parameters, because scripts name each quantity that a
    user states; a kind rejects those of another.

    Args:
        motion: horizontal ground motion, or its file; or a list of them: of slides and slumps each
            finds the block where the one before has left it.
        p2: frequency parameter p² of a toppling or rocking block [1/s²], > 0.
        kr: its rocking acceleration coefficient k_r = tan(critical angle), > 0.
        ky: yield acceleration coefficient tan(φ - β) of a block that slides, whatever its
            shape, on a plane that dips by `beta_deg` (default 0), > 0.
        block: shape and size.
        beta_deg: dip of the base, out of the slope positive [deg].
        phi_deg: friction angle of the base [deg]; None where `kind` is ``rocking`` and the base
            is assumed not to slip.
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        back_fracture: False for a block without a plane behind it: one that topples rocks about
            both corners.
        cohesion_pa: cohesion of the base [Pa]; only a block that topples may have any.
        density_kg_m3: density of the rock [kg/m³]; None for 2,650 with a cohesion or water.
        vertical: vertical motion of the same recording, upward positive; of a list of motions, a
            list of as many, None where there is none.
        polarity: ``forward`` (positive samples drive forward motion) or ``reverse``.
        kind: ``toppling``, ``rocking``, ``sliding``, ``slumping`` or ``confined_toppling``; None
            for the model of the failure mode.
        gap_s: of a list of motions, rest between the end of one and the beginning of the next [s];
            None for as long as the block takes to come to rest.
        start: the state of the block before the motion, as an earlier answer has it; None for its
            first place.
        two_way: sliding up the base too, where the ground drives the block that way.
        horizontal: sliding without the factor cos(φ - β)/cos φ, as Newmark's horizontal block.
        restitution: coefficient of restitution of rocking, above 0 and up to 1; None for that of
            conservation of angular momentum at each corner.
        history: keep the motion in time.
        of_kind: further settings of a kind, as its line in `rbfrag.solver.kinds` names them; of a
            shape also ``water_m`` with ``drainage`` (``undrained``, the default: the water
            pressure keeps acting while the block moves; ``drained``: it vanishes), ``jrc``,
            ``jcs_mpa``, ``joint_length_m``, which end with the first slip, and
            ``phi_residual_deg``, on which it is then run.

    Raises:
        TypeError: a keyword that no kind knows.
        InputError: a value outside its range, a block given in no way or in two, a block that
            fails at rest or that nothing moves, an unknown kind or polarity, an option of
            another model, components that cannot be brought together, a start of a block that
            carries none.
    """
    accepted = {name for facts in KINDS.values() for name in facts.settings}
    joint = {name: of_kind.pop(name) for name in JOINT if name in of_kind}
    for name in of_kind:
        if name not in accepted:
            raise TypeError(f"respond() got an unexpected keyword argument {name!r}")
    settings = {
        "two_way": two_way or None,
        "horizontal": horizontal or None,
        "restitution": restitution,
        **of_kind,
    }
    shaken = _Shaken(motion, vertical, polarity, history, gap_s, start)
    answer = shaken.answer
    free_standing = kind is not None and model_of_kind(kind).free_standing
    conditions = {
        "beta_deg": beta_deg,
        "phi_deg": phi_deg,
        "phi_back_deg": phi_back_deg,
        "density_kg_m3": density_kg_m3,
        **joint,
    }
    if block is not None:
        for name, value in (("p2", p2), ("kr", kr), ("ky", ky)):
            if value is not None:
                raise InputError(
                    f"{name} cannot be combined with the geometry of a block", fields=(name,)
                )
        if beta_deg is None or (phi_deg is None and not free_standing):
            name = "beta_deg" if beta_deg is None else "phi_deg"
            raise InputError(
                f"{name} is missing: the mode of a block depends on dip and friction",
                fields=(name,),
            )
        rough_deg = 0.5 * (90.0 + max(block.alpha1_deg, block.alpha3_deg, 0.0))  # it does not slip
        planes: dict[str, Any] = {
            **conditions,
            "phi_deg": rough_deg if phi_deg is None else phi_deg,
            "back_fracture": back_fracture and not free_standing,
            "cohesion_pa": cohesion_pa,
        }
        planes, after = after_first_slip(block, planes)
        reject_before_slip(block, planes, kind)
        judged = stability(block, **planes)
        if kind is None:
            model = model_of_mode(judged.mode, back_fracture=back_fracture)
        else:
            model = model_of_kind(kind)
        supported_block = _site(block, judged, model, _model_settings(model, settings))
        if phi_deg is None:
            supported_block = replace(supported_block, phi_rad=0.5 * math.pi)
        remarks = (*after, *_remarks(judged, model))
        if judged.drained is not None:
            remarks = (*remarks, IS_DRAINED if judged.push is None else STAYS_UNDRAINED)
        return replace(answer(model, supported_block, remarks, judged.mode), drained=judged.drained)
    numbers = {"p2": p2, "kr": kr, "ky": ky, **conditions}
    model, supported_block = known_by_numbers(kind, numbers, settings)
    return answer(model, supported_block)


def known_by_numbers(
    kind: str | None, numbers: Mapping[str, float | None], settings: Mapping[str, Any]
) -> tuple[Kind, SupportedBlock]:
    """Return a block defined by p2 and kr or by ky, and its model.

    Args:
        kind: the model; None for that of the mode which the numbers mean.
        numbers: ``p2`` and ``kr``, or ``ky`` and perhaps ``beta_deg``; None for what is not given.
        settings: options of one model or another; None for what is not given.

    Raises:
        InputError: a block given in no way or in two, or an option of another model.
    """
    inputs = {name: value for name, value in numbers.items() if value is not None}
    if "ky" in inputs:
        if "p2" in inputs or "kr" in inputs:
            raise InputError(
                "ky is for sliding, p2 and kr for toppling: give one or the other",
                fields=("ky", "p2", "kr"),
            )
        if extra := [name for name in inputs if name not in ("ky", "beta_deg")]:
            raise InputError(
                f"{extra[0]} cannot be combined with ky: it follows from ky and beta_deg",
                fields=(extra[0], "ky", "beta_deg"),
            )
        model = _by_numbers(kind, "slide", ("ky",))
        beta_deg = inputs.get("beta_deg", 0.0)
        return model, _sliding_site(inputs["ky"], beta_deg, _model_settings(model, settings))
    for name in ("p2", "kr"):
        if name not in inputs:
            raise InputError(
                f"{name} is missing: give p2 and kr, or ky, or the geometry of a block with "
                "beta_deg and phi_deg",
                fields=("p2", "kr", "ky", "beta_deg", "phi_deg"),
            )
    if extra := [name for name in inputs if name not in ("p2", "kr")]:
        raise InputError(
            f"{extra[0]} cannot be combined with p2 and kr, which describe the block completely",
            fields=(extra[0], "p2", "kr"),
        )
    model = _by_numbers(kind, "topple", ("p2", "kr"))
    return model, block_of_numbers(inputs["p2"], inputs["kr"], _model_settings(model, settings))


@dataclass(frozen=True, eq=False)
class _Shaken:
    """Motions and options of a call of :func:`respond`."""

    motion: MotionLike | Sequence[MotionLike]
    vertical: MotionLike | Sequence[MotionLike | None] | None
    polarity: Polarity
    history: bool
    gap_s: float | None
    start: BlockState | None

    def answer(
        self, model: Kind, supported_block: SupportedBlock, remarks: tuple[str, ...] = (),
        mode: ModeName | None = None,
    ) -> Response:  # fmt: skip
        """Return the response of a block by a model, for a failure mode; None for the model's."""
        if self.start is not None and not model.carries_state:
            raise InputError(f"start cannot be combined with {model.kind}: {STARTS_ANEW}")

        def run(
            motion: GroundMotion, vertical: GroundMotion | None, start: BlockState | None
        ) -> Response:
            shaking = Shaking(motion, vertical, self.polarity, self.history, remarks, start)
            answer = replace(model.respond(supported_block, shaking), mode=mode or model.mode)
            if answer.started_s is None or answer.final_mode is not None:
                return answer
            return replace(answer, final_mode=model.mode)

        if not isinstance(self.motion, list | tuple):
            if self.gap_s is not None:
                raise InputError("gap_s requires a list of motions: it is the time between them")
            if isinstance(self.vertical, list | tuple):
                raise InputError("vertical is a list: give one vertical motion for one motion")
            return run(
                as_motion(cast("MotionLike", self.motion)), _vertical(self.vertical), self.start
            )
        if not (self.vertical is None or isinstance(self.vertical, list | tuple)):
            raise InputError("vertical is one motion: give a list for a list of motions")
        motions = Motions(
            [as_motion(item) for item in self.motion],
            [_vertical(item) for item in self.vertical or ()],
            self.gap_s,
        )
        return respond_in_sequence(
            run, motions, carries_state=model.carries_state, start=self.start
        )


def _vertical(vertical: Any) -> GroundMotion | None:
    return None if vertical is None else as_motion(vertical, "vertical")


def block_of_numbers(p2: float, kr: float, settings: Mapping[str, Any]) -> SupportedBlock:
    """Return a block defined by its frequency parameter [1/s²] and yield acceleration [g]."""
    rough_rad = 0.5 * math.pi
    return SupportedBlock(None, 0.0, rough_rad, rough_rad, kr, settings=settings, p2=p2)


def _site(
    block: Block, judged: Stability, model: Kind, settings: Mapping[str, Any]
) -> SupportedBlock:
    """Return the supported block in the form that its model uses."""
    if not model.free_standing:
        require_stable(judged)
    return SupportedBlock.of(block, judged, model.mode, settings)


def _remarks(judged: Stability, model: Kind) -> tuple[str, ...]:
    """Return the warnings about the block for the answer of a model."""
    if model.mode == judged.mode:
        unbacked = stands_free_of(model, judged.back_fracture)
        note = Diagnostic(NOT_BACKED, "free_standing")
        return (*judged.warnings, note) if unbacked else judged.warnings
    return (
        *judged.warnings,
        Diagnostic(
            f"the mode of the block is {words_of_mode(judged.mode)}: it does not fail by "
            f"{model.kind.replace('_', ' ')}",
            "other_mode",
        ),
    )


def _sliding_site(ky: float, beta_deg: float, settings: dict[str, Any]) -> SupportedBlock:
    """Return a plane defined by its yield acceleration alone."""
    ky = positive(ky, "ky", "the yield acceleration coefficient of sliding, in g")
    beta_deg = angle(beta_deg, "beta_deg", -90.0, 90.0)
    phi_rad = math.radians(beta_deg) + math.atan(ky)
    if not 0.0 <= phi_rad < 0.5 * math.pi:
        raise InputError(
            f"ky = {ky:g} and beta_deg = {beta_deg:g} give a friction angle of "
            f"{math.degrees(phi_rad):.4g} degrees: it must be from 0 to below 90"
        )
    beta_rad = math.radians(beta_deg)
    return SupportedBlock(
        None, beta_rad, phi_rad, phi_rad, ky, back_fracture=False, settings=settings
    )


def _by_numbers(kind: str | None, mode: ModeName, numbers: tuple[str, ...]) -> Kind:
    """Return the model for which numbers suffice, unless another one was requested."""
    if kind is None:
        return model_of_mode(mode)
    model = model_of_kind(kind)
    if not set(numbers) <= {*model.parameters}:
        raise InputError(
            f"{kind} requires the geometry of the block: give a block with beta_deg and phi_deg "
            f"instead of {' and '.join(numbers)}, which are for {model_of_mode(mode).kind}",
            fields=(*numbers, "beta_deg", "phi_deg"),
        )
    return model


def _model_settings(model: Kind, settings: Mapping[str, Any]) -> dict[str, Any]:
    inputs = {name: value for name, value in settings.items() if value is not None}
    unknown = sorted(set(inputs) - set(model.settings))
    if unknown:
        supported = " and ".join(model.settings)
        remedy = f"its options are {supported}" if supported else "omit it"
        raise InputError(
            f"{unknown[0]} cannot be combined with kind {model.kind}: {remedy}",
            fields=(unknown[0],),
        )
    return inputs
