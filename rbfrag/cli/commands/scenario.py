"""`rbfrag scenario`: the shaking of an earthquake at a site."""

from __future__ import annotations

from typing import Annotated

from rbfrag.cli.output import print_json, print_sentences, print_table
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.stack import Given, fields_of, stacked
from rbfrag.results.numbers import rounded
from rbfrag.vocabulary.quantities import QUANTITIES, SOURCE

EXAMPLE = "Example:  rbfrag scenario --magnitude 6.8 --rjb 12 --vs30 760 --mechanism reverse"

_SITE = ("rjb_km", "vs30_m_s", "amplification", "amplification_sigma")


@stacked
def scenario(
    *,
    given: Annotated[Given, fields_of("magnitude", *_SITE)],
    source: Annotated[Given, fields_of(*SOURCE)],
    json: options.Json = False,
) -> None:
    """Print the shaking of an earthquake at a site, and its scatter.

    After Boore et al. (2014), for the median over all directions (RotD50); predict adds the scatter
    of a single component, 0.16 in ln. tau is what all sites of an earthquake share.
    """
    from rbfrag.question.scenario import Source, in_numbers

    measures = in_numbers(given, Source(**source))
    if json:
        print_json(measures)
        return
    name, first = next(iter(measures.items()))
    low, median, high = (rounded(first[each]) for each in ("p16", "median", "p84"))
    unit = QUANTITIES[name].unit
    print_sentences(
        [
            f"The {QUANTITIES[name].noun} is {median} {unit} in the median, and {low} to {high} "
            f"{unit} in two of three cases."
        ]
    )
    abouts = {name: QUANTITIES[name] for name in measures}
    rows = [
        [abouts[name].noun, *(float(f"{each:.4g}") for each in of.values()), abouts[name].unit]
        for name, of in measures.items()
    ]
    print_table(("measure", "median", "p16", "p84", "sigma", "tau", "phi", "unit"), rows)
