"""`report`: a question about one block and its answer as a page to attach."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

from rbfrag.errors import InputError
from rbfrag.files import output_path
from rbfrag.fragility.measures import spectral
from rbfrag.hazards.curve_file import CurveLike
from rbfrag.plots.canvas import new_figure
from rbfrag.plots.report.contents import Contents, RateQuestion, contents_of
from rbfrag.plots.report.sheet import write_sheet
from rbfrag.plots.report.web_page import write_html
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.described import DescribedBlock

SUFFIXES = (".pdf", ".png", ".html")
"""Forms of a report."""

TITLE = "Seismic fragility of a rock block"


def report(
    out: str | PathLike[str],
    *,
    p2: float | None = None,
    kr: float | None = None,
    block: Block | None = None,
    beta_deg: float = 0.0,
    phi_deg: float | None = None,
    phi_back_deg: float | None = None,
    back_fracture: bool = True,
    kind: str | None = None,
    restitution: float | None = None,
    pgv_m_s: float | None = None,
    pga_g: float | None = None,
    tm_s: float | None = None,
    pgd_m: float | None = None,
    sa_g: Mapping[float, float] | None = None,
    curve: CurveLike | None = None,
    imt: str | None = None,
    site: str | None = None,
    component: str | None = None,
    years: float = 50.0,
    title: str = TITLE,
    date: str = "",
    model: str | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
) -> Path:
    """Write one page about one block: sentence, drawing, inputs, chart, curve, rate, versions.

    The same question gives the same file, byte for byte, with the same versions of rbfrag and
    matplotlib.

    Args:
        out: file to write: .pdf or .png (a page of A4), or .html (one file that needs no other).
        p2: frequency parameter p² of the block [1/s²], with kr.
        kr: its rocking acceleration coefficient.
        block: the block by its shape, instead.
        beta_deg: with block: dip of its base, out of the slope positive [deg].
        phi_deg: with block: friction angle of the base [deg]; None for a block that is taken to
            topple.
        phi_back_deg: with block: that of the back plane [deg]; None for that of the base.
        back_fracture: with block: whether a plane backs it.
        kind: how it fails, backed by a slope or free-standing; None for what the block is.
        restitution: of a block that rocks: speed after an impact over that before it.
        pgv_m_s: peak ground velocity [m/s].
        pga_g: peak ground acceleration [g].
        tm_s: mean period [s].
        pgd_m: peak ground displacement [m].
        sa_g: spectral accelerations [g] by period [s].
        curve: hazard curve, or its file, for the annual rate.
        imt: measure of the curve to take of a file that holds several.
        site: its site, likewise.
        component: what the curve's horizontal component means, as in :func:`rbfrag.hazard`.
        years: period of the probability [a].
        title: title of the page.
        date: date that is printed on it; nothing is, if empty.
        model: name of the model; None for the best for what is given.
        level: level of all intervals.
        db: database of the models, as in :func:`rbfrag.predict`.

    Returns:
        The path.

    Raises:
        InputError: a question that cannot be answered, a kind without such curves (sliding,
            slumping), or a path that cannot be written.
    """
    described = None
    if block is not None:
        if p2 is not None or kr is not None:
            raise InputError("block does not go with p2 and kr: a block is described once")
        planes = {"phi_deg": phi_deg, "phi_back_deg": phi_back_deg}
        described = DescribedBlock(
            block,
            {
                "beta_deg": beta_deg,
                "back_fracture": back_fracture,
                **{name: value for name, value in planes.items() if value is not None},
            },
        )
    stated = {
        "p2": p2, "kr": kr, "restitution": restitution, "pgv_m_s": pgv_m_s, "pga_g": pga_g,
        "tm_s": tm_s, "pgd_m": pgd_m,
    }  # fmt: skip
    given = {name: value for name, value in stated.items() if value is not None}
    given |= spectral(sa_g or {})
    write_report(
        out, described, given, kind=kind, model=model, level=level, db=db, title=title, date=date,
        rate=RateQuestion(curve, imt, site, component, years=years),
    )  # fmt: skip
    return Path(out)


def write_report(
    out: str | PathLike[str],
    described: DescribedBlock | None,
    given: Mapping[str, float],
    *,
    kind: str | None = None,
    rate: RateQuestion | None = None,
    title: str = TITLE,
    date: str = "",
    model: str | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
) -> Contents:
    """Write the report of a block that is described or of which numbers are given.

    Args:
        out: file to write.
        described: the block by its shape; None for one that `given` has p2 and kr of.
        given: numbers of the block and measures of the motion, by the names of `predict`.
        kind: as for :func:`report`.
        rate: how often a year the block is asked to fail; None for one shaking alone.
        title: as for :func:`report`.
        date: as for :func:`report`.
        model: as for :func:`report`.
        level: as for :func:`report`.
        db: as for :func:`report`.

    Returns:
        What the report says.
    """
    target = output_path(out, SUFFIXES, "report")
    new_figure()  # says which extra is missing, before long work
    contents = contents_of(
        described, given, kind=kind, rate=rate or RateQuestion(), model=model, level=level, db=db
    )
    write = write_html if target.suffix.lower() == ".html" else write_sheet
    write(contents, title, date, target)
    return contents
