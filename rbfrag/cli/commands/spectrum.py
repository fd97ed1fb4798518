"""`rbfrag spectrum`: toppling spectrum X(p) of ground motions."""

from __future__ import annotations

from rbfrag.cli import options
from rbfrag.cli.command import option
from rbfrag.cli.inputs import find_motion
from rbfrag.cli.output import check_files, print_json, print_result, write_table

EXAMPLE = "Example:  rbfrag spectrum record.AT2 --polarity both --plot spectrum.png"


def spectrum(
    *,
    motions: options.Motions,
    reading: options.Reading,
    p2: str = option("Frequency parameters p² [1/s²], separated by commas", "30,10,3,1,0.3,0.1"),
    kr: float | None = option("Block to compare: uplift acceleration coefficient k_r, with one p²"),
    polarity: options.Polarity = "forward",
    csv: str | None = option("Output table of the spectra (.csv, .xlsx, .parquet)"),
    excel_text: options.ExcelText = False,
    plot: str | None = option("Figure of the spectra over p² with PGV (.png, .pdf, .svg)"),
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Compute the toppling spectrum X(p) of accelerograms.

    X(p) is in m/s. No block with a toppling velocity k_r g/p more than 2 % above X(p) topples. With
    --json, one motion in one polarity is an object, several are a list of such objects.
    """
    from rbfrag.motions.toppling_spectrum import TopplingSpectrum

    sizes, polarities = options.number_list(p2, "--p2"), options.polarities(polarity)
    check_files(table=csv, plot=plot, excel_text=excel_text)
    records = [find_motion(text, db=db, reading=reading) for text in motions]
    spectra = [
        TopplingSpectrum.of(text, ground, sizes, way, kr)
        for text, ground in zip(motions, records, strict=True)
        for way in polarities
    ]
    if csv is not None:
        import numpy as np

        tables = [result.table_columns() for result in spectra]
        columns = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
        write_table(columns, csv, excel_text=excel_text)
    if plot is not None:
        from rbfrag.plots.spectrum import plot_spectrum

        plot_spectrum(records, plot, polarities=polarities, p2=sizes)
    if json:
        answers = [result.as_dict() for result in spectra]
        print_json(answers[0] if len(answers) == 1 else answers)
        return
    for i, result in enumerate(spectra):
        if i:
            print()
        print_result(result, json=False)
