"""`rbfrag scenario`: shaking at a site in a scenario earthquake."""

from __future__ import annotations

from typing import Annotated

from rbfrag.cli import options
from rbfrag.cli.command import Fields, Inputs
from rbfrag.cli.output import print_result
from rbfrag.vocabulary.quantities import SOURCE

EXAMPLE = "Example:  rbfrag scenario --magnitude 6.8 --rjb 12 --vs30 760 --mechanism reverse"

_SITE = ("rjb_km", "vs30_m_s", "amplification", "amplification_sigma")


def scenario(
    *,
    inputs: Annotated[Inputs, Fields("magnitude", *_SITE)],
    source: Annotated[Inputs, Fields(*SOURCE)],
    json: options.Json = False,
) -> None:
    """Print median and dispersion of the shaking in an earthquake.

    Boore et al. (2014), for the median over all directions (RotD50); predict adds the dispersion of
    a single component, 0.16 in ln. tau is the between-event standard deviation.
    """
    from rbfrag.question.scenario import Source, scenario_shaking

    print_result(scenario_shaking(inputs, Source(**source)), json=json)
