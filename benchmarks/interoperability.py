"""The OpenQuake engine and pelicun run on exported functions, their failures beside rbfrag's own.

    make interoperability
    python -m benchmarks.interoperability PYTHON [FOLDER]

PYTHON is that of an environment with openquake-engine and pelicun. Four blocks at two sites go
through three small jobs of the engine (event-based, classical and scenario damage), each on another
measure, and the same blocks through damage runs of pelicun. Exit status 1 if a number is farther
than `ALLOWED` from rbfrag's own answer to the same shaking.
"""

from __future__ import annotations

import argparse
import csv
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import rbfrag
from benchmarks.page import ROOT

ALLOWED = 0.01
"""Relative difference that is allowed."""

BLOCKS = (("slab", 3.0, 0.10), ("post", 10.0, 0.06), ("boulder", 1.0, 0.15), ("plate", 20.0, 0.25))
SITES = ((174.0, -41.0), (174.2, -41.1))
YEARS = 50.0

EXAMPLE = ROOT / "examples" / "pelicun_damage.py"
DEMANDS = (
    ("PGV", "pgv_m_s", (0.6, 0.9)), ("PGA", "pga_g", (0.6, 1.2)), ("SA(1.0)", "sa(1)", (0.5, 1.0))
)  # fmt: skip
"""What a block with p2 = 3 and kr = 0.1 is shaken by in pelicun."""

LIBRARIES = "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"
NRML = 'xmlns="http://openquake.org/xmlns/nrml/0.5" xmlns:gml="http://www.opengis.net/gml"'
TREE = """<logicTree logicTreeID="t"><logicTreeBranchSet branchSetID="s" {0}>
<logicTreeBranch branchID="b"><uncertaintyModel>{1}</uncertaintyModel>
<uncertaintyWeight>1</uncertaintyWeight></logicTreeBranch></logicTreeBranchSet></logicTree>"""
DOCUMENTS = {
    "exposure": """<exposureModel id="e" category="rock_blocks" taxonomySource="rbfrag">
<description>rock blocks</description><conversions><costTypes/></conversions>
<exposureFields><field oq="number" input="number"/></exposureFields><occupancyPeriods/>
<tagNames/><assets>exposure.csv</assets></exposureModel>""",
    "source": """<sourceModel name="s"><sourceGroup name="g" tectonicRegion="Active Shallow Crust">
<pointSource id="1" name="p">
<pointGeometry><gml:Point><gml:pos>174.1 -41.05</gml:pos></gml:Point>
<upperSeismoDepth>0</upperSeismoDepth><lowerSeismoDepth>20</lowerSeismoDepth></pointGeometry>
<magScaleRel>WC1994</magScaleRel><ruptAspectRatio>1</ruptAspectRatio>
<truncGutenbergRichterMFD aValue="5" bValue="1" minMag="5.5" maxMag="7.5"/>
<nodalPlaneDist><nodalPlane probability="1" strike="0" dip="90" rake="0"/></nodalPlaneDist>
<hypoDepthDist><hypoDepth probability="1" depth="10"/></hypoDepthDist>
</pointSource></sourceGroup></sourceModel>""",
    "rupture": """<simpleFaultRupture><magnitude>6.6</magnitude><rake>0</rake>
<hypocenter lat="-41.05" lon="174.1" depth="8"/><simpleFaultGeometry><gml:LineString><gml:posList>
174.1 -41.15 174.1 -40.95</gml:posList></gml:LineString><dip>90</dip>
<upperSeismoDepth>1</upperSeismoDepth><lowerSeismoDepth>15</lowerSeismoDepth>
</simpleFaultGeometry></simpleFaultRupture>""",
    "sources": TREE.format('uncertaintyType="sourceModel"', "source.xml"),
    "gsims": TREE.format(
        'uncertaintyType="gmpeModel" applyToTectonicRegionType="Active Shallow Crust"',
        "BooreAtkinson2008",
    ),
}
"""Documents of NRML 0.5 that the jobs read."""

COMMON = """[general]
description = rock blocks
calculation_mode = {mode}_damage
random_seed = 42
master_seed = 1
exposure_file = exposure.xml
structural_fragility_file = fragility.xml
asset_hazard_distance = 1
reference_vs30_type = measured
reference_vs30_value = 600
reference_depth_to_2pt5km_per_sec = 1
reference_depth_to_1pt0km_per_sec = 50
maximum_distance = 100
truncation_level = 4
rupture_mesh_spacing = 2
"""
SOURCES = f"""source_model_logic_tree_file = sources.xml
gsim_logic_tree_file = gsims.xml
width_of_mfd_bin = 0.2
investigation_time = {YEARS:g}
"""


class Job(NamedTuple):
    """A calculation of the engine.

    Args:
        mode: calculation mode, before _damage.
        imt: measure of the functions.
        component: what its horizontal component is taken as.
        settings: lines of its own in the file of the job.
    """

    mode: str
    imt: str
    component: str
    settings: str


JOBS = (
    Job(
        "event_based", "PGV", "rotd50",
        SOURCES + "ses_per_logic_tree_path = 200\naggregate_by = taxonomy\n",
    ),
    Job(
        "classical", "SA(1.0)", "geometric_mean",
        SOURCES + f"risk_investigation_time = {YEARS:g}\n"
        'intensity_measure_types_and_levels = {"SA(1.0)": logscale(0.002, 8, 150)}\n',
    ),
    Job(
        "scenario", "PGA", "single",
        "rupture_model_file = rupture.xml\ngsim = BooreAtkinson2008\n"
        "number_of_ground_motion_fields = 2000\naggregate_by = taxonomy\n",
    ),
)  # fmt: skip


def columns() -> dict[str, list[Any]]:
    """Return the table of the blocks: each stands at both sites, as an asset each."""
    rows = [(f"{name}_{i}", p2, kr) for i in range(len(SITES)) for name, p2, kr in BLOCKS]
    names, p2, kr = (list(column) for column in zip(*rows, strict=True))
    return {"block_id": names, "p2_1_s2": p2, "kr": kr}


def run_engine(python: str, job: Job, folder: Path) -> None:
    """Write the files of a job and run it, without its server and in one process."""
    folder.mkdir(parents=True)
    for name, text in DOCUMENTS.items():
        (folder / f"{name}.xml").write_text(f"<nrml {NRML}>{text}</nrml>\n", encoding="utf-8")
    table = columns()
    with (folder / "exposure.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(("id", "lon", "lat", "taxonomy", "number"))
        for i, name in enumerate(table["block_id"]):
            writer.writerow((f"a{i}", *SITES[i // len(BLOCKS)], name, 1))
    written = rbfrag.export.nrml(
        folder / "fragility.xml", blocks=table, imt=job.imt, component=job.component
    )
    assert written.functions == len(table["block_id"])
    ini = folder / "job.ini"
    ini.write_text(COMMON.format(mode=job.mode) + job.settings, encoding="utf-8")
    home = str(folder.parent / "engine")
    surroundings = {
        **os.environ, "HOME": home, "OQ_DATADIR": home, "OQ_DISTRIBUTE": "no",
        # the engine's own name for "open the database yourself"
        "OQ_DATABASE": "127.0.0.1", **dict.fromkeys(LIBRARIES, "1"),
    }  # fmt: skip
    Path(home).mkdir(exist_ok=True)
    _run([str(Path(python).parent / "oq"), "run", ini.name, "-e", "csv"], folder, surroundings)


def _run(command: list[str], folder: Path, surroundings: dict[str, str] | None = None) -> str:
    process = subprocess.run(
        command, cwd=folder, env=surroundings, capture_output=True, text=True, check=False
    )
    if process.returncode:
        raise SystemExit(
            f"{' '.join(command)} failed:\n{process.stdout[-2000:]}{process.stderr[-2000:]}"
        )
    return process.stdout


def engine_failures(job: Job, folder: Path) -> dict[str, float]:
    """Return the failures of each block that the engine exported: in `YEARS`, or in a scenario."""
    (exported,) = folder.glob("damages*.csv" if job.mode == "classical" else "aggrisk-tax*.csv")
    rows = _rows(exported)
    if job.mode != "classical":
        return {row["taxonomy"]: float(row["toppled"]) for row in rows}
    # 1 - exp(-number) in the exports
    return {row["taxonomy"]: -math.log1p(-float(row["structural-toppled"])) for row in rows}


def own_failures(job: Job, folder: Path) -> dict[str, float]:
    """Return rbfrag's answer to the same shaking."""
    table = columns()
    if job.mode == "classical":
        (curves,) = folder.glob("hazard_curve-mean-SA*.csv")
        table["site_id"] = [row["custom_site_id"] for row in _rows(curves) for _ in BLOCKS]
        rates = [
            rbfrag.hazard(curves, p2, kr, site=site, component=job.component).annual_rate
            for p2, kr, site in zip(table["p2_1_s2"], table["kr"], table["site_id"], strict=True)
        ]
        return dict(zip(table["block_id"], (YEARS * np.ravel(rates)).tolist(), strict=True))
    (sites,) = folder.glob("sitemesh*.csv")
    table["site_id"] = [row["custom_site_id"] for row in _rows(sites) for _ in BLOCKS]
    answer = rbfrag.losses(folder, table, imt=(job.imt,), component=job.component, expected=True)
    scale = YEARS if job.mode == "event_based" else 1.0
    return dict(zip(table["block_id"], (scale * answer.block_rates[0]).tolist(), strict=True))


def _rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of an export, which begins with a comment; sites are in their order."""
    with path.open(encoding="utf-8") as stream:
        next(stream)
        return list(csv.DictReader(stream))


def damage_runs(python: str, folder: Path) -> Iterator[tuple[str, float, float]]:
    """Yield what was run in pelicun, its share of failures and rbfrag's probability."""
    for imt, measure, levels in DEMANDS:
        table = folder / f"{measure}.csv"
        rbfrag.export.pelicun(table, 3.0, 0.1, imt=imt, name="block")
        for level in levels:
            output = _run([python, str(EXAMPLE), str(table), str(level)], folder)
            shaking: dict[str, Any] = {measure: level}
            ours_value = float(rbfrag.predict(3.0, 0.1, **shaking).probability)
            yield f"{imt} = {level:g}", float(output.split()[-1]), ours_value


def main() -> None:
    """Run everything, print what each says and end with 1 where they differ."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("python", help="that of an environment with openquake-engine and pelicun")
    parser.add_argument(
        "folder", nargs="?", type=Path, help="for the jobs; default: a temporary one"
    )
    options = parser.parse_args()
    version_of = "from importlib.metadata import version; print(version({!r}))"
    engine, pelicun = (
        _run([options.python, "-c", version_of.format(name)], Path()).strip()
        for name in ("openquake-engine", "pelicun")
    )
    worst = 0.0
    with tempfile.TemporaryDirectory() as temporary:
        folder = (options.folder or Path(temporary)).absolute()
        print(_heading(f"OpenQuake engine {engine}: failures", "engine"))
        for job in JOBS:
            run_engine(options.python, job, folder / job.mode)
            theirs, ours = (run(job, folder / job.mode) for run in (engine_failures, own_failures))
            for name, ours_value in ours.items():
                label = f"{job.mode}, {job.imt} {job.component}, {name}"
                worst = max(worst, _line(label, theirs[name], ours_value))
        print("\n" + _heading(f"pelicun {pelicun}: share of failures", "pelicun"))
        for label, share, ours_value in damage_runs(options.python, folder):
            worst = max(worst, _line(label, share, ours_value))
    print(f"\nlargest difference {worst:.2%}, allowed {ALLOWED:.0%}")
    sys.exit(worst > ALLOWED)


def _heading(label: str, tool: str) -> str:
    return f"{label:46}{tool:>11}{'rbfrag':>11}{'differ by':>11}"


def _line(label: str, theirs: float, ours_value: float) -> float:
    differs = abs(theirs - ours_value) / ours_value
    print(f"{label:46}{theirs:11.4e}{ours_value:11.4e}{differs:11.2%}", flush=True)
    return differs


if __name__ == "__main__":
    main()
