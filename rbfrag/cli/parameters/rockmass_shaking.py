"""`rbfrag rockmass --motion …`: the shares of the blocks that a recorded motion brings down."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rbfrag.cli.output import print_table
from rbfrag.cli.parameters.motion import find_motion, find_vertical
from rbfrag.cli.parameters.number_list import number_list
from rbfrag.cli.progress_line import ProgressLine

if TYPE_CHECKING:
    from rbfrag.rockmasses.joint_sets import Realisations
    from rbfrag.rockmasses.shaking import ShakenMass

ALWAYS = ("at_rest", "stays", "unstable")
"""Outcomes that have a column of their own even if there are none."""


def run_shaken(
    made: Realisations,
    motion: str,
    *,
    vertical: str | None,
    reverse: bool,
    scales: str | None,
    displacement: float | None,
    rotation: float | None,
    jobs: int | None,
    db: str | None,
    units: str | None,
    dt: float | None,
) -> tuple[ShakenMass, list[str]]:
    """Run the blocks under the motion that the options name.

    Returns:
        Their outcomes, and sentences about the motion and about blocks.
    """
    from rbfrag.campaign.shake_rockmass import shake
    from rbfrag.rockmasses.failures import failure_warnings
    from rbfrag.rockmasses.shaking import DISPLACEMENT_M, FailureLimits

    limits = FailureLimits(DISPLACEMENT_M if displacement is None else displacement, rotation)
    factors = [1.0] if scales is None else number_list(scales, "--scales")
    ground = find_motion(motion, db=db, units=units, dt_s=dt)
    upward, remarks = find_vertical(vertical, ground, db=db, units=units, dt_s=dt)
    with ProgressLine("rockmass", "blocks") as line:
        found = shake(
            made,
            ground,
            scales=factors,
            vertical=upward,
            polarity="reverse" if reverse else "forward",
            limits=limits,
            jobs=jobs,
            on_progress=line.show,
        )
    return found, [*remarks, *failure_warnings(found)]


def print_failures(document: dict[str, Any]) -> None:
    """Print the failures that a motion causes, mode by mode and scale by scale."""
    from rbfrag.rockmasses.shaking import OUTCOMES

    print()
    turned = document["rotation_limit_deg"]
    print(
        f"{document['motion']}, {document['polarity']}: {document['runs']} runs; a slide fails "
        f"beyond {document['displacement_limit_m']:g} m, a block that turns "
        + ("past recovery" if turned is None else f"beyond {turned:g} degrees or past recovery")
    )
    counts = [found for each in document["scales"] for found in each["modes"].values()]
    outcomes = [
        name
        for name in OUTCOMES
        if name != "fails" and (name in ALWAYS or any(found[name] for found in counts))
    ]
    rows = []
    for each in document["scales"]:
        for mode, found in [*each["modes"].items(), ("all", each["all"])]:
            of_all, of_mode = found["fails_of_all"], found["fails_of_mode"]
            rows.append(
                [
                    each["scale"],
                    round(each["pga_g"], 4),
                    mode,
                    found["count"],
                    found["fails"],
                    _percent(of_mode["share"]),
                    _percent(of_all["share"]),
                    _percent(of_all["ci_low"]),
                    _percent(of_all["ci_high"]),
                    *(found[name] for name in outcomes),
                ]
            )
    headers = ["scale", "pga_g", "mode", "count", "fails", "%_of_mode", "%_of_all"]
    print_table([*headers, "ci_low_%", "ci_high_%", *outcomes], rows)


def _percent(share: float) -> float:
    return round(100.0 * share, 2)
