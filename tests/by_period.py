"""Spectral accelerations of a question as the interfaces take them."""

from typing import Any

from rbfrag.vocabulary.spectral import input_of, period_of


def by_period(question: dict[str, Any], mark: str = "") -> dict[str, Any]:
    """Return a question with ``sa_g`` and ``sa_sigma`` in place of ``sa(0.5)`` and its sigma.

    Args:
        question: fields by name.
        mark: between period and value in a list of texts; empty for mappings as in JSON.
    """
    result: dict[str, Any] = {}
    for field, value in question.items():
        if (of := input_of(field)) == field:
            result[field] = value
            continue
        period = f"{period_of(field.removesuffix('_sigma')):g}"
        if mark:
            result.setdefault(of, []).append(f"{period}{mark}{value}")
        else:
            result.setdefault(of, {})[period] = value
    return result
