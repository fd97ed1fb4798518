"""`report`: a question about one block and its answer as a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, TypedDict, Unpack

from rbfrag.files import output_path
from rbfrag.fragility.measures import spectral
from rbfrag.hazards.branches import Weights
from rbfrag.hazards.curve import CurveKeywords
from rbfrag.hazards.curve_file import CurveLike
from rbfrag.plots.canvas import new_figure
from rbfrag.plots.report.contents import RateQuestion, Report, report_of
from rbfrag.plots.report.sheet import write_sheet
from rbfrag.plots.report.web_page import write_html
from rbfrag.question.fields import BlockKeywords, RangeFields, ShakingFields, SourceFields
from rbfrag.question.keywords import parts_of
from rbfrag.vocabulary.quantities import BLOCKS, RANGE, SHAKING, SOURCE

SUFFIXES = (".pdf", ".png", ".html")
"""Forms of a report."""

TITLE = "Seismic fragility of a rock block"


class _Spectrum(TypedDict, total=False):
    """Spectral accelerations by their period."""

    sa_g: Mapping[float, float] | None


class _Scenario(ShakingFields[float | None], SourceFields, RangeFields, total=False):
    """Keywords of the shaking or of a scenario, and of the model."""

    rotation_deg: float | None


class ReportKeywords(BlockKeywords[float | None], _Scenario, _Spectrum, CurveKeywords, total=False):
    """Keywords of a report: block, shaking, hazard curve and model."""


def report(
    out: str | PathLike[str],
    *,
    curve: CurveLike | Sequence[CurveLike] | None = None,
    weights: Weights | None = None,
    years: float = 50.0,
    title: str = TITLE,
    date: str = "",
    **question: Unpack[ReportKeywords],
) -> Path:
    """Write one page about one block: headline, drawing, inputs, chart, curve, rate, versions.

    The same question gives the same file, byte for byte, with the same versions of rbfrag and
    matplotlib.

    Args:
        out: file to write: .pdf or .png (a page of A4), or .html (one file that needs no other).
        curve: hazard curve, or its file, for the annual rate; or several of a logic tree.
        weights: weights of several curves, as in :func:`rbfrag.hazard`.
        years: period of the probability [a].
        title: title of the page.
        date: date that is printed on it; nothing is, if empty.
        question: fields of block and shaking or scenario, ``sa_g`` and ``kind``, ``model`` (a
            name), ``level``, ``sites`` and ``db`` as :func:`rbfrag.predict` has them; ``imt``,
            ``site``, ``convert`` and ``convert_sigma`` of the curve as :func:`rbfrag.hazard` has
            them; ``component`` of the measures and of the curve.

    Returns:
        The path.

    Raises:
        InputError: a question that cannot be answered, or a path that cannot be written.
        UnknownFieldError: a keyword that is none.
    """
    block, shaking, spectrum, meaning = parts_of(
        (),
        question,
        BLOCKS,
        (*SHAKING, *SOURCE, *RANGE, "rotation_deg"),
        ("sa_g",),
        CurveKeywords.__optional_keys__,
    )
    request = {**block, **shaking, **spectral(spectrum.get("sa_g") or {})}
    if (component := meaning.get("component")) is not None:
        request["component"] = component
    rate = RateQuestion(curve, years, meaning, weights)
    write_report(out, [request], rate, title=title, date=date)
    return Path(out)


def write_report(
    out: str | PathLike[str],
    rows: Sequence[Mapping[str, Any]],
    rate: RateQuestion | None = None,
    *,
    title: str = TITLE,
    date: str = "",
    warnings: Sequence[str] = (),
    **answering: Unpack[RangeFields],
) -> Report:
    """Write the report of blocks, each given by a row of fields, and return its contents.

    Args:
        warnings: what to know about the table of the blocks.
    """
    target = output_path(out, SUFFIXES, "report")
    new_figure()  # says which extra is missing, before long work
    contents = report_of(rows, rate, warnings, **answering)
    write = write_html if target.suffix.lower() == ".html" else write_sheet
    write(contents, title, date, target)
    return contents
