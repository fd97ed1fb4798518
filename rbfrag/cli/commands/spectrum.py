"""`rbfrag spectrum`: the toppling spectrum X(p) of motions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rbfrag.cli.output import check_files, print_json, print_table, print_warnings, write_table
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.motion import find_motion
from rbfrag.cli.parameters.stack import option, stacked
from rbfrag.cli.sentences import spectrum_in_words, strongest_kr
from rbfrag.results.numbers import rounded

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

EXAMPLE = "Example:  rbfrag spectrum record.AT2 --polarity both --plot spectrum.png"


@stacked
def spectrum(
    *,
    motions: options.Motions,
    reading: options.ReadingOptions,
    p2: str = option("Frequency parameters p² [1/s²], separated by commas.", "30,10,3,1,0.3,0.1"),
    polarity: options.Polarity = "forward",
    csv: str | None = option("Write the values (.csv, .xlsx or .parquet)."),
    excel_text: bool = option(options.EXCEL_TEXT, False),
    plot: str | None = option("Draw the spectra over p², with PGV beside them (.png, .pdf, .svg)."),
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Compute the toppling spectrum X(p): what a motion can topple.

    X(p) is in m/s. No block with a toppling velocity k_r g/p more than 2 % above X(p) topples.
    With --json, one motion in one polarity is an object, several are a list of such objects.
    """
    from rbfrag.motions.toppling_spectrum import spectrum_as_dict as as_dict

    sizes, polarities = options.number_list(p2, "--p2"), options.polarities(polarity)
    check_files(table=csv, plot=plot, excel_text=excel_text)
    records = [find_motion(text, db=db, reading=reading) for text in motions]
    answers = [
        as_dict(text, ground, sizes, each)
        for text, ground in zip(motions, records, strict=True)
        for each in polarities
    ]
    if csv is not None:
        write_table(_columns(answers), csv, excel_text=excel_text)
    if plot is not None:
        from rbfrag.plots.spectrum import plot_spectrum

        plot_spectrum(records, plot, polarities=polarities, p2=sizes)
    if json:
        print_json(answers[0] if len(answers) == 1 else answers)
        return
    for first in range(0, len(answers), len(polarities)):
        mine = answers[first : first + len(polarities)]
        if first:
            print()
        print(spectrum_in_words(mine))
        print()
        columns: list[list[Any]] = [sizes]
        for one in mine:
            columns.append([rounded(x) for x in one["x_m_s"]])
            columns.append([rounded(k) for k in strongest_kr(one)])
        heads = [f"{name}{end}" for end in polarities for name in ("X [m/s] ", "k_r ")]
        print_table(("p2", *heads), zip(*columns, strict=True))
    print_warnings(
        dict.fromkeys(f"{one['motion']}: {word}" for one in answers for word in one["warnings"])
    )


def _columns(answers: Sequence[dict[str, Any]]) -> dict[str, NDArray[Any]]:
    import numpy as np

    rows = [
        (one["motion"], one["name"], one["polarity"], *values)
        for one in answers
        for values in zip(one["p2"], one["x_m_s"], strict=True)
    ]
    names = ("motion", "name", "polarity", "p2_1_s2", "x_m_s")
    columns = zip(*rows, strict=True)
    return {name: np.array(column) for name, column in zip(names, columns, strict=True)}
