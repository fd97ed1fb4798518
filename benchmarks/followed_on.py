"""Blocks followed past the end of their mechanism, beside a free block on springs:

    python -m benchmarks.followed_on --records FOLDER [--write]

Slides that tip back and slump, slumps that lose a contact: the pulses of
tests/physics/test_followed_on.py, and blocks of docs/examples/rockmass.toml under two records. The
springs take all of an impact but 5 % of its speed, or a quarter of it: rigid bodies without rebound
are the limit of neither.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from itertools import cycle
from pathlib import Path
from typing import NamedTuple
from unittest.mock import patch

import numpy as np

from benchmarks.page import RECORDS_VARIABLE, ROOT, markdown, parser, report
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import read_motions
from rbfrag.plots.canvas import BLUE, ROCK, light_grid, new_figure, save_figure
from rbfrag.rockmasses.file import read_rock_mass
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.rockmasses.shaking import DISPLACEMENT_M
from rbfrag.solver import free_motion
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.kind import SupportedBlock
from rbfrag.solver.models import model_of_mode, sliding
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome, Response
from rbfrag.solver.simulation import Simulation, simulate_block
from rbfrag.solver.stability.modes import ModeName
from tests.physics.penalty import Simulated, simulate
from tests.physics.test_against_penalty import DT_S, half_sines
from tests.physics.test_followed_on import LOST, SLIDES, first_rest_rad, first_time

PAGE = ROOT / "docs" / "theory" / "slide-to-slump.md"
FIGURE = ROOT / "docs" / "figures" / "slide-to-slump.svg"
MASS = ROOT / "docs" / "examples" / "rockmass.toml"

RECORDS = ("nga_at2_misc/Rinaldi228.AT2", "nga_at2_misc/RSN77_SFERN_PUL164.AT2")
OF_EACH = 12
"""Blocks of the rock mass of each sort."""

SLIDES_OF_MASS = 500

DAMPINGS = (0.7, 0.1)
"""Parts of critical damping of the springs."""


class Beside(NamedTuple):
    """One block by rbfrag and by springs."""

    name: str
    block: Block
    planes: tuple[float, float, float]
    answer: Response
    springs: tuple[Simulated, ...]


def beside(
    name: str,
    block: Block,
    planes: tuple[float, float, float],
    motion: GroundMotion,
    vertical: GroundMotion | None,
    until_s: float,
) -> Beside:
    beta, phi, back = planes
    answer = respond(
        motion, vertical=vertical, block=block, beta_deg=beta, phi_deg=phi, phi_back_deg=back,
        history=True,
    )  # fmt: skip
    springs = tuple(
        simulate(
            block, beta_deg=beta, phi_deg=phi, phi_back_deg=back, time_s=motion.time_s,
            k_h=motion.acceleration_g, k_v=None if vertical is None else vertical.acceleration_g,
            until_s=until_s, damping=damping,
        )
        for damping in DAMPINGS
    )  # fmt: skip
    return Beside(name, block, planes, answer, springs)


def pulses() -> Iterator[Beside]:
    for name, case in {**SLIDES, **LOST}.items():
        vertical = GroundMotion(half_sines(case.vertical), DT_S) if case.vertical else None
        motion = GroundMotion(half_sines(case.lobes), DT_S)
        yield beside(name, case.block, (case.beta, case.phi, case.back), motion, vertical, 2.4)


def of_the_rock_mass(root: Path, mode: ModeName) -> Iterator[Beside]:
    """The first blocks of a mode that are followed past it, in each record by turns."""
    mass = read_rock_mass(str(MASS)).realise(400, None)
    records = cycle([record for record in RECORDS if (root / record).is_file()])
    count = 0
    for j in np.flatnonzero(mass.of_mode(mode, "stable")):
        block = Block.from_fractures(
            float(mass.s1_m[j]), float(mass.s2_m[j]), float(mass.gamma_deg[j])
        )
        planes = (float(mass.beta_deg[j]), float(mass.phi_deg[j]), float(mass.phi_back_deg[j]))
        record = next(records, None)
        if record is None:
            return
        motion = read_motions(root / record)[0]
        answer = respond(
            motion, block=block, beta_deg=planes[0], phi_deg=planes[1], phi_back_deg=planes[2]
        )
        if not answer.mode_changes:
            continue
        until_s = max(answer.stopped_s or 0.0, 1.0) + 2.0
        yield beside(Path(record).name, block, planes, motion, None, until_s)
        count += 1
        if count == OF_EACH:
            return


def slides_by_law(root: Path) -> list[list[str]]:
    """How many slides of the rock mass fail by 5 cm, by each law of impacts."""
    mass = read_rock_mass(str(MASS)).realise(3000, None)
    slides = np.flatnonzero(mass.of_mode("slide", "stable"))[:SLIDES_OF_MASS]
    rows = []
    for record in RECORDS:
        if not (root / record).is_file():
            continue
        excited = excitation(read_motions(root / record)[0])
        failed, lost = [], 0
        for law in (free_motion.RIGID, *free_motion.OTHER_LAWS):
            with patch.object(free_motion, "RIGID", law):
                runs = [_slide(mass, j, excited) for j in slides]
            lost = sum(run.free_motion is not None for run in runs)
            failed.append(
                sum(
                    run.outcome is Outcome.TOPPLED or run.peak_displacement_m > DISPLACEMENT_M
                    for run in runs
                )
            )
        rows.append([Path(record).name, *map(str, (slides.size, lost, *failed))])
    return rows


def _slide(mass: Realisations, j: int, excited: Excitation) -> Simulation:
    site = SupportedBlock(
        block=Block.from_fractures(
            float(mass.s1_m[j]), float(mass.s2_m[j]), float(mass.gamma_deg[j])
        ),
        beta_rad=math.radians(mass.beta_deg[j]),
        phi_rad=math.radians(mass.phi_deg[j]),
        phi_back_rad=math.radians(mass.phi_back_deg[j]),
        back_fracture=True,
        cohesive=False,
        yield_g=None,
        settings={},
    )
    return simulate_block(sliding.MODEL.mechanism(site), site, excited)


HEADERS = [
    "motion", "α1, α3, β, φ1, φ2 [deg]", "displacement [m]", "springs, damping 0.7",
    "springs, 0.1", "difference", "tips back [s]", "springs", "leans [s]", "springs",
]  # fmt: skip


def row(case: Beside) -> list[str]:
    angles = (case.block.alpha1_deg, case.block.alpha3_deg, *case.planes)
    ours = case.answer.displacement_m
    theirs = [float(simulated.heel_m[-1]) for simulated in case.springs]
    cells = [case.name, ", ".join(f"{angle:.3g}" for angle in angles)]
    if ours is None:
        return [*cells, case.answer.outcome.value, *(f"{slip:.4f}" for slip in theirs), *["-"] * 5]
    cells += [f"{ours:.4f}", *(f"{slip:.4f}" for slip in theirs), f"{ours / theirs[0] - 1.0:+.1%}"]
    return [*cells, *_times(case)]


def _times(case: Beside) -> list[str]:
    """When a slide begins to tip back, and when it first leans."""
    history, simulated = case.answer.history, case.springs[0]
    if case.answer.kind != model_of_mode("slide").kind or history is None:
        return ["-"] * 4
    leans_rad = first_rest_rad(case.answer)
    cells = []
    for part in (0.02, 0.98):
        ours = first_time(history.time_s, history.theta_rad > part * leans_rad)
        theirs = first_time(simulated.time_s, simulated.turned_rad > part * leans_rad)
        cells += [f"{ours:.3f}", f"{theirs:.3f}"]
    return cells


def summary(cases: Sequence[Beside]) -> str:
    """How many of the cases are within some differences of both springs."""
    rows = []
    for damping, place in zip(DAMPINGS, range(len(DAMPINGS)), strict=True):
        apart = np.array(
            [
                abs((case.answer.displacement_m or math.nan) / case.springs[place].heel_m[-1] - 1.0)
                for case in cases
            ]
        )
        rows.append([
            f"{damping:g}", str(apart.size), f"{np.nanmedian(apart):.2%}",
            f"{np.nanmax(apart):.1%}", *(str(int((apart <= most).sum())) for most in (0.01, 0.05)),
        ])  # fmt: skip
    softer = np.array([
        abs(case.springs[1].heel_m[-1] / case.springs[0].heel_m[-1] - 1.0) for case in cases
    ])  # fmt: skip
    rows.append([
        "0.1 beside 0.7", str(softer.size), f"{np.median(softer):.2%}", f"{softer.max():.1%}",
        *(str(int((softer <= most).sum())) for most in (0.01, 0.05)),
    ])  # fmt: skip
    headers = ["damping of the springs", "blocks", "median", "greatest", "within 1 %", "within 5 %"]
    return markdown((headers, rows))


def main(arguments: Sequence[str] | None = None) -> None:
    chosen = parser(__doc__).parse_args(arguments)
    root = Path(chosen.records or os.environ.get(RECORDS_VARIABLE, "."))
    under_pulses = list(pulses())
    report(
        "followed-pulses",
        markdown((HEADERS, map(row, under_pulses))),
        write=chosen.write,
        page=PAGE,
    )
    headers = [
        "motion", "slides", "lose a contact", "slide 5 cm", "with rebound .2", "without friction",
    ]  # fmt: skip
    table = markdown((headers, slides_by_law(root)))
    report("slides-by-law", table, write=chosen.write, page=PAGE)
    modes: tuple[ModeName, ...] = ("slide", "slump")
    for mode in modes:
        cases = list(of_the_rock_mass(root, mode))
        if not cases:
            continue
        text = f"{markdown((HEADERS, map(row, cases)))}\n\n{summary(cases)}"
        report(f"followed-{mode}", text, write=chosen.write, page=PAGE)
    if chosen.write:
        draw(next(case for case in under_pulses if case.name == "slump in the second"))


def draw(case: Beside) -> None:
    """Draw the geometry of a block that has slid and leans, and one motion in time."""
    figure = new_figure(width_in=8.6, height_in=4.2)
    scene, trace = figure.subplots(1, 2, width_ratios=[1.1, 1.0])
    block, (beta, *_) = case.block, case.planes
    gamma, b = math.radians(block.gamma_deg), math.radians(beta)
    to_slope = np.array([[math.cos(b), -math.sin(b)], [math.sin(b), math.cos(b)]])
    slid_m = 0.35 * block.base_m
    edge_m = block.s1_m / math.sin(gamma)
    turned = math.asin(slid_m * math.sin(gamma) / edge_m)
    c, s = math.cos(turned), math.sin(turned)
    corners, slid = np.array(block.vertices_m), np.array([slid_m, 0.0])
    panels = {
        "at rest": (corners, ROCK, "--"),
        "slid": (corners + slid, BLUE, ":"),
        "leans": (corners @ np.array([[c, s], [-s, c]]) + slid, BLUE, "-"),
    }
    for name, (outline, colour, style) in panels.items():
        closed = np.concatenate([outline, outline[:1]]) @ to_slope
        scene.plot(*closed.T, style, color=colour, lw=1.6, label=name)
    top = 1.5 * edge_m * np.array([-math.cos(gamma), math.sin(gamma)])
    planes = np.array([[2.6 * block.base_m, 0.0], [0.0, 0.0], top])
    scene.plot(*(planes @ to_slope).T, color="black", lw=2.0)
    heel = slid @ to_slope
    scene.annotate("$s$", heel / 2.0, (0, -13), textcoords="offset points", ha="center")
    upper = panels["leans"][0][block.outline.index(block.back)] @ to_slope
    scene.plot(*upper, "o", color=BLUE, ms=4)
    scene.plot(*heel, "o", color=BLUE, ms=4)
    scene.set_aspect("equal")
    scene.legend(fontsize=8, loc="upper right")
    scene.set(xlabel="out of the slope [m]", ylabel="up [m]")
    history, simulated = case.answer.history, case.springs[0]
    assert history is not None
    trace.plot(simulated.time_s, simulated.heel_m, color="#c44e52", lw=3.0, alpha=0.45,
               label="free block on springs: heel [m]")  # fmt: skip
    trace.plot(simulated.time_s, simulated.turned_rad, color="#d98c1f", lw=3.0, alpha=0.45,
               label="rotation [rad]")  # fmt: skip
    trace.plot(history.time_s, history.displacement_m, color="black", lw=1.0, label="rbfrag")
    trace.plot(history.time_s, history.turned_rad, color="black", lw=1.0)
    trace.set_xlabel("time [s]")
    trace.legend(fontsize=8, loc="upper left")
    light_grid(trace)
    save_figure(figure, FIGURE)


if __name__ == "__main__":
    main()
