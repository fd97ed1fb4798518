"""Critical value of one accelerogram, for every kind of failure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from rbfrag.errors import InputError
from rbfrag.motions.readers import MotionLike, as_motion
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.kind import Kind
from rbfrag.solver.models import model_of_kind, model_of_mode
from rbfrag.solver.results import SEARCH_LIMIT, Polarity
from rbfrag.solver.stability.single import Stability, require_stable, rough_deg, stability


def critical(
    motion: MotionLike,
    *,
    kind: str | None = None,
    p2: float | None = None,
    block: Block | None = None,
    beta_deg: float | None = None,
    phi_deg: float | None = None,
    phi_back_deg: float | None = None,
    water_m: float | None = None,
    drainage: str | None = None,
    density_kg_m3: float | None = None,
    rotation_deg: float | None = None,
    displacement_m: float | None = None,
    vertical: MotionLike | None = None,
    polarity: Polarity = "forward",
    search_limit: float = SEARCH_LIMIT,
    full_map: bool = False,
    map_depth: float | None = None,
    tolerance: float | None = None,
    scan_ratio: float | None = None,
    bracket: float | None = None,
) -> CriticalResult:
    """Return the strongest block that fails in a ground motion, with its bracket.

    Toppling: the largest k_r/PGA that topples at `p2`. Sliding: the largest k_y/PGA that slides
    further than `displacement_m`. Slumping and confined toppling: the smallest factor on the record
    that brings `block` down, and the k/PGA that it means; nothing is proven of the factors between
    those that were looked at. The options of all kinds stand in one signature, each under its name
    in the contract; a kind rejects those of another.

    Args:
        motion: horizontal ground motion, or its file.
        kind: ``toppling``, ``sliding``, ``slumping`` or ``confined_toppling``; None for the
            model of the block's mode, for toppling with `p2` and sliding with `displacement_m`.
        p2: toppling: frequency parameter p² of the block [1/s²], > 0.
        block: shape and size.
        beta_deg: dip of the base, out of the slope positive [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        water_m: height of the water in the back fracture above the heel [m]. It decides the mode,
            and how slumps and confined topples move; the critical k of a topple or a slide is the
            same for a wet block as for a dry one.
        drainage: ``undrained`` (default) or ``drained``.
        density_kg_m3: density of the rock [kg/m³]; None for 2,650.
        rotation_deg: scaled records: peak rotation that counts as failure [deg]; None for failure
            past recovery.
        displacement_m: sliding: the distance on a level plane [m]; on a base that dips, divide
            yours by cos(φ - β)/cos φ. 0 asks for the strength that first moves.
        vertical: vertical motion of the same recording or its file, upward positive.
        polarity: ``forward`` or ``reverse``.
        search_limit: smallest k/PGA looked at.
        full_map: toppling: map every toppling and safe interval down to the limit, and look for
            islands.
        map_depth: width of k_r/PGA at which the map leaves an interval undecided; None for 1e-4.
        tolerance: sliding: width of the bracket [k_y/PGA]; None for 1e-9.
        scan_ratio: scaled records: ratio of two factors looked at one after the other, above 1;
            None for 1.05.
        bracket: scaled records: width of the bracket over the factor; None for 1e-6.

    Raises:
        InputError: a value outside its range, an option of another kind, a kind without a search,
            a block of another mode or that no earthquake decides about, components that cannot be
            brought together.
    """
    question: dict[str, Any] = {
        "p2": p2,
        "block": block,
        "beta_deg": beta_deg,
        "phi_deg": phi_deg,
        "phi_back_deg": phi_back_deg,
        "water_m": water_m,
        "drainage": drainage,
        "density_kg_m3": density_kg_m3,
        "rotation_deg": rotation_deg,
        "displacement_m": displacement_m,
        "full_map": full_map or None,
        "map_depth": map_depth,
        "tolerance": tolerance,
        "scan_ratio": scan_ratio,
        "bracket": bracket,
    }
    options = {name: value for name, value in question.items() if value is not None}
    model = kind_of(kind, options)
    if model.searchable and "block" in options and "beta_deg" in options:
        judged_at_rest(options)
    ground = as_motion(motion)
    answer = model.critical(
        ground,
        vertical=None if vertical is None else as_motion(vertical, "vertical"),
        polarity=polarity,
        search_limit=search_limit,
        **options,
    )
    return replace(answer, motion=ground.label)


def kind_of(kind: str | None, options: Mapping[str, Any]) -> Kind:
    """Return the model of a search, by name or by its inputs."""
    if kind is not None:
        return model_of_kind(kind)
    if "p2" in options:
        return model_of_mode("topple")
    if "block" not in options:
        if "displacement_m" in options:
            return model_of_mode("slide")
        raise InputError("give p2, or displacement_m, or a block with beta_deg and phi_deg")
    for name in ("beta_deg", "phi_deg"):
        if name not in options:
            raise InputError(f"{name} is missing: the mode of a block depends on dip and friction")
    assessment = judged_at_rest(options)
    return model_of_mode(assessment.mode)


def judged_at_rest(options: Mapping[str, Any]) -> Stability:
    """Return the stability of a block with its dip; reject blocks that fail or are locked at rest.

    Without a friction angle it is one that topples.
    """
    block = options["block"]
    assessment = stability(
        block,
        beta_deg=options["beta_deg"],
        phi_deg=options.get("phi_deg", rough_deg(block)),
        phi_back_deg=options.get("phi_back_deg"),
        water_m=options.get("water_m") or 0.0,
        drainage=options.get("drainage"),
        density_kg_m3=options.get("density_kg_m3"),
    )
    require_stable(assessment)
    return assessment
