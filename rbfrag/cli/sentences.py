"""Answers in words: the number that decides, rounded as an engineer would write it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rbfrag.fragility.words import interval, percent, with_interval

STATUS = {
    "below_limit": "This motion topples no block of this size down to the search limit.",
    "no_motion": "This motion lifts no block of this size down to the search limit off its base.",
    "outside_model": "The motion throws blocks off their base, which the model does not follow.",
}

SCALED_STATUS = {
    "below_limit": "No factor on the motion up to scale_limit brings the block down, as far as it "
    "was looked at.",
    "no_motion": "No factor on the motion up to scale_limit moves the block.",
}

SLIDING_STATUS = {
    "below_limit": "No block down to the search limit slides {:g} m.",
    "no_motion": "No block down to the search limit slides.",
    "outside_model": "The vertical motion throws blocks off their base, which the model does not "
    "follow.",
}


def rounded(value: float) -> str:
    """Return a number with three digits and without an exponent where people write none."""
    if value != 0.0 and not 1e-4 <= abs(value) < 1e7:
        return f"{value:.2g}"
    text = f"{value:#.3g}"
    return f"{float(text):,.0f}" if abs(value) >= 100.0 else text.rstrip(".")


def response_in_words(answer: Mapping[str, Any], advice: str) -> Iterator[str]:
    """Yield how a run ended, with the number that decides.

    Args:
        answer: an answer of `rbfrag respond` under the keys of the JSON contract.
        advice: what its outcome means.
    """
    at_s = answer.get("toppled_s")
    if "started_s" in answer and answer["started_s"] is None and answer["outcome"] == "stable":
        yield "The motion does not move the block: it never exceeds its strength."
        return
    yield (advice if at_s is None else f"At {at_s:.2f} s the block topples. {advice}") + (
        _drained_yield(answer)
    )
    if answer.get("peak_theta_n") is not None:
        ratio = answer["peak_theta_n"]
        yield f"Its greatest rotation is {percent(ratio)} of the critical angle."
    if answer.get("displacement_m") is not None:
        yield f"It is displaced by {rounded(answer['displacement_m'])} m."


MOVES = {
    "slide": "slides",
    "topple": "topples",
    "slump": "slumps",
    "confined_topple": "topples against its back plane",
}
"""What a block does by its failure mode."""


def block_in_words(answer: Mapping[str, Any]) -> str:
    """Return how a block fails, and from which acceleration on.

    Args:
        answer: an answer of `rbfrag block` under the keys of the JSON contract.
    """
    moves = MOVES.get(answer["mode"], answer["mode"])
    if answer["state"] == "locked":
        return f"The block {moves} if at all: no horizontal acceleration moves it."
    if answer["state"] == "unstable":
        return f"The block {moves} at rest, without any earthquake."
    return (
        f"The block {moves} where the ground's horizontal acceleration exceeds "
        f"{rounded(answer['yield_acceleration'])} g.{_drained_yield(answer)}"
    )


def _drained_yield(answer: Mapping[str, Any]) -> str:
    bound = (answer.get("drained") or {}).get("yield_acceleration")
    return "" if bound is None else f" Drained, the yield acceleration is {rounded(bound)} g."


def rock_mass_in_words(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield how the blocks of a rock mass fail, and how many under the shaking that is given.

    Args:
        document: an answer of `rbfrag rockmass` under the keys of the JSON contract.
    """
    shares = {name: tally["share"] for name, tally in document["modes"].items()}
    most = sorted((name for name in shares if shares[name] > 0.0), key=lambda n: -shares[n])
    parts = [f"{percent(shares[name])} would {_MODE_VERBS.get(name, name)}" for name in most]
    yield f"Of {document['blocks']:,} blocks {' and '.join(parts) or 'none could fail'}."
    answer, shaking = document["scenario"], document["shaking"]
    if answer is not None and answer["covered_only"]["probability"] is not None:
        total = answer["covered_only"]
        yield (
            f"Of the blocks that there is a model for, {percent(answer['covered_share'])} of all, "
            f"{with_interval(total['probability'], total['ci_low'], total['ci_high'])} fail under "
            "this shaking."
        )
        drained = total["drained"] or {"probability": None}
        if drained["probability"] is not None and document["drainage"] == "undrained":
            ends = (drained[name] for name in ("probability", "ci_low", "ci_high"))
            yield f"Drained: {with_interval(*ends)}."
    for scale in () if shaking is None else shaking["scales"]:
        of_all = scale["all"]["fails_of_all"]
        unknown = scale["all"]["open_of_all"]
        yield (
            f"{shaking['motion']} times {scale['scale']:g}: of the blocks "
            f"{with_interval(of_all['share'], of_all['ci_low'], of_all['ci_high'])} fail"
            + (f"; of another {percent(unknown)} it is open whether they do." if unknown else ".")
        )


_MODE_VERBS = {
    "slide": "slide",
    "topple": "topple",
    "slump": "slump",
    "confined_topple": "topple against their back plane",
}


def critical_in_words(answer: Mapping[str, Any]) -> str:
    """Return what a search has found.

    Args:
        answer: a critical value under the keys of the JSON contract: k_r/PGA, or a scale.
    """
    if "scale" in answer:
        return _scale_in_words(answer)
    pga_g, certified = answer["pga_g"], answer["certified"]
    if answer["status"] != "found":
        if certified or answer["upper"] is None:
            return STATUS[answer["status"]]
        return (
            "No block of this size was seen to topple down to the search limit; not certified: "
            f"only above k_r = {rounded(answer['upper'] * pga_g)} is it proven."
        )
    ratio = rounded(answer["kr_over_pga"])
    if certified:
        half_width = 0.5 * (answer["upper"] - answer["lower"]) * pga_g
        value = f"k_r = {rounded(answer['kr'])} (± {half_width:.0e}, certified)"
    else:
        ends = f"{rounded(answer['kr'])} and {rounded(answer['upper'] * pga_g)}"
        value = f"a k_r between {ends}, not certified"
        ratio = f"{ratio} to {rounded(answer['upper'])}"
    return (
        f"The strongest block of p² = {answer['p2']:.3g} 1/s² that this motion topples has "
        f"{value}, {ratio} of the PGA of {rounded(pga_g)} g."
    )


def _scale_in_words(answer: Mapping[str, Any]) -> str:
    if answer["scale"] is None:
        return SCALED_STATUS[answer["status"]]
    factor, pga = answer["scale"], answer["scale"] * answer["pga_g"]
    return (
        f"This motion times {rounded(factor)} brings the block down, at a PGA of {rounded(pga)} g."
    )


def slides_in_words(document: Mapping[str, Any]) -> Iterator[str]:
    """Yield what a search for sliding blocks has found: the smallest distance, and what holds."""
    first = document["thresholds"][0]
    if first["status"] == "found":
        yield (
            f"On a level plane, blocks of k_y below {rounded(first['ky'])} slide further than "
            f"{first['displacement_m']:g} m."
        )
    else:
        yield SLIDING_STATUS[first["status"]].format(first["displacement_m"])
    yield "On a base that dips, displacements are cos(phi - beta)/cos(phi) times these."


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
    return (
        f"{first['name']} (PGV {rounded(first['pgv_m_s'])} m/s) topples no block whose k_r is more "
        f"than 2 % above that of its size: {ends}."
    )


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


def answer_in_short(row: Mapping[str, Any]) -> dict[str, object]:
    """Return what people read of the answer for one block of a table.

    Args:
        row: one of ``blocks`` of `rbfrag predict --blocks --json`.
    """
    ends = row["ci_low"], row["ci_high"]
    columns = {"probability": "probability", "drained_probability": "drained"}
    shown = {
        word: None if row[name] is None else percent(row[name])
        for name, word in columns.items()
        if name in row
    }
    return {
        "block": row["block_id"],
        "kind": row["kind"],
        "mode": row["mode"],
        "probability": shown.pop("probability"),
        "interval": None if None in ends else interval(*ends),
        **shown,
        "reason": row["reason"],
    }


def table_in_words(summary: Mapping[str, Any]) -> str:
    """Return how many rows of a table of blocks are answered.

    Args:
        summary: what `rbfrag predict --blocks --json` prints.
    """
    rows, answered, outside = summary["rows"], summary["answered"], summary["without_answer"]
    if not outside:
        return f"All {rows:,} blocks are answered." if rows != 1 else "The block is answered."
    return f"{answered:,} of {rows:,} blocks are answered; {outside:,} without answer."
