"""Hazard curves out of a file, whichever tool wrote it."""

from __future__ import annotations

import os

from rbfrag.errors import InputError
from rbfrag.exchange.curves.nshm import is_nshm_curve, nshm_curves
from rbfrag.exchange.curves.openquake import is_openquake_curve, openquake_curves
from rbfrag.exchange.curves.table import table_curves
from rbfrag.exchange.source_text import source_text
from rbfrag.hazards.curve import HazardCurve


def read_hazard_curves(
    path: str | os.PathLike[str], *, imt: str | None = None, site: str | None = None
) -> list[HazardCurve]:
    """Return the hazard curves of a file: OpenQuake CSV, USGS NSHM JSON, or two columns.

    Args:
        path: the file.
        imt: only curves of this intensity measure: PGA, PGV, SA(0.5).
        site: only the curve of this site: its number in the file from 1 on, or its name.

    Raises:
        InputError: the file cannot be used, or holds no such curve; the message names the
            line or the element.
    """
    return hazard_curves_in(source_text(path, "a hazard curve"), str(path), imt=imt, site=site)


def hazard_curves_in(
    text: str, source: str, *, imt: str | None = None, site: str | None = None
) -> list[HazardCurve]:
    """Return the hazard curves of a file's text.

    Args:
        text: what the file holds.
        source: what messages call it.
        imt: as for :func:`read_hazard_curves`.
        site: as for :func:`read_hazard_curves`.

    Raises:
        InputError: as for :func:`read_hazard_curves`.
    """
    if is_openquake_curve(text):
        curves = openquake_curves(text, source)
    elif is_nshm_curve(text):
        curves = nshm_curves(text, source)
    else:
        curves = table_curves(text, source)
    if imt is not None:
        curves = _of_imt(curves, imt, source)
    if site is not None:
        curves = _of_site(curves, site, source)
    return curves


def _of_imt(curves: list[HazardCurve], imt: str, source: str) -> list[HazardCurve]:
    wanted = imt.replace(" ", "").upper()
    found = [curve for curve in curves if curve.imt.upper() == wanted]
    if not found:
        have = ", ".join(dict.fromkeys(curve.imt for curve in curves))
        raise InputError(f"{source}: there is no curve of {imt}; there are {have}")
    return found


def _of_site(curves: list[HazardCurve], site: str, source: str) -> list[HazardCurve]:
    named = [curve for curve in curves if curve.site == site]
    if named:
        return named
    places = list(dict.fromkeys((curve.site, curve.lon, curve.lat) for curve in curves))
    if site.isdigit() and 1 <= int(site) <= len(places):
        place = places[int(site) - 1]
        return [curve for curve in curves if (curve.site, curve.lon, curve.lat) == place]
    raise InputError(
        f"{source}: there is no site {site!r}; give a number from 1 to {len(places)}, or a name"
    )


def suited_curves(
    curves: list[HazardCurve], *, with_mean_period: bool, converted_period_s: float | None
) -> list[HazardCurve]:
    """Return the curves that a fragility can be integrated over, of one measure.

    PGV if there is such a curve; else PGA if the mean period is known; else the spectral
    acceleration that a conversion to PGV has been asked for.

    Args:
        curves: curves of a file, one or more measures.
        with_mean_period: whether the mean period is known.
        converted_period_s: period of the spectral acceleration to be converted, or None.

    Raises:
        InputError: several measures, and none of them is called for.
    """
    measures = list(dict.fromkeys((curve.measure, curve.period_s) for curve in curves))
    if len(measures) == 1:
        return curves
    wanted: list[tuple[str, float | None]] = [("pgv_m_s", None)]
    if converted_period_s is not None:
        wanted = [("sa_g", converted_period_s)]
    elif with_mean_period:
        wanted.append(("pga_g", None))
    for choice in wanted:
        if choice in measures:
            return [curve for curve in curves if (curve.measure, curve.period_s) == choice]
    have = ", ".join(dict.fromkeys(curve.imt for curve in curves))
    raise InputError(
        f"the file has curves of {have}: choose one with --imt; PGA needs --tm, a spectral "
        "acceleration --convert"
    )
