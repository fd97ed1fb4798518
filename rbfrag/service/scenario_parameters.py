"""The block and the measures of the motion, as `predict` takes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rbfrag.service.parameters import Parameter

P2 = Parameter(
    "p2",
    "number",
    "Frequency parameter p² of the block [1/s²].",
    3.0,
    {"exclusiveMinimum": 0},
    required=True,
)
KR = Parameter(
    "kr",
    "number",
    "Rocking acceleration coefficient k_r = tan(critical angle) [g].",
    0.1,
    {"exclusiveMinimum": 0},
    required=True,
)
MEASURES = (
    Parameter("pgv", "number", "Peak ground velocity [m/s].", 0.6, {"minimum": 0}),
    Parameter("pga", "number", "Peak ground acceleration [g].", None, {"minimum": 0}),
    Parameter("tm", "number", "Mean period [s].", None, {"exclusiveMinimum": 0}),
    Parameter("pgd", "number", "Peak ground displacement [m].", None, {"minimum": 0}),
)
MODEL = Parameter(
    "model",
    "string",
    "Name of a stored model. Default: the database's default if the given measures suffice for "
    "it, else the best that they suffice for.",
    None,
    {"minLength": 1},
)
LEVEL = Parameter(
    "level",
    "number",
    "Confidence level of the interval.",
    None,
    {"exclusiveMinimum": 0, "exclusiveMaximum": 1, "default": 0.95},
)

KEYWORD = {"pgv": "pgv_m_s", "pga": "pga_g", "tm": "tm_s", "pgd": "pgd_m"}
"""Keywords of :func:`rbfrag.predict` by the names of the parameters."""


def measures_in(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the measures among some values, by the keywords of :func:`rbfrag.predict`."""
    return {keyword: values[name] for name, keyword in KEYWORD.items() if name in values}
