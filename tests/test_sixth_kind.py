"""A kind is a line of facts and a file each for its physics, its campaigns and its method.

A copy of the package gets one that no part of it names, with a number of its own, which one line
declares; it answers by every door. Its blocks stand on pads and fail when the peak acceleration
exceeds k_r (1 + thickness/10 mm).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import rbfrag
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import add_motion
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.motions.ground_motion import GroundMotion
from tests.synthetic import shaking

PACKAGE = Path(rbfrag.__file__).parent

FIELD = (
    '        Quantity("pad_m", "Thickness of the pads", "m", "", POSITIVE, '
    'Input(aliases=("pads",))),\n'
)
FACTS = '        KindSpec("padded", None, "fails", ("p2", "kr", "pad_m"), False, ("pad_m",)),\n'

MODEL = '''
"""A block on pads."""

from rbfrag.solver.kind import Kind
from rbfrag.solver.results import Outcome, Response


class Padded(Kind):
    def respond(self, supported_block, shaking):
        strengthened = 1.0 + supported_block.settings["pad_m"] / 0.01
        fails = shaking.motion.pga_g > supported_block.yield_g * strengthened
        return Response(
            kind=self.kind,
            outcome=Outcome.TOPPLED if fails else Outcome.STABLE,
            peak_theta_n=None,
            peak_theta_rad=None,
            critical_angle_deg=None,
            started_s=None,
            toppled_s=None,
            error_estimate=0.0,
            steps=0,
            samples_moved=0,
            samples_total=0,
        )


MODEL = Padded.named("padded")
'''

CAMPAIGN = '''
"""Campaigns of blocks on pads."""

import numpy as np

from rbfrag.campaign.kind import CampaignKind, Case, CaseResult, strengths_at
from rbfrag.solver.results import SearchPoints


class PaddedCampaign(CampaignKind):
    def cases(self):
        return tuple(
            Case(self.kind, p2, {"pad_m": pad}) for p2 in (10.0, 1.0) for pad in (0.001, 0.005)
        )

    def grid(self, case, measures):
        return strengths_at(case.size, measures, np.geomspace(0.1, 4.0, 25))

    def run_cases(self, shaking, cases, request):
        results = []
        for case in cases:
            k = self.grid(case, shaking.motion)
            fails = k * (1.0 + case.block["pad_m"] / 0.01) < 1.0
            words = tuple("toppled" if each else "stable" for each in fails)
            results.append(CaseResult(None, SearchPoints(k, np.where(fails, np.nan, 0.0), words)))
        return results


CAMPAIGN = PaddedCampaign("padded")
'''

METHOD = '''
"""The method of pads: logistic in ln(x/y) and in the thickness."""

from rbfrag.fragility import method
from rbfrag.fragility.method import BlockParameters, Form, LinearPredictor, Method


def _eta(b, v, ns):
    ratio = ns.log(v["intensity_m_s"] / v["y_m_s"])
    return LinearPredictor(b[0] + b[1] * ratio + b[2] * v["pad_m"], (1.0, ratio, v["pad_m"]))


METHOD = Method(
    name="pads",
    block=BlockParameters(
        ("p2", "kr", "pad_m"), "padded", "kr", "p2", method.NOT_LIFTED, stored={"pad_m": ()}
    ),
    link=method.LOGIT,
    forms={"pgv": Form(("b0", "b_ln_x_over_y", "b_pad"), _eta)},
    meaning="probability that the block on pads fails",
    fit="outcomes",
)
'''

INPUTS = """
import json
import numpy as np
import rbfrag
from fastapi.testclient import TestClient
from rbfrag.errors import InputError
from rbfrag.service.app import make_app
from rbfrag.service.settings import ServiceSettings

motion = rbfrag.read_motions("record.csv")[0]
outcomes = [
    rbfrag.respond(motion, kind="padded", p2=3.0, kr=factor * motion.pga_g, pad_m=0.005).outcome
    for factor in (0.66, 0.67)
]
try:
    rbfrag.critical(motion, kind="padded", p2=3.0)
except InputError as error:
    rejected = str(error)
first = rbfrag.simulate("motions.db", kind="padded", jobs=1)
again = rbfrag.simulate("motions.db", kind="padded", jobs=1)
fitted = rbfrag.fit("motions.db", kind="padded", term="pgv").model.row
block = {"p2": 3.0, "kr": 0.3, "pgv_m_s": 0.6}
single = [
    rbfrag.predict(**block, kind="padded", pad_m=pad, db="motions.db") for pad in (0.001, 0.005)
]
array = rbfrag.predict(**block, kind="padded", pad_m=np.array([0.001, 0.005]), db="motions.db")
with TestClient(make_app(ServiceSettings(db="motions.db"))) as client:
    asked = {"kind": "padded", "p2": 3.0, "kr": 0.3, "pad": 0.005, "pgv": 0.6}
    http = client.get("/v1/predict", params=asked)
print(json.dumps({
    "outcomes": outcomes,
    "rejected": rejected,
    "stored": [first.combinations, first.not_searched, again.resumed],
    "model": [fitted.kind, fitted.method, fitted.name],
    "single": [each.probability for each in single],
    "array": array.probability.tolist(),
    "http": http.json(),
}))
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package with one more kind, a record and a database of motions."""
    folder = tmp_path_factory.mktemp("sixth")
    additions = {
        "solver/models/padded.py": MODEL,
        "campaign/kinds/padded.py": CAMPAIGN,
        "fragility/methods/pads.py": METHOD,
    }
    for path in PACKAGE.rglob("*"):
        inside = path.relative_to(PACKAGE)
        if path.is_dir() and path.name != "__pycache__":
            (folder / "rbfrag" / inside).mkdir(parents=True)
        elif "__pycache__" not in inside.parts:
            (folder / "rbfrag" / inside).symlink_to(path)
    for name, text in additions.items():
        (folder / "rbfrag" / name).write_text(text)
    for name, mark, line in (
        ("vocabulary/quantities.py", '    "failure": (\n', FIELD),
        ("solver/kinds.py", '        KindSpec(\n            "rocking"', FACTS),
    ):
        text = (PACKAGE / name).read_text(encoding="utf-8")
        head, result, rest = text.partition(mark)
        assert result
        text = f"{head}{result}{line}{rest}" if line == FIELD else f"{head}{line}{result}{rest}"
        (folder / "rbfrag" / name).unlink()
        (folder / "rbfrag" / name).write_text(text, encoding="utf-8")
    samples = shaking(3)
    rows = (f"{0.02 * i:.2f},{a!r}" for i, a in enumerate(samples.tolist()))
    (folder / "record.csv").write_text("\n".join(["time [s],acceleration [g]", *rows]))
    with opened_database(folder / "motions.db", create=True) as engine, engine.begin() as into:
        for seed in range(12):
            motion = GroundMotion(
                (0.5 + 0.1 * seed) * shaking(seed, 450), 0.02, source_file=f"{seed}.txt"
            )
            quake = EarthquakeInfo(f"quake-{seed}", guessed=False)
            add_motion(into, motion, earthquake=quake, is_vertical=False, recording=str(seed))
    return folder


def run(folder: Path, *arguments: str) -> str:
    process = subprocess.run(
        [sys.executable, *arguments], cwd=folder, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(folder), "COLUMNS": "200"},
    )  # fmt: skip
    assert process.returncode == 0, process.stderr
    return process.stdout


def test_it_answers_by_every_door(folder: Path) -> None:
    document = json.loads(run(folder, "-c", INPUTS))
    assert document["outcomes"] == ["toppled", "stable"]
    assert "no critical values of kind padded are computed" in document["rejected"]
    assert document["stored"] == [12 * 2 * 4] * 3
    kind, method, name = document["model"]
    assert (kind, method) == ("padded", "pads")
    thin, thick = document["single"]
    assert 1.0 > thin > thick > 0.0
    assert document["array"] == pytest.approx([thin, thick], rel=1e-12)
    assert document["http"].get("probability") == thick, document["http"]
    assert (document["http"]["kind"], document["http"]["model"]) == ("padded", name)
    shell = ("-m", "rbfrag.cli.main")
    command = ("predict", "--kind", "padded", "--p2", "3", "--kr", "0.3", "--pgv", "0.6")
    answer = json.loads(
        run(folder, *shell, *command, "--pad", "0.005", "--db", "motions.db", "--json")
    )
    assert answer["probability"] == thick
    table = "kind,p2,kr,Pads [mm],PGV [m/s]\npadded,3,0.3,1,0.6\npadded,3,0.3,5,0.6\n"
    (folder / "blocks.csv").write_text(table)
    run(
        folder, *shell, "predict", "--blocks", "blocks.csv", "--out", "answers.csv", "--db",
        "motions.db",
    )  # fmt: skip
    head, *rows = (folder / "answers.csv").read_text().splitlines()
    place = head.split(",").index("probability")
    assert [float(row.split(",")[place]) for row in rows] == pytest.approx([thin, thick], rel=1e-9)
    block = ("--kind", "padded", "--p2", "3", "--kr", "0.05", "--pad", "0.005")
    answer = json.loads(run(folder, *shell, "respond", "record.csv", *block, "--json"))
    assert (answer["kind"], answer["outcome"]) == ("padded", "toppled")
