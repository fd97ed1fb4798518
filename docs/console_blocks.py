"""The answers that README and the documentation print, compared with the program's or written anew.

    python docs/console_blocks.py           # writes the answers of all pages anew
    python docs/console_blocks.py --check   # exit status 1 where one is not the program's

A console block holds prompts ("$ rbfrag ...", "$ cat FILE") with what they print below.
"..." stands for lines that are left out; such an answer is compared, and not written anew. Warnings
are compared where the page prints some. Commands run in a folder that holds what `rbfrag demo`
leaves, the files of `examples` and `docs/examples`, and `FROM_OUTSIDE`.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGES = sorted(
    page.relative_to(ROOT).as_posix()
    for page in (ROOT / "README.md", *(ROOT / "docs").rglob("*.md"))
    if "_build" not in page.parts and "\n$ rbfrag" in page.read_text(encoding="utf-8")
)

_TREE = "openquake_classical_logic_tree/three_realizations"
FROM_OUTSIDE = {
    "grid.xml": "shakemap_v3_loma_prieta_grid.xml",
    "los-angeles.json": "usgs_nshm_hazard_curves_los_angeles_2018.json",
    **{
        f"hazard_curve-{part}-PGV_7.csv": f"{_TREE}/hazard_curve-{part}-PGV_7.csv"
        for part in ("mean", "rlz-000", "rlz-001", "rlz-002")
    },
    "realizations_7.csv": f"{_TREE}/realizations_7.csv",
}
"""Files that are not part of the project, by the name that a page has for them: where they lie
below the folder that RBFRAG_TEST_FORMATS names."""

_BLOCK = re.compile(r"^```console\n(.*?)^```", re.M | re.S)
_LEFT_OUT = "..."


@dataclass(frozen=True)
class Session:
    """A command of a page and what the page prints below it.

    Args:
        page: path of the page from the root of the project.
        typed: the command as it is typed, maybe on several lines.
        printed: what is printed below it.
    """

    page: str
    typed: str
    printed: str

    @property
    def words(self) -> list[str]:
        """Words of the command."""
        return shlex.split(self.typed.replace("\\\n", " "))

    @property
    def outside(self) -> set[str]:
        """Files that it reads and that are not part of the project."""
        return FROM_OUTSIDE.keys() & set(self.words)

    def answer(self, folder: Path) -> str:
        """Return what the program prints."""
        process = subprocess.run(
            [sys.executable, "-m", "rbfrag.cli.main", *self.words[1:]],
            cwd=folder, capture_output=True, text=True, check=False,
            env={**os.environ, "RBFRAG_DB": "", "COLUMNS": "100"},
        )  # fmt: skip
        if process.returncode != 0:
            raise RuntimeError(f"{self.page}: {self.typed}\n{process.stderr}")
        return "\n".join(line.rstrip() for line in process.stdout.splitlines()).strip()

    def agrees(self, answer: str) -> bool:
        """Return whether the page prints this answer, but for what it leaves out."""
        lines = self.printed.strip().splitlines()
        pattern = "".join(
            r"(?:.*\n)*?" if line == _LEFT_OUT else re.escape(f"{line}\n") for line in lines
        )
        return re.fullmatch(pattern, f"{answer}\n") is not None


def sessions(page: str) -> Iterator[Session]:
    """Yield the commands of a page that print an answer."""
    for body in _BLOCK.findall((ROOT / page).read_text(encoding="utf-8")):
        for part in re.split(r"^\$ ", body, flags=re.M)[1:]:
            typed, printed = re.fullmatch(r"((?:.*\\\n)*.*\n)((?:.*\n)*)", part).groups()
            session = Session(page, typed.rstrip("\n"), printed)
            if session.words[0] == "rbfrag" and printed.strip():
                yield session


def prepare(folder: Path, formats: Path | None) -> None:
    """Put into a folder what the commands of the pages read.

    Args:
        folder: an empty folder.
        formats: folder of the files of `FROM_OUTSIDE`; None where it is not at hand.
    """
    subprocess.run(
        [sys.executable, "-m", "rbfrag.cli.main", "demo"],
        cwd=folder, check=True, capture_output=True,
    )  # fmt: skip
    (folder / "examples").symlink_to(ROOT / "examples")
    for file in (ROOT / "docs" / "examples").iterdir():
        (folder / file.name).symlink_to(file)
    for name, place in FROM_OUTSIDE.items():
        if formats is not None:
            (folder / name).symlink_to(formats / place)
    for page in PAGES:
        for body in _BLOCK.findall((ROOT / page).read_text(encoding="utf-8")):
            for name, text in re.findall(r"^\$ cat (\S+)\n(.*?)(?=^\$ )", body, re.M | re.S):
                if not (folder / name).exists():
                    (folder / name).write_text(text, encoding="utf-8")
                elif (folder / name).read_text(encoding="utf-8") != text:
                    raise RuntimeError(f"{page}: {name} is not what the page prints")


def differing(folder: Path) -> Iterator[tuple[Session, str]]:
    """Yield each command whose answer is not the one that its page prints, with the answer.

    Args:
        folder: a folder that is prepared.
    """
    for page in PAGES:
        for session in sessions(page):
            missing = [name for name in session.outside if not (folder / name).exists()]
            if missing:
                print(f"{page}: not run without {missing[0]}: {session.typed}")
                continue
            answer = session.answer(folder)
            if not session.agrees(answer):
                yield session, answer


def write_anew(session: Session, answer: str) -> None:
    """Put an answer in the place of the one that its page prints."""
    page = ROOT / session.page
    old, new = (f"$ {session.typed}\n{printed}" for printed in (session.printed, f"{answer}\n"))
    page.write_text(page.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")


def main() -> int:
    """Return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    check = parser.parse_args().check
    formats = os.environ.get("RBFRAG_TEST_FORMATS")
    wrong = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder, Path(formats).resolve() if formats else None)
        for session, answer in differing(folder):
            if not check and _LEFT_OUT not in session.printed.splitlines():
                write_anew(session, answer)
                continue
            wrong += 1
            print(f"{session.page}: {session.typed}\n{answer}")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
