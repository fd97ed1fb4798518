"""Rates by PGV, by PGA with magnitudes, and what is rejected."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.exchange.event_losses import losses
from rbfrag.exchange.openquake_events import job_files, read_events, read_magnitudes
from rbfrag.hazards.shaking import component_of_velocity, factors_between, velocity_of
from rbfrag.question.components import COMPONENTS


@pytest.fixture
def folder(formats_dir: Path) -> Path:
    return formats_dir / "openquake_event_based" / "one_realization"


def blocks_at(sites: tuple[str, ...]) -> dict[str, Any]:
    """Blocks of seven sizes and strengths at each site."""
    p2, kr = [10.0, 10.0, 3.0, 3.0, 1.0, 1.0, 0.3], [0.1, 0.15, 0.1, 0.2, 0.05, 0.1, 0.03]
    return {
        "p2_1_s2": np.tile(p2, len(sites)),
        "kr": np.tile(kr, len(sites)),
        "site_id": np.repeat(np.array(sites, dtype=object), len(p2)),
    }


def test_the_law_is_that_of_its_figures() -> None:
    pga, magnitude = np.array([0.1, 0.2, 0.0, 0.2]), np.array([6.0, 5.0, 6.0, 9.0])
    expected = [
        math.exp(-0.623) * 0.1**0.873, math.exp(-0.623 - 0.472) * 0.2**0.873, 0.0,
        math.exp(-0.623 + 1.6 * 0.472) * 0.2**0.873,
    ]  # fmt: skip
    assert velocity_of(pga, magnitude) == pytest.approx(expected)
    of_larger = component_of_velocity(COMPONENTS["larger"])
    scatter = COMPONENTS["larger"].sigma
    assert of_larger.sigma**2 == pytest.approx(0.434**2 + 0.873**2 * scatter**2)
    # PGV of the single component that a larger PGA stands for
    assert velocity_of(pga[:1] / 1.14, magnitude[:1]) == pytest.approx(
        velocity_of(pga[:1], magnitude[:1]) / of_larger.ratio("pgv_m_s")
    )


def test_magnitudes_of_events_are_those_of_their_ruptures(folder: Path) -> None:
    magnitudes = read_magnitudes(job_files(folder))
    assert magnitudes is not None
    lines = (folder / "ruptures_1.csv").read_text().splitlines()[2:]
    of = {line.split(",")[0]: float(line.split(",")[3]) for line in lines}
    events = [line.split(",") for line in (folder / "events_1.csv").read_text().splitlines()[2:]]
    by_number = {int(event): of[rupture] for event, rupture, *_ in events}
    assert magnitudes.tolist() == [by_number[number] for number in sorted(by_number)]


def test_an_event_of_no_rupture_is_rejected(folder: Path, tmp_path: Path) -> None:
    lines = (folder / "ruptures_1.csv").read_text().splitlines()
    short = tmp_path / "ruptures.csv"
    short.write_text("\n".join(lines[:-1]) + "\n")
    gone = lines[-1].split(",")[0]
    with pytest.raises(InputError, match=f"the rupture {gone} is not in ruptures.csv"):
        read_magnitudes(job_files(folder, {"ruptures": short}))


def test_rates_by_pga_and_magnitude_are_near_those_by_pgv(folder: Path) -> None:
    about: dict[str, Any] = {"component": "rotd50", "expected": True}
    blocks = blocks_at(read_events(job_files(folder)).site_ids)
    by_velocity = losses(folder, blocks, **about)
    by_law = losses(folder, blocks, imt=("PGA",), **about)
    ratio = np.log(by_law.block_rates[0] / by_velocity.block_rates[0])
    assert 0.7 < math.exp(ratio.mean()) < 1.4
    assert ratio.std() < 0.4
    for answer, tau in ((by_velocity, 0.15), (by_law, 0.25)):
        document = answer.as_dict()["between_measures"]
        assert document["tau"] == tau
        assert (document["factor_low"], document["factor_high"]) == factors_between(tau)
        assert math.log(document["factor_high"]) == pytest.approx(1.96 * tau)
    assert any("magnitudes of the ruptures" in text for text in by_law.warnings)


def test_pga_alone_is_no_rate_unless_its_model_is_named(folder: Path) -> None:
    blocks = blocks_at(read_events(job_files(folder)).site_ids)
    names = ("gmf_data", "events", "sitemesh", "realizations")
    files = {name: job_files(folder)[name] for name in names}
    about: dict[str, Any] = {
        "files": files, "investigation_time": 50.0, "ses": 1800, "expected": True, "imt": ("PGA",),
    }  # fmt: skip
    with pytest.raises(InputError, match="PGA alone is biased"):
        losses(None, blocks, **about)
    forced = losses(None, blocks, model="toppling-pga", **about)
    assert forced.as_dict()["between_measures"] is None
    assert any("PGA alone is biased" in text for text in forced.warnings)


def test_the_best_measure_of_a_job_answers(folder: Path, tmp_path: Path) -> None:
    lines = (folder / "gmf-data_1.csv").read_text()
    blocks = blocks_at(read_events(job_files(folder)).site_ids)
    without = tmp_path / "gmf-data.csv"
    without.write_text(lines.replace("gmv_PGV", "gmv_AvgSA", 1))
    about: dict[str, Any] = {"component": "rotd50", "expected": True}
    chosen = losses(folder, blocks, files={"gmf_data": without}, **about)
    inputs = losses(folder, blocks, imt=("SA(1.0)",), **about)
    assert chosen.portfolio.measures == ("sa(1)",)
    assert chosen.block_rates[0].tolist() == inputs.block_rates[0].tolist()
