"""A kind is a line of facts and a file: a throw-away one answers everywhere, without another line.

Its blocks fail when the peak acceleration exceeds k_r.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from fastapi.testclient import TestClient

import rbfrag
import rbfrag.campaign.kinds
import rbfrag.solver.models
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import add_motion
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.service.app import make_app
from rbfrag.service.settings import ServiceSettings
from rbfrag.solver.kinds import KINDS, KindFacts
from tests.synthetic import shaking

FALLS = '''
"""A block that falls when |a| exceeds k_r."""

from rbfrag.solver.kind import Kind
from rbfrag.solver.results import Outcome, Response


class Falls(Kind):
    def respond(self, site, shaking):
        fails = shaking.motion.pga_g > site.yield_g
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


MODEL = Falls.named("falls")
'''

CAMPAIGN = '''
"""Campaigns of blocks that fall."""

import math

import numpy as np

from rbfrag.campaign.kind import CampaignKind, Case, CaseResult
from rbfrag.campaign.kinds.toppling import Y_OVER_PGV
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.results import SearchPoints


class FallsCampaign(CampaignKind):
    def cases(self):
        return tuple(Case(self.kind, p2) for p2 in (10.0, 1.0))

    def grid(self, case, measures):
        ground = measures.pga_g * STANDARD_GRAVITY_M_S2
        return math.sqrt(case.p2) * measures.pgv_m_s / ground * Y_OVER_PGV

    def run_cases(self, shaking, cases, request):
        results = []
        for case in cases:
            k = self.grid(case, shaking.motion)
            words = tuple("toppled" if each < 1.0 else "stable" for each in k)
            results.append(CaseResult(None, SearchPoints(k, np.where(k < 1.0, np.nan, 0.0), words)))
        return results


CAMPAIGN = FallsCampaign("falls")
'''


@pytest.fixture
def falls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for package, text in ((rbfrag.solver.models, FALLS), (rbfrag.campaign.kinds, CAMPAIGN)):
        folder = tmp_path / package.__name__
        folder.mkdir()
        (folder / "falls.py").write_text(text)
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(folder)])
    facts = KindFacts("falls", parameters=("p2", "kr"))
    monkeypatch.setitem(KINDS, "falls", facts)


@pytest.fixture
def database(tmp_path: Path) -> Path:
    place = tmp_path / "falls.db"
    with opened_database(place, create=True) as engine, engine.begin() as connection:
        for seed in range(12):
            samples = (0.5 + 0.1 * seed) * shaking(seed, 450)
            motion = GroundMotion(samples, 0.02, source_file=f"{seed}.txt")
            quake = EarthquakeInfo(f"quake-{seed}", guessed=False)
            add_motion(connection, motion, earthquake=quake, is_vertical=False, recording=str(seed))
    return place


@pytest.mark.usefixtures("falls")
def test_respond_answers() -> None:
    motion = GroundMotion(shaking(3), 0.02)
    for factor, outcome in ((0.99, "toppled"), (1.01, "stable")):
        answer = rbfrag.respond(motion, kind="falls", p2=3.0, kr=factor * motion.pga_g)
        assert (answer.kind, answer.outcome) == ("falls", outcome)
    with pytest.raises(InputError, match="no search"):
        rbfrag.critical(motion, kind="falls", p2=3.0)


@pytest.mark.usefixtures("falls")
def test_what_is_simulated_is_fitted_and_predicts(database: Path) -> None:
    summary = rbfrag.simulate(database, kind="falls", jobs=1)
    assert summary.combinations == summary.not_searched == 12 * 2 * 2
    assert rbfrag.simulate(database, kind="falls", jobs=1).resumed == summary.combinations
    model = rbfrag.fit(database, kind="falls", term="pgv", method="logistic").model.row
    assert model.kind == "falls"
    weak = rbfrag.predict(3.0, 0.02, kind="falls", pgv_m_s=0.6, db=database)
    strong = rbfrag.predict(3.0, 2.0, kind="falls", pgv_m_s=0.6, db=database)
    assert (weak.kind, weak.model) == ("falls", model.name)
    assert weak.probability > 0.5 > strong.probability
    with TestClient(make_app(ServiceSettings(db=str(database)))) as client:
        asked = {"kind": "falls", "p2": 3.0, "kr": 0.02, "pgv": 0.6}
        answer = client.get("/v1/predict", params=asked)
        assert answer.status_code == 200, answer.text
        assert answer.json()["probability"] == weak.probability
        assert answer.json()["kind"] == "falls"
