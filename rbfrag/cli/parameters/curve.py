"""Options that say what a hazard curve means."""

from __future__ import annotations

from dataclasses import dataclass

from rbfrag.cli.parameters.stack import option


@dataclass(frozen=True, kw_only=True)
class CurveOptions:
    """What a hazard curve means."""

    imt: str | None = option("Intensity measure of the curve: PGV, PGA, 'SA(1.0)'.")
    site: str | None = option("Site of the file: its number from 1 on, or its name.")
    convert: str | None = option(
        "Published conversion of a spectral acceleration to PGV: newmark_hall_1982 "
        "(SA(1)) or bommer_alarcon_2006 (SA(0.5)); its scatter is integrated."
    )
    convert_sigma: float | None = option(
        "Standard deviation of ln PGV about the conversion. Default: that of the reference's "
        "motions."
    )
    component: str | None = option(
        "What the curve's horizontal component means: single, geometric_mean, rotd50 or larger. "
        "Left out: single, with a warning."
    )
