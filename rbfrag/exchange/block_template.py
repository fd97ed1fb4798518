"""Template of a table of blocks: columns with their units, and an example."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from rbfrag.exchange.tables.files import write_block_table
from rbfrag.exchange.tables.workbook import openpyxl
from rbfrag.files import output_path, written_whole
from rbfrag.question.shape_validation import RECTANGLE
from rbfrag.question.table import header_of
from rbfrag.vocabulary import quantities
from rbfrag.vocabulary.quantities import FAILURE, PLANES

COLUMNS = ("block_id", *RECTANGLE, *PLANES, *FAILURE, "pgv_m_s", "pga_g")
"""Fields that have a column; the others are listed on a sheet of their own."""

EXAMPLE = {"block_id": "example", "height_m": 2.4, "width_m": 0.5, "beta_deg": 3.0, "phi_deg": 35.0}


def write_template(path: str | os.PathLike[str]) -> Path:
    """Write a table with one example row, completely or not at all, and return its path.

    A workbook has a second sheet that lists all columns.

    Args:
        path: file to write, ``.xlsx`` or ``.csv``.
    """
    target = output_path(path, (".xlsx", ".csv"), "table")
    names, row = map(header_of, COLUMNS), [EXAMPLE.get(name, "") for name in COLUMNS]
    if target.suffix.lower() == ".csv":
        columns = {name: np.array([cell]) for name, cell in zip(names, row, strict=True)}
        return write_block_table(columns, target)
    book = openpyxl().Workbook()
    sheet, column_sheet = book.active, book.create_sheet("columns")
    sheet.title, sheet.freeze_panes, column_sheet.freeze_panes = "blocks", "A2", "A2"
    sheet.append([*names])
    sheet.append(row)
    column_sheet.append(["column", "description", "other names"])
    for name in quantities.COLUMNS:
        help = quantities.QUANTITIES[name].help(quantities.word_of)
        column_sheet.append([header_of(name), help, ", ".join(quantities.INPUTS[name].aliases)])
    with written_whole(target, "table") as partial:
        book.save(partial)
    return target
