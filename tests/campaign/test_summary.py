"""A campaign in words."""

from __future__ import annotations

import pytest

from rbfrag.campaign.summary import CampaignSummary


@pytest.mark.parametrize(
    ("summary", "sentence"),
    [
        (
            CampaignSummary("toppling", 24, found=20, below_limit=4),
            "24 combinations of kind toppling stored: 20 with a critical value, 4 in which nothing "
            "fails down to the search limit",
        ),
        (
            CampaignSummary("toppling", 24, found=24, resumed=12),
            "24 combinations of kind toppling stored, 12 of them before: 24 with a critical value",
        ),
        (CampaignSummary("sliding", 1), "1 combination of kind sliding stored: none"),
    ],
)
def test_combinations_are_counted_by_status(summary: CampaignSummary, sentence: str) -> None:
    assert summary.headline() == sentence
