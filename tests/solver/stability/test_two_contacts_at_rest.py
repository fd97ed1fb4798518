"""The frequency parameter of many blocks on two contacts at once, against each mechanism."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rbfrag.campaign.kinds import campaign_of_kind
from rbfrag.solver.block.formulas import array_elementwise
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.mechanism import shaken_mechanism
from rbfrag.solver.models import model_of_kind
from rbfrag.solver.stability.at_rest import two_contacts_at_rest


@pytest.mark.parametrize("kind", ["slumping", "confined_toppling"])
def test_it_is_that_of_the_mechanism(kind: str) -> None:
    campaign: Any = campaign_of_kind(kind)
    blocks = [each.block for each in campaign.family]
    p2 = two_contacts_at_rest(
        confined=kind == "confined_toppling",
        alpha1_deg=np.array([b.alpha1_deg for b in blocks]),
        alpha3_deg=np.array([b.alpha3_deg for b in blocks]),
        gamma_deg=np.array([b.gamma_deg for b in blocks]),
        r1_m=np.array([b.r1_m for b in blocks]),
        r3_m=np.array([b.r3_m for b in blocks]),
        beta_deg=np.array([each.beta_deg for each in campaign.family]),
        phis_deg=(
            np.array([each.phi_deg for each in campaign.family]),
            np.array([each.phi_deg - 4.0 for each in campaign.family]),
        ),
        functions=array_elementwise(),
        trigonometry=np,
    )
    for value, each in zip(p2, campaign.family, strict=True):
        one = shaken_mechanism(
            model_of_kind(kind),
            each.block,
            beta_deg=each.beta_deg,
            phi_deg=each.phi_deg,
            phi_back_deg=each.phi_deg - 4.0,
        )
        assert value == pytest.approx(one.p2, rel=1e-12)


@pytest.mark.parametrize(
    ("angles", "p2"), [((45, 65, 35, 0), 2.446054), ((50, 72, 35, 5), 1.652443)]
)
def test_printed_values(angles: tuple[float, float, float, float], p2: float) -> None:
    # r1 = 1 m; the table was computed with 9.81 m/s²
    alpha1, alpha3, phi, beta = angles
    r3 = np.cos(np.radians(alpha1)) / np.cos(np.radians(alpha3))
    block = Block.from_angles(alpha1, alpha3, float(r3))
    one = {name: np.array([value]) for name, value in (
        ("alpha1_deg", alpha1), ("alpha3_deg", alpha3), ("gamma_deg", block.gamma_deg),
        ("r1_m", block.r1_m), ("r3_m", block.r3_m), ("beta_deg", beta),
    )}  # fmt: skip
    rest = two_contacts_at_rest(
        confined=False,
        **one,
        phis_deg=(np.array([phi]), np.array([phi])),
        functions=array_elementwise(),
        trigonometry=np,
    )
    assert rest[0] * 9.81 / 9.80665 == pytest.approx(p2, abs=1e-6)
