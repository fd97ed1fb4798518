"""`rbfrag critical --kind …`: the weakest shaking of a block that slumps, or the strength that
slides a stated distance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rbfrag.cli.output import print_json, print_pairs, print_table, print_warnings
from rbfrag.errors import InputError

if TYPE_CHECKING:
    from rbfrag.motions.ground_motion import GroundMotion

SCALED_STATUS = {
    "found": "a record of this factor brings the block down; one of the lower end does not",
    "below_limit": "no factor up to scale_limit brings the block down, as far as it was looked at",
    "no_motion": "no factor up to scale_limit moves the block",
}

SLIDING_STATUS = {
    "found": "blocks with k_y/PGA below this slide further than displacement_m on a level plane",
    "below_limit": "no block down to the search limit slides that far",
    "no_motion": "no block down to the search limit slides",
    "outside_model": "the vertical motion throws blocks off their base",
}


def scaled(
    ground: GroundMotion,
    upward: GroundMotion | None,
    remarks: list[str],
    *,
    kind: str,
    block: str | None,
    rotation: float | None,
    reverse: bool,
    json: bool,
) -> None:
    """Print the smallest factor on a record that brings a block down."""
    from rbfrag.solver.block.file import read_block
    from rbfrag.solver.search.scale import critical_scale
    from rbfrag.solver.search.scale_report import scaled_as_dict

    if block is None:
        raise InputError(
            f"--block is missing: shape, friction and dip of a block decide about {kind}; give a "
            "block file with beta_deg and phi_deg"
        )
    file = read_block(block)
    conditions: dict[str, Any] = dict(file.conditions)
    for name in ("beta_deg", "phi_deg"):
        if name not in conditions:
            raise InputError(f"{block}: {name} is missing: the mode of a block depends on it")
    for name, nothing in (("kv", 0.0), ("cohesion_pa", 0.0), ("back_fracture", True)):
        if conditions.pop(name, nothing) != nothing:
            raise InputError(f"{block}: {name} does not go with {kind} in time: leave it out")
    conditions.pop("density_kg_m3", None)
    try:
        result = critical_scale(
            ground,
            file.block,
            kind=kind,
            rotation_deg=rotation,
            vertical=upward,
            polarity="reverse" if reverse else "forward",
            **conditions,
        )
    except InputError as error:
        raise InputError(f"{block}: {error}") from None
    _print(scaled_as_dict(result), remarks, SCALED_STATUS, json=json)


def sliding(
    ground: GroundMotion,
    upward: GroundMotion | None,
    remarks: list[str],
    *,
    displacements_m: list[float],
    reverse: bool,
    json: bool,
) -> None:
    """Print the strengths that slide stated distances, and how far blocks of any strength slide."""
    from rbfrag.solver.search.displacement import (
        KY_OVER_PGA,
        THRESHOLDS_M,
        critical_sliding,
        sliding_displacements,
    )
    from rbfrag.solver.search.scale_report import sliding_as_dict

    polarity = "reverse" if reverse else "forward"
    asked = displacements_m or list(THRESHOLDS_M)
    found = [
        sliding_as_dict(
            critical_sliding(ground, displacement_m=d, vertical=upward, polarity=polarity)  # type: ignore[arg-type]
        )
        for d in asked
    ]
    curve = sliding_displacements(ground, vertical=upward, polarity=polarity)  # type: ignore[arg-type]
    warnings = [*remarks, *found[0]["warnings"]]
    rows = [
        {"ky_over_pga": k, "displacement_m": None if d != d else d}
        for k, d in zip(KY_OVER_PGA, curve.tolist(), strict=True)
    ]
    if json:
        document = {**found[0], "warnings": warnings, "thresholds": found, "displacements": rows}
        print_json(document)
        return
    names = ("displacement_m", "ky_over_pga", "ky", "lower", "upper", "status", "n_runs")
    print_pairs({name: found[0][name] for name in ("kind", "polarity", "pga_g")})
    print_table(names, [[each[name] for name in names] for each in found])
    for status in dict.fromkeys(each["status"] for each in found):
        print(f"{status}: {SLIDING_STATUS[status]}")
    print("\non a base that dips, times cos(phi - beta)/cos(phi):")
    print_table(tuple(rows[0]), [list(row.values()) for row in rows])
    print_warnings(warnings)


def _print(
    answer: dict[str, Any], remarks: list[str], status: dict[str, str], *, json: bool
) -> None:
    answer["warnings"] = [*remarks, *answer["warnings"]]
    if json:
        print_json(answer)
        return
    warnings = answer.pop("warnings")
    print_pairs(answer)
    print(f"{answer['status']}: {status[answer['status']]}")
    print_warnings(warnings)
