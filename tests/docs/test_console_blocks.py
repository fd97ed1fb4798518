"""Every answer that README and the documentation print is the program's own."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

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


def test_the_answers_of_the_pages_are_the_program_s(tmp_path: Path, formats_dir: Path) -> None:
    pytest.importorskip("pyslammer", reason="the demo's records come with the extra samples")
    CONSOLE.prepare(tmp_path, formats_dir.resolve())
    wrong = [f"{each.page}: {each.typed}\n{answer}" for each, answer in CONSOLE.differing(tmp_path)]
    assert not wrong, "\n".join((*wrong, "python docs/console_blocks.py writes them anew"))


def test_what_a_page_leaves_out_is_all_that_may_differ() -> None:
    page = CONSOLE.Session("a page", "rbfrag x", "one\n...\nfour\n")
    assert page.agrees("one\ntwo\nthree\nfour")
    assert page.agrees("one\nfour")
    assert CONSOLE.Session("a page", "rbfrag x", "one\n...\n").agrees("one\ntwo")
    assert not page.agrees("one\ntwo\nfour\nfive")
    assert not page.agrees("oneandfour")
