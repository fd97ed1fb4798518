"""`rbfrag block`: failure mode and yield acceleration of one block."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from rbfrag.cli import options
from rbfrag.cli.command import Fields, Inputs, option
from rbfrag.cli.output import check_files, print_json, print_result, write_table
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.vocabulary.quantities import AT_REST, COMMON, JOINT, PLANES, SHAPE

FREE_STANDING = Diagnostic(
    "free-standing: rbfrag predict --kind rocking gives the probability of overturning, rbfrag "
    "respond --kind rocking the response to a record",
    "free_standing",
)

EXAMPLE = "Example:  rbfrag block --height 2.4 --width 0.5 --dip 3 --phi 35"


def block(
    *,
    inputs: Annotated[
        Inputs,
        Fields(*SHAPE, *PLANES, *JOINT, *COMMON, *AT_REST, without=("kind", "phi_residual_deg")),
    ],
    mesh: str | None = option(
        "Closed mesh of a free-standing block [m] in its measured resting pose on level "
        "ground (.obj, .ply, .stl)",
        metavar="FILE",
    ),
    up: str = option("Vertical axis of the mesh, positive upward: x, y or z", "z"),
    contact_mm: float = option(
        "Maximum height of contact vertices above the lowest vertex [mm]", 10.0
    ),
    out: str | None = option(
        "Output table of the blocks of a mesh, one row per azimuth (.csv, .xlsx, .parquet)",
        metavar="FILE",
    ),
    excel_text: options.ExcelText = False,
    plot: str | None = option(
        "Figure of the block on its planes with contacts and resultant at yield, or of the "
        "contacts of a mesh and k_r over azimuth (.png, .pdf, .svg)"
    ),
    template: str | None = option(
        "Empty table of blocks with units and an example row, for rbfrag predict --blocks "
        "(.xlsx, .csv)",
        metavar="FILE",
    ),
    verbose: options.Verbose = False,
    json: options.Json = False,
) -> None:
    """Print the failure mode, yield accelerations and p² of a block.

    Angles in degrees, lengths in m, accelerations in g, the frequency parameter p2 in 1/s². A
    toppling block is backed by a rock face. A free-standing block rocks and overturns at weaker
    shaking (rbfrag predict --kind rocking, rbfrag respond --kind rocking). A mesh is a
    free-standing block: volume, mass, inertia, and for each azimuth kr, p2 and coefficient of
    restitution about its ground contacts.
    """
    if template is not None:
        from rbfrag.exchange.block_table import COLUMNS, write_template

        written = str(write_template(template))
        if json:
            print_json({"template": written, "columns": list(COLUMNS)})
        else:
            print(f"{written}: write a row for each block in place of the example, then  rbfrag")
            print(f"predict --blocks {written}  with an intensity measure, as --pgv 0.6")
        return
    if mesh is not None:
        from rbfrag.exchange.mesh_file import block_from_mesh

        check_files(table=out, plot=plot, excel_text=excel_text)
        density = inputs.get("density_kg_m3")
        solid = block_from_mesh(mesh, up=up, contact_mm=contact_mm, density_kg_m3=density)
        if out is not None:
            write_table(solid.table_columns(), out, excel_text=excel_text)
        if plot is not None:
            from rbfrag.plots.block import plot_mesh_block

            plot_mesh_block(solid, plot)
        print_result(solid, json=json, verbose=verbose)
        return
    from rbfrag.question.classify import on_planes
    from rbfrag.solver.kinds import kind_of_mode
    from rbfrag.solver.stability.single import stability

    with inputs.named():
        body, planes, _, remarks = on_planes(inputs)
    result = stability(body, **planes)
    result = replace(result, warnings=tuple(dict.fromkeys((*remarks, *result.warnings))))
    unbacked = planes.get("back_fracture") is False
    if unbacked and kind_of_mode(result.mode, back_fracture=False).free_standing:
        result = replace(result, warnings=(*result.warnings, FREE_STANDING))
    if plot is not None:
        from rbfrag.plots.block import plot_block

        plot_block(body, result, plot)
    print_result(result, json=json, verbose=verbose)
