"""The frequency parameter of many blocks on two contacts at once, against each mechanism."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rbfrag.campaign.kinds import campaign_of_kind
from rbfrag.solver.block.arrays import BlockArray
from rbfrag.solver.block.formulas import SCALAR, array_elementwise
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.models import model_of_kind
from rbfrag.solver.simulation import shaken_mechanism
from rbfrag.solver.stability.modes import two_contacts_at_rest


@pytest.mark.parametrize("kind", ["slumping", "confined_toppling"])
def test_it_is_that_of_the_mechanism(kind: str) -> None:
    campaign: Any = campaign_of_kind(kind)
    blocks = [item.block for item in campaign.family]
    p2 = two_contacts_at_rest(
        BlockArray.from_angles(
            [b.alpha1_deg for b in blocks],
            [b.alpha3_deg for b in blocks],
            [b.r3_m for b in blocks],
        ),
        confined=kind == "confined_toppling",
        beta_deg=np.array([item.beta_deg for item in campaign.family]),
        phis_deg=(
            np.array([item.phi_deg for item in campaign.family]),
            np.array([item.phi_deg - 4.0 for item in campaign.family]),
        ),
        functions=array_elementwise(),
        trigonometry=np,
    )
    for value, item in zip(p2, campaign.family, strict=True):
        single = shaken_mechanism(
            model_of_kind(kind),
            item.block,
            beta_deg=item.beta_deg,
            phi_deg=item.phi_deg,
            phi_back_deg=item.phi_deg - 4.0,
        )
        assert value == pytest.approx(single.p2, rel=1e-12)


@pytest.mark.parametrize(
    ("angles", "p2"), [((45, 65, 35, 0), 2.446054), ((50, 72, 35, 5), 1.652443)]
)
def test_printed_values(angles: tuple[float, float, float, float], p2: float) -> None:
    # r1 = 1 m; the table was computed with 9.81 m/s²
    alpha1, alpha3, phi, beta = angles
    r3 = np.cos(np.radians(alpha1)) / np.cos(np.radians(alpha3))
    rest = two_contacts_at_rest(
        Block.from_angles(alpha1, alpha3, float(r3)),
        confined=False,
        beta_deg=beta,
        phis_deg=(phi, phi),
        functions=SCALAR,
        trigonometry=math,
    )
    assert rest * 9.81 / 9.80665 == pytest.approx(p2, abs=1e-6)
