"""`rbfrag shakemap`: probability of failure of blocks over a ShakeMap."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from rbfrag.cli.output import ProgressBar, check_files, print_result, write_table
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import BlocksOptions
from rbfrag.cli.parameters.option_groups import argument, option, stacked
from rbfrag.errors import InputError
from rbfrag.results.diagnostic import as_documents

EXAMPLE = (
    "Example:  rbfrag shakemap grid.xml --height 2.4 --width 0.5 --out map.geojson --plot map.png"
)

TABLES = (".csv", ".xlsx", ".parquet")
RASTERS = (".tif", ".tiff")
SUFFIXES = (".geojson", ".json", *TABLES, ".gpkg", *RASTERS)


@dataclass(frozen=True, kw_only=True)
class MapOptions:
    """Interpretation of a ShakeMap."""

    uncertainty: str | None = option(
        "uncertainty.xml of the same map, over which P is integrated", metavar="FILE"
    )
    component: str = option(
        "Horizontal component of the intensity measures of the map: larger (as ShakeMap), "
        "rotd100, rotd50, geometric_mean or single",
        "larger",
    )
    allow_partial: bool = option("Accept a grid whose size differs from its declaration", False)


@dataclass(frozen=True, kw_only=True)
class DrawOptions:
    """Sampling of the number of failures."""

    draws: int | None = option(
        "Number of draws of shaking and blocks [default: 100, more for few blocks]"
    )
    seed: int = option("Seed of the draws", 0)


@stacked
def shakemap(
    *,
    grid: str = argument("ShakeMap grid, version 3 or 4", metavar="GRID.xml"),
    out: str = option(
        "Output file: .geojson, .csv, .xlsx (extra excel), .parquet, .gpkg or, for nodes, "
        ".tif (extra gis)",
        ...,
    ),
    excel_text: bool = option(options.EXCEL_TEXT, False),
    inputs: options.Block,
    blocks: BlocksOptions,
    meaning: MapOptions,
    drawing: DrawOptions,
    answering: options.Answering,
    n: int = option("Number of realisations of the rock mass", 200),
    plot: str | None = option("Figure of the map (.png, .pdf, .svg)"),
    printing: options.Printing,
) -> None:
    """Map the probability of failure of blocks over a ShakeMap.

    A single block, a table without lon and lat, or a rock mass is evaluated at every node; a table
    with lon and lat [deg] is evaluated block by block. The model is the best supported by the
    intensity measures of the map: PGV and PGA, or PGA with spectral accelerations. Toppling blocks
    are backed by a rock face; free-standing blocks overturn at weaker shaking: --kind rocking. The
    total number of failures is sampled.
    """
    from rbfrag.exchange.block_rows import PLACE
    from rbfrag.exchange.map_answer import shakemap as answered
    from rbfrag.files import output_path

    target = output_path(out, SUFFIXES, "map")
    check_files(table=out if excel_text else None, plot=plot, excel_text=excel_text)
    several = blocks.collect_blocks(inputs, n=n, reads=(*PLACE, "weight", "count"), one_kind=True)
    if target.suffix.lower() in RASTERS and "lon" in several.columns:
        raise InputError(
            f"{target}: GeoTIFF is supported for grid nodes only, not for blocks with "
            "coordinates: use .gpkg or .csv"
        )
    with ProgressBar("shakemap", "draws") as bar:
        answer = answered(
            grid, blocks=several.question, uncertainty=meaning.uncertainty,
            component=meaning.component, allow_partial=meaning.allow_partial, draws=drawing.draws,
            seed=drawing.seed, **answering, on_progress=bar.show,
        )  # fmt: skip
    warnings = (*several.remarks, *answer.warnings)
    answer = replace(answer, warnings=warnings, file=str(target))
    about = {**answer.about, "warnings": [*warnings], "notes": as_documents(warnings)}
    _write(dict(answer.columns), about, target, excel_text=excel_text)
    if plot is not None:
        from rbfrag.plots.plot import shakemap as draw

        draw(answer, plot)
    print_result(answer, json=printing.json, verbose=printing.verbose, fields=())


def _write(
    columns: dict[str, Any], about: dict[str, Any], target: Any, *, excel_text: bool
) -> None:
    suffix = target.suffix.lower()
    notes = about["warnings"]
    if suffix in TABLES:
        write_table(columns, target, excel_text=excel_text, notes=notes)
    elif suffix == ".gpkg":
        from rbfrag.exchange.points import write_geopackage

        write_geopackage(columns, "toppling_probability", target, notes)
    elif suffix in RASTERS:
        from rbfrag.exchange.geotiff import write_geotiff

        write_geotiff(columns, {**about, "warnings": "; ".join(notes), "notes": None}, target)
    else:
        from rbfrag.exchange.points import write_points

        write_points(columns, about, target)
