"""`rbfrag shakemap`: probability of failure of blocks over a ShakeMap."""

from __future__ import annotations

from dataclasses import replace

from rbfrag.cli import options
from rbfrag.cli.command import argument, option
from rbfrag.cli.inputs import BlocksOrRockMass
from rbfrag.cli.output import ProgressBar, check_files, print_result, write_table
from rbfrag.errors import InputError
from rbfrag.results.diagnostic import as_documents

EXAMPLE = (
    "Example:  rbfrag shakemap grid.xml --height 2.4 --width 0.5 --out map.geojson --plot map.png"
)

TABLES = (".csv", ".xlsx", ".parquet")
RASTERS = (".tif", ".tiff")
SUFFIXES = (".geojson", ".json", *TABLES, ".gpkg", *RASTERS)


def shakemap(
    *,
    grid: str = argument("ShakeMap grid, version 3 or 4", metavar="GRID.xml"),
    out: str = option(
        "Output file: .geojson, .csv, .xlsx (extra excel), .parquet, .gpkg or, for nodes, "
        ".tif (extra gis)",
        ...,
    ),
    excel_text: options.ExcelText = False,
    inputs: options.Block,
    blocks: BlocksOrRockMass,
    uncertainty: str | None = option(
        "uncertainty.xml of the same map, over which P is integrated", metavar="FILE"
    ),
    component: str = option(
        "Horizontal component of the intensity measures of the map: larger (as ShakeMap), "
        "rotd100, rotd50, geometric_mean or single",
        "larger",
    ),
    allow_partial: bool = option("Accept a grid whose size differs from its declaration", False),
    draws: int | None = option(
        "Number of draws of shaking and blocks [default: 100, more for few blocks]"
    ),
    seed: int = option("Seed of the draws", 0),
    answering: options.Answering,
    n: int = option("Number of realisations of the rock mass", 200),
    plot: str | None = option("Figure of the map (.png, .pdf, .svg)"),
    verbose: options.Verbose = False,
    json: options.Json = False,
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
    several = blocks.collect(inputs, n=n, reads=(*PLACE, "weight", "count"), one_kind=True)
    if target.suffix.lower() in RASTERS and "lon" in several.columns:
        raise InputError(
            f"{target}: GeoTIFF is supported for grid nodes only, not for blocks with "
            "coordinates: use .gpkg or .csv"
        )
    with ProgressBar("shakemap", "draws") as bar:
        answer = answered(
            grid, blocks=several.question, uncertainty=uncertainty, component=component,
            allow_partial=allow_partial, draws=draws, seed=seed, **answering, on_progress=bar.show,
        )  # fmt: skip
    warnings = (*several.remarks, *answer.warnings)
    answer = replace(answer, warnings=warnings, file=str(target))
    about = {**answer.about, "warnings": [*warnings], "notes": as_documents(warnings)}
    columns, suffix = dict(answer.columns), target.suffix.lower()
    if suffix in TABLES:
        write_table(columns, target, excel_text=excel_text, notes=warnings)
    elif suffix == ".gpkg":
        from rbfrag.exchange.map_files import write_geopackage

        write_geopackage(columns, "toppling_probability", target, warnings)
    elif suffix in RASTERS:
        from rbfrag.exchange.map_files import write_geotiff

        write_geotiff(columns, {**about, "warnings": "; ".join(warnings), "notes": None}, target)
    else:
        from rbfrag.exchange.map_files import write_points

        write_points(columns, about, target)
    if plot is not None:
        from rbfrag.plots.plot import shakemap as draw

        draw(answer, plot)
    print_result(answer, json=json, verbose=verbose, fields=())
