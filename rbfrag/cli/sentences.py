"""Answers in words: the number that decides, rounded as an engineer would write it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rbfrag.results.numbers import percent, rounded, with_interval


def rock_mass_in_words(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield how the blocks of a rock mass fail, and how many under the shaking that is given.

    Args:
        document: an answer of `rbfrag rockmass` under the keys of the JSON contract.
    """
    shares = {name: tally["share"] for name, tally in document["modes"].items()}
    most = sorted((name for name in shares if shares[name] > 0.0), key=lambda n: -shares[n])
    parts = [f"{name.replace('_', ' ')} {percent(shares[name])}" for name in most]
    yield f"Failure modes of {document['blocks']:,} blocks: {', '.join(parts) or 'none'}"
    answer, shaking = document["scenario"], document["shaking"]
    if answer is not None and answer["covered_only"]["probability"] is not None:
        total = answer["covered_only"]
        yield (
            "Mean P(failure) = "
            f"{with_interval(total['probability'], total['ci_low'], total['ci_high'])} for the "
            f"{percent(answer['covered_share'])} of the blocks that a fragility model covers"
        )
        drained = total["drained"] or {"probability": None}
        if drained["probability"] is not None and document["drainage"] == "undrained":
            ends = (drained[name] for name in ("probability", "ci_low", "ci_high"))
            yield f"Drained: {with_interval(*ends)}."
    for scale in () if shaking is None else shaking["scales"]:
        of_all = scale["all"]["fails_of_all"]
        unknown = scale["all"]["open_of_all"]
        yield (
            f"{shaking['motion']} × {scale['scale']:g}: "
            f"{with_interval(of_all['share'], of_all['ci_low'], of_all['ci_high'])} of the blocks "
            f"fail" + (f"; {percent(unknown)} undetermined" if unknown else "")
        )


def strongest_kr(spectrum: Mapping[str, Any]) -> list[float]:
    """Return k_r of the block of each size whose toppling velocity k_r g/p is X(p).

    Args:
        spectrum: an answer of `rbfrag spectrum` under the keys of the JSON contract.
    """
    from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

    pairs = zip(spectrum["p2"], spectrum["x_m_s"], strict=True)
    return [x * p2**0.5 / STANDARD_GRAVITY_M_S2 for p2, x in pairs]


def spectrum_in_words(spectra: Sequence[Mapping[str, Any]]) -> str:
    """Return what a motion can topple.

    Args:
        spectra: the answers of `rbfrag spectrum` for one motion, one a polarity.
    """
    first = spectra[0]
    largest = [max(some) for some in zip(*map(strongest_kr, spectra), strict=True)]
    sizes = [
        f"{rounded(kr)} at p² = {p2:g} 1/s²" for p2, kr in zip(first["p2"], largest, strict=True)
    ]
    ends = sizes[0] if len(sizes) == 1 else f"{sizes[0]} to {sizes[-1]}"
    return f"{first['name']} (PGV {rounded(first['pgv_m_s'])} m/s): critical k_r, to 2 %, {ends}"


def motion_in_words(document: Mapping[str, Any], *, flags: int) -> str:
    """Return how strong and how long a motion is.

    Args:
        document: an answer of `rbfrag motions show` under the keys of the JSON contract.
        flags: number of quality flags.
    """
    treated = "processed here" if document["processing_applied"] else "as its file has it"
    marks = "no quality flag" if not flags else f"{flags} quality flag{'s' if flags > 1 else ''}"
    return (
        f"{document['name']}: PGA {rounded(document['pga_g'])} g, PGV "
        f"{rounded(document['pgv_m_s'])} m/s in {document['duration_s']:.4g} s; {treated}, {marks}."
    )
