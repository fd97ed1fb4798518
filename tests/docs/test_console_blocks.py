"""Every answer that README and the documentation print is the program's own."""

from __future__ import annotations

import importlib.util
import re
import shutil
import sys
from pathlib import Path
from types import ModuleType

import pytest

from tests.synthetic import shaking, write_at2

ROOT = Path(__file__).resolve().parent.parent.parent


def script() -> ModuleType:
    """Return `docs/console_blocks.py`."""
    spec = importlib.util.spec_from_file_location(
        "console_blocks", ROOT / "docs" / "console_blocks.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


CONSOLE = script()
PYTHON = {
    page: re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
    if "_build" not in page.parts
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, formats_dir: Path) -> Path:
    """A folder with all that the pages read."""
    pytest.importorskip("pyslammer", reason="the demo's records come with the extra samples")
    place = tmp_path_factory.mktemp("pages")
    CONSOLE.prepare(place, formats_dir.resolve())
    return place


def test_the_answers_of_the_pages_are_the_program_s(folder: Path) -> None:
    wrong = [f"{item.page}: {item.typed}\n{answer}" for item, answer in CONSOLE.differing(folder)]
    assert not wrong, "\n".join((*wrong, "python docs/console_blocks.py writes them anew"))


@pytest.mark.parametrize(
    "page", [page for page, result in PYTHON.items() if result], ids=lambda p: p.name
)
def test_the_python_of_the_pages_runs(
    page: Path, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(folder, tmp_path, symlinks=True, dirs_exist_ok=True)
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    for name in re.findall(r'"(\w+\.db)"', "".join(PYTHON[page])):
        shutil.copy(folder / "rbfrag-demo.db", tmp_path / name)
    (tmp_path / "records").mkdir()
    for name in ("record.AT2", "records/RRS228.AT2"):
        write_at2(tmp_path / name, shaking(3, npts=400))
    logged = "\n".join(f"{0.1 * (i % 7)};{i % 5}".replace(".", ",") for i in range(50))
    (tmp_path / "logger.csv").write_text(f"Quarry\n3 channels\ncm/s2\nNS;EW\n{logged}\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RBFRAG_DB", raising=False)
    names: dict[str, object] = {"__name__": page.stem}
    for body in PYTHON[page]:
        exec(compile(body, str(page), "exec"), names)


def test_what_a_page_leaves_out_is_all_that_may_differ() -> None:
    page = CONSOLE.Session("a page", "rbfrag x", "one\n...\nfour\n")
    assert page.agrees("one\ntwo\nthree\nfour")
    assert page.agrees("one\nfour")
    assert CONSOLE.Session("a page", "rbfrag x", "one\n...\n").agrees("one\ntwo")
    assert not page.agrees("one\ntwo\nfour\nfive")
    assert not page.agrees("oneandfour")
