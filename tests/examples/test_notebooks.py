"""The notebooks: they run, and print what is stored in them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

from rbfrag.motions.sample_motions import sample_folder
from tests.conftest import ROOT

NOTEBOOKS = sorted((ROOT / "examples" / "notebooks").glob("*.ipynb"))

LARGEST_BYTES = 200_000


def printed(notebook: Any) -> list[str]:
    """Return what each cell prints; tables and figures are left out."""
    cells = (cell for cell in notebook.cells if cell.cell_type == "code")
    return [
        "".join(output["text"] for output in cell.outputs if output.output_type == "stream")
        for cell in cells
    ]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_notebook_prints_what_is_stored_in_it(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RBFRAG_DB", raising=False)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    stored = nbformat.read(path, as_version=4)
    before = printed(stored)
    assert any(before)
    assert any(
        "image/png" in item.get("data", {}) for c in stored.cells for item in c.get("outputs", ())
    )
    NotebookClient(
        stored, timeout=300, resources={"metadata": {"path": str(path.parent)}}
    ).execute()
    if "sample_motions" in path.read_text(encoding="utf-8") and sample_folder() is None:
        return  # pulses took the place of the records
    assert printed(stored) == before


def test_the_notebooks_are_there_and_small() -> None:
    assert len(NOTEBOOKS) == 4
    assert max(path.stat().st_size for path in NOTEBOOKS) <= LARGEST_BYTES
