"""PGV out of a curve of PGA and its disaggregation by magnitude."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import rbfrag
from rbfrag.errors import InputError
from rbfrag.exchange.event_losses import losses
from rbfrag.exchange.openquake_events import job_files, read_events, read_magnitudes
from rbfrag.hazards.curve import hazard_curve
from rbfrag.hazards.disaggregation import Disaggregation
from rbfrag.hazards.shaking import component_of_velocity, velocity_of
from rbfrag.question.components import COMPONENTS

HEAD = """#,,,,"generated_by='OpenQuake engine 3.26.2', investigation_time=50.0, \
mag_bin_edges=[5.0, 5.5, 6.0], lon=174.776, lat=-41.279{}"
"""
MAG = (
    HEAD.format("")
    + """imt,iml,poe,mag,mean
PGA,4.0E-01,7.0E-02,5.25,1.0E-02
PGA,4.0E-01,7.0E-02,7.25,6.0E-02
PGA,2.0E-02,4.5E-01,5.25,3.0E-01
PGA,2.0E-02,4.5E-01,7.25,2.0E-01
SA(1.0),1.0E-02,4.5E-01,7.25,2.0E-01
"""
)
LEVELS = np.geomspace(0.01, 3.0, 60)


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "Mag-0.csv"
    path.write_text(text)
    return path


def test_shares_are_those_of_rates_at_the_levels(tmp_path: Path) -> None:
    parsed = Disaggregation.read(written(tmp_path, MAG))
    weak, strong = -np.log1p([-0.3, -0.2]), -np.log1p([-0.01, -0.06])
    assert parsed.levels.tolist() == [0.02, 0.4]
    assert parsed.magnitude.tolist() == [5.25, 7.25]
    assert (parsed.lon, parsed.lat) == (174.776, -41.279)
    assert parsed.share == pytest.approx(np.stack([weak / weak.sum(), strong / strong.sum()]))
    between = parsed.shares(np.log([0.001, 0.02, math.sqrt(0.02 * 0.4), 0.4, 2.0])).T
    ends = parsed.share
    assert between == pytest.approx(
        np.stack([ends[0], ends[0], ends.mean(axis=0), ends[1], ends[1]])
    )


def test_distances_are_summed(tmp_path: Path) -> None:
    text = HEAD.format(", weights=[1.0], rlz_ids=[0]") + (
        "imt,iml,poe,mag,dist,rlz0\nPGA,.1,.1,5.5,10,.02\nPGA,.1,.1,5.5,30,.01\n"
        "PGA,.1,.1,6.5,10,.03\n"
    )
    parsed = Disaggregation.read(written(tmp_path, text))
    r = -np.log1p(-np.array([0.02, 0.01, 0.03]))
    assert parsed.share[0, 0] == pytest.approx((r[0] + r[1]) / r.sum())


def test_one_magnitude_is_the_curve_moved_by_the_law(tmp_path: Path) -> None:
    # of a power law a power law comes, raised by exp((slope · scatter)²/2)
    text = HEAD.format("") + "imt,iml,poe,mag,mean\nPGA,.01,.1,6.5,.1\n"
    curve = hazard_curve(
        "pga_g", np.geomspace(1e-4, 1e3, 200), 1e-3 * np.geomspace(1e-4, 1e3, 200) ** -2.0
    )
    parsed = Disaggregation.read(written(tmp_path, text))
    for name in ("single", "larger"):
        component = component_of_velocity(COMPONENTS[name])
        result = parsed.velocity_curve(curve, component=name)
        pga = np.array([0.1, 0.3, 1.0])
        velocity = velocity_of(pga, np.array(6.5)) / component.ratio("pgv_m_s")
        expected = 1e-3 * pga**-2.0 * math.exp(0.5 * (2.0 / 0.873 * component.sigma) ** 2)
        assert result.rate_at(velocity) == pytest.approx(expected, rel=2e-4)


def test_rates_are_those_of_the_events_that_it_is_made_of(
    formats_dir: Path, tmp_path: Path
) -> None:
    folder = formats_dir / "openquake_event_based" / "one_realization"
    events = read_events(job_files(folder), imts=("PGA",))
    magnitudes = read_magnitudes(job_files(folder))
    assert magnitudes is not None
    p2, kr = np.repeat([30.0, 10.0, 3.0, 1.0], 3), np.tile([0.05, 0.1, 0.12], 4)
    for site in (0, 7):
        local = events.site == site
        pga = events.measures["pga_g"][local]
        event = events.event[local]
        weight, bins = events.weight[event], np.floor(magnitudes[event] / 0.1) * 0.1 + 0.05
        levels = np.append(np.geomspace(pga.min(), pga.max(), 60), 1.1 * pga.max())
        curve = hazard_curve("pga_g", levels, [weight[pga >= x].sum() for x in levels])
        lines = [
            f"PGA,{x:.6E},nan,{m:.3f},{-math.expm1(-weight[(pga >= x) & (bins == m)].sum()):.8E}\n"
            for x in levels[:-1:3]
            for m in np.unique(bins)
        ]
        file = written(tmp_path, HEAD.format("") + "imt,iml,poe,mag,mean\n" + "".join(lines))
        table = {"p2_1_s2": p2, "kr": kr, "site_id": np.repeat(events.site_ids[site], p2.size)}
        by_events = losses(folder, table, imt=("PGA",), component="rotd50", expected=True)
        answer = rbfrag.hazard(curve, p2, kr, component="rotd50", disaggregation=file)
        assert answer.annual_rate == pytest.approx(by_events.block_rates[0], rel=0.04)
        assert answer.tau == by_events.tau == 0.25
        assert any("magnitudes of its disaggregation" in text for text in answer.warnings)


def test_survival_stands_on_the_same_rate(tmp_path: Path) -> None:
    file = written(tmp_path, MAG)
    curve = hazard_curve("pga_g", LEVELS, 1e-4 * LEVELS**-2.0)
    rate = rbfrag.hazard(curve, 3.0, 0.1, disaggregation=file).annual_rate[0]
    stands = rbfrag.survival(curve, 3.0, 0.1, kind="toppling", age_years=100.0, disaggregation=file)
    assert stands.annual_rate_any == pytest.approx(rate)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("mag,mean", "eps,mean"), "columns imt, iml, mag, and mean or one realization"),
        (("PGA", "SA(0.3)"), "no disaggregation of PGA"),
        (("6.0E-02", "1.2"), "line 4: iml 0.4, mag 7.25, 1.2"),
        (("6.0E-02", "many"), "line 4: 'many' is not a number"),
        (("mean\n", "rlz0,rlz1\n"), "mean or one realization"),
    ],
)
def test_what_is_no_disaggregation_is_rejected(
    tmp_path: Path, change: tuple[str, str], message: str
) -> None:
    with pytest.raises(InputError, match=message.replace("(", r"\(")):
        Disaggregation.read(written(tmp_path, MAG.replace(*change)))
    traditional = MAG.replace("1.0E-02", ".2").replace("6.0E-02", ".8").replace("3.0E-01", ".8")
    with pytest.raises(InputError, match="not the traditional one"):
        Disaggregation.read(written(tmp_path, traditional))


def test_what_a_disaggregation_does_not_tell_is_rejected(tmp_path: Path) -> None:
    file = written(tmp_path, MAG)
    pga = hazard_curve("pga_g", LEVELS, 1e-4 * LEVELS**-2.0)
    with pytest.raises(InputError, match=r"must start at or below k_r.*0\.02 g.*from 0\.019 g"):
        rbfrag.hazard(pga, 3.0, [0.1, 0.019], disaggregation=file)
    with pytest.raises(InputError, match="converts PGA to PGV"):
        rbfrag.hazard(hazard_curve("pgv_m_s", LEVELS, LEVELS**-2.0), 3.0, 0.1, disaggregation=file)
    elsewhere = hazard_curve("pga_g", LEVELS, 1e-4 * LEVELS**-2.0, lon=174.8, lat=-41.279)
    with pytest.raises(InputError, match=r"of lon 174\.776, the curve of 174\.8"):
        rbfrag.hazard(elsewhere, 3.0, 0.1, disaggregation=file)
    with pytest.raises(InputError, match="or the disaggregation by magnitude"):
        rbfrag.hazard(pga, 3.0, 0.1)
