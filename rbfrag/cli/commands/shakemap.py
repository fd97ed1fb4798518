"""`rbfrag shakemap`: where blocks topple in one earthquake."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from rbfrag.cli.output import check_files, print_json, print_pairs, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import toppling_blocks
from rbfrag.errors import InputError

EXAMPLE = "Example:  rbfrag shakemap grid.xml --p2 3 --kr 0.1 --out map.geojson --plot map.png"

SUFFIXES = (".geojson", ".json", ".csv", ".parquet", ".gpkg")


def shakemap(
    grid: Annotated[str, typer.Argument(metavar="GRID.xml", help="ShakeMap grid, version 3 or 4.")],
    out: Annotated[
        str,
        typer.Option("--out", help="File to write: .geojson, .csv, .parquet or .gpkg (extra gis)."),
    ],
    p2: options.P2OrFile = None,
    kr: options.KrOrFile = None,
    block: options.BlockFile = None,
    blocks: Annotated[
        str | None,
        typer.Option(
            "--blocks",
            metavar="FILE",
            help="Blocks (.csv, .parquet, .geojson) with p2_1_s2 [1/s²] and kr: with lon and lat "
            "[deg] one answer a block, without them a class that stands at every node.",
        ),
    ] = None,
    rockmass: Annotated[
        str | None,
        typer.Option(
            "--rockmass",
            metavar="FILE",
            help="Rock mass file (.toml, .csv): its stable toppling blocks stand at every node.",
        ),
    ] = None,
    n: Annotated[int, typer.Option("--n", help="Number of realisations of the rock mass.")] = 200,
    uncertainty: Annotated[
        str | None,
        typer.Option(
            "--uncertainty",
            metavar="FILE",
            help="uncertainty.xml of the same map: the answer is integrated over it.",
        ),
    ] = None,
    component: Annotated[
        str,
        typer.Option(
            "--component",
            help="What the map's measures mean: larger (ShakeMap's default), rotd50, "
            "geometric_mean or single.",
        ),
    ] = "larger",
    allow_partial: Annotated[
        bool, typer.Option("--allow-partial", help="Read a grid that has not its declared size.")
    ] = False,
    plot: Annotated[
        str | None, typer.Option("--plot", help="Draw the map (.png, .pdf, .svg).")
    ] = None,
    model: options.Model = None,
    level: options.Level = 0.95,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Write the probability that blocks topple at every node of a ShakeMap, or at each block.

    PGV and PGA of the map are used together where a model knows both.
    """
    import numpy as np

    from rbfrag.exchange.shakemap import at_places, read_shakemap
    from rbfrag.files import output_path
    from rbfrag.hazards.conversions import component as component_named
    from rbfrag.hazards.site_probability import site_probability

    target = output_path(out, SUFFIXES, "map")
    check_files(plot=plot)
    meaning = component_named(component)
    found_blocks, _, remarks = toppling_blocks(p2, kr, block, blocks, rockmass, n=n)
    shaken = read_shakemap(grid, uncertainty=uncertainty, allow_partial=allow_partial)
    warnings = [*remarks, *shaken.warnings]
    own = "lon" in found_blocks
    if own:
        lon, lat = found_blocks["lon"], found_blocks["lat"]
        fields, on_map = at_places(shaken, lon, lat)
        if not on_map.all():
            warnings.append(
                f"{int((~on_map).sum())} of {on_map.size} blocks lie off the map and have no answer"
            )
    else:
        lon, lat = shaken.lon, shaken.lat
        fields = {
            "pgv_m_s": shaken.pgv_m_s,
            "pga_g": shaken.pga_g,
            "std_ln_pgv": shaken.std_ln_pgv,
            "std_ln_pga": shaken.std_ln_pga,
        }
        on_map = np.ones(lon.size, dtype=bool)
    if fields["std_ln_pgv"] is None:
        warnings.append(
            "the map's uncertainty of PGV is not given: its values are taken as certain; name "
            "uncertainty.xml with --uncertainty"
        )
        fields["std_ln_pga"] = None
    if not on_map.any():
        raise InputError(f"{grid}: none of the blocks lies on the map")
    warnings.append(
        f"the map's measures are taken as {meaning.title}; Beyer and Bommer (2006) relate them to "
        "one component"
        if meaning.name != "single"
        else "the map is taken to be of one component"
    )
    picked = {name: None if values is None else values[on_map] for name, values in fields.items()}
    pgv, pga = picked["pgv_m_s"], picked["pga_g"]
    assert pgv is not None
    assert pga is not None
    answer = site_probability(
        pgv, pga,
        found_blocks["p2_1_s2"][on_map] if own else found_blocks["p2_1_s2"],
        found_blocks["kr"][on_map] if own else found_blocks["kr"],
        component=meaning, weight=None if own else found_blocks.get("weight"), own_block=own,
        std_ln_pgv=picked["std_ln_pgv"], std_ln_pga=picked["std_ln_pga"],
        model=model, level=level, db=db,
    )  # fmt: skip

    def placed(values: Any, empty: Any = np.nan) -> Any:
        whole = np.full(on_map.size, empty)
        whole[on_map] = values
        return whole

    columns: dict[str, Any] = {}
    if own:
        columns["block_id"] = found_blocks["block_id"]
    columns |= {
        "lon": lon,
        "lat": lat,
        "pgv_m_s": fields["pgv_m_s"],
        "pga_g": fields["pga_g"],
        "probability": placed(answer.probability),
        "ci_low": placed(answer.ci_low),
        "ci_high": placed(answer.ci_high),
        "in_domain": placed(answer.in_domain, False),
    }
    outside = int((~answer.in_domain & (answer.probability > 1e-4)).sum())
    if outside:
        warnings.append(
            f"at {outside} places with P > 0.0001 shaking or block lie outside the ranges that the "
            "model was fitted on (in_domain)"
        )
    event = shaken.event
    document = {
        "event_id": event.event_id,
        "event": event.description,
        "magnitude": event.magnitude,
        "time": event.time,
        "model": answer.model,
        "term": answer.term,
        "method": answer.method,
        "level": level,
        "uncertainty_integrated": fields["std_ln_pgv"] is not None,
    }
    _write(columns, {**document, "warnings": warnings}, target)
    if plot is not None:
        from rbfrag.plots.shakemap import plot_shakemap

        name = " ".join(part for part in (event.description, event.time[:10]) if part)
        size = "" if event.magnitude is None else f", M {event.magnitude:g}"
        plot_shakemap(
            lon, lat, columns["probability"], plot,
            title=f"{name}{size}\n{_what(found_blocks, own)}; model {answer.model}",
            epicentre=None if event.lon is None or event.lat is None else (event.lon, event.lat),
            shape=(shaken.rows, shaken.columns) if shaken.is_whole and not own else None,
        )  # fmt: skip
    best = int(np.nanargmax(columns["probability"]))
    document |= {
        "file": str(target),
        "places": int(lon.size),
        "places_above_1_percent": int((answer.probability > 0.01).sum()),
        "largest_probability": float(columns["probability"][best]),
        "largest_at_lon": float(lon[best]),
        "largest_at_lat": float(lat[best]),
    }
    if own:
        document["expected_failures"] = float(answer.probability.sum())
    if json:
        print_json({**document, "warnings": warnings})
        return
    print_pairs(document)
    print_warnings(warnings)


def _write(columns: dict[str, Any], about: dict[str, Any], target: Any) -> None:
    suffix = target.suffix.lower()
    if suffix in (".csv", ".parquet"):
        from rbfrag.exchange.block_table import write_block_table

        write_block_table(columns, target)
    elif suffix == ".gpkg":
        from rbfrag.exchange.points import write_geopackage

        write_geopackage(columns, "toppling_probability", target)
    else:
        from rbfrag.exchange.points import write_points

        write_points(columns, about, target)


def _what(blocks: dict[str, Any], own: bool) -> str:
    size = blocks["kr"].size
    if own:
        return f"{size} blocks at their places"
    if size == 1:
        return f"block with p² = {blocks['p2_1_s2'][0]:g} 1/s², $k_r$ = {blocks['kr'][0]:g}"
    return f"mean of {size} blocks"
