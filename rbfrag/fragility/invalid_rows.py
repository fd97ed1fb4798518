"""Invalid rows of block tables: the reason for each, their number and the messages.

Every command that takes many blocks answers those that it can, gives the others NaN and the reason,
and says by :func:`describe_invalid` how many they are. An answer that needs all of them, or a
table of which none can be used, is rejected by :func:`reject`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.method import BlockParameters, arrays
from rbfrag.fragility.validation import Remark, rejections
from rbfrag.results.diagnostic import Diagnostic

FROM_SUMS = " and are left out of all sums, which are lower bounds"
"""What becomes of such blocks where numbers of several are added."""

FROM_MEAN = " and are left out of the mean"
"""The same where the answer is a mean over blocks."""

FIRST = 6
"""So many of them are named."""

_MOST_CHARACTERS = 260


def block_reasons(
    block: BlockParameters, values: Mapping[str, NDArray[np.float64]]
) -> NDArray[np.object_]:
    """Return why blocks cannot fail in an earthquake, in the words of `predict`; empty where they
    can.

    Args:
        values: parameters of the block, options and standard deviations, if there are any, by the
            names of :func:`rbfrag.predict`, shape (m,) each; an option may be NaN for the block's
            own.
    """
    reasons = np.full(values[block.strength].shape, "", dtype=object)

    def say(holds: Any, finding: Remark) -> None:
        for i in np.flatnonzero(holds & (reasons == "")).tolist():
            value = float(finding.value[i])
            reasons[i] = finding.in_general() if value != value else finding.about(value)

    names = [name for name in (*block.options, *block.sigmas) if name in values]
    with np.errstate(all="ignore"):
        filled = block.filled(values)
        for finding in rejections(filled, (*block.names, *names), (block.strength, *block.options)):
            say(finding.holds, finding)
        at_rest = Remark(
            filled[block.strength] <= 0.0, block.strength, filled[block.strength],
            "is not above zero: the block is unstable and fails without an earthquake",
        )  # fmt: skip
        say(at_rest.holds, at_rest)
        adjusted = dict(filled)
        if block.adjust is not None:
            block.adjust(adjusted, arrays())
        for bound in block.rejects:
            if bound.about in names:
                finding = Remark(
                    bound.holds(adjusted), bound.about, filled[bound.about], bound.text
                )
                say(finding.holds, finding)
    return reasons


def describe_invalid(
    count: int, total: int, labels: Sequence[str], reasons: Sequence[str], effect: str = ""
) -> tuple[Diagnostic, ...]:
    """Describe the rejected blocks; empty if there are none.

    Args:
        labels: where they stand, or the first.
        reasons: why they could not be used.
        effect: what becomes of them in numbers of several blocks; those of a mean have no row.
    """
    if not count:
        return ()
    number = f"{count:,} of {total:,} blocks could not be used{effect}"
    if effect == FROM_MEAN:
        return (Diagnostic(f"{number}: {in_list(labels, reasons)}", "rows_rejected"),)
    which = "it is" if count == 1 else "the first is"
    text = f"{number}; the reasons stand in the column reason; {which} {labels[0]}: {reasons[0]}"
    return (Diagnostic(text, "rows_rejected"),)


def reject(
    source: str, labels: Sequence[str], reasons: Sequence[str], total: int, why: str = ""
) -> NoReturn:
    """Reject a table in which some or all blocks are invalid.

    Args:
        source: what messages call them.
        labels: where those stand that cannot be used; if none can, of the first.
        reasons: why each cannot be used.
        why: why the others do not do; empty where there are no others.
    """
    if not why or len(labels) == total:
        listed = in_list(labels[:FIRST], reasons[:FIRST])
        if total == 1:
            raise InputError(f"{source}: invalid block: {listed}")
        more = f", the first {FIRST}" if total > FIRST else ""
        raise InputError(f"{source}: none of {total:,} blocks is valid{more}: {listed}")
    raise InputError(
        f"{source}: {len(labels):,} of {total:,} blocks are invalid, and {why}: "
        f"{in_list(labels, reasons)}: correct or remove these rows"
    )


def reject_elements(
    reasons: NDArray[np.object_], why: str = "", fields: Collection[str] = ()
) -> None:
    """Reject arrays with invalid elements; without `why` only if all are invalid.

    Args:
        reasons: of each element, empty where it can be used, shape (m,).
        why: why the others do not do.
        fields: fields in the reason that each interface prints in its own spelling.
    """
    wrong = elements(reasons)
    if reasons.size == 1 and wrong:
        raise InputError(reasons[0], fields=fields)
    if wrong and (why or len(wrong) == reasons.size):
        reject("blocks", wrong, [text for text in reasons.tolist() if text], reasons.size, why)


def elements(reasons: NDArray[np.object_]) -> list[str]:
    """Return the indices of invalid elements of an array."""
    return [f"element {i}" for i in np.flatnonzero(reasons != "").tolist()]


def in_list(labels: Iterable[str], reasons: Iterable[str]) -> str:
    """Describe blocks with their reasons in one phrase: grouped by reason, as many as fit.

    Args:
        labels: where each stands, as "line 3 (block A7)".
        reasons: why it cannot be used.
    """
    alike: dict[str, list[str]] = {}
    for place, reason in zip(labels, reasons, strict=True):
        alike.setdefault(reason, []).append(place)
    text, unlisted = "", sum(map(len, alike.values()))
    for reason, members in alike.items():
        more = f" and {len(members) - FIRST:,} more" if len(members) > FIRST else ""
        phrase = f"{', '.join(members[:FIRST])}{more}: {reason}"
        if text and len(text) + len(phrase) > _MOST_CHARACTERS:
            break
        text += f"{'; ' if text else ''}{phrase}"
        unlisted -= len(members)
    return text + (f"; and {unlisted:,} more" if unlisted else "")
