"""Answers in words: the number that decides, rounded as an engineer would write it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rbfrag.results.numbers import rounded


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
