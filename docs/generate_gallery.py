"""Write docs/gallery.md: every figure with the line that draws it; `--check` only compares.

Figures, what they show and their lines ("Drawn by `…`") are read off the pages.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

DOCS = Path(__file__).resolve().parent
PAGE = DOCS / "gallery.md"

HEAD = """\
# Gallery

<!-- Written by docs/generate_gallery.py from the captions of the pages; change those. -->

Every figure of these pages, linked to its page, and the line that draws it. `FOLDER`, `RECORDS`
and `DATABASE` are yours; motions given by number are those of the database of `make demo`.
"""

_FIGURE = re.compile(
    r"!\[(?P<alt>[^]]*)\]\((?P<file>[^)]*figures/[^)]+)\)"
    r"|```\{figure\} (?P<drawn>\S+)\n:alt: (?P<said>.*)"
)
_LINE = re.compile(r"Drawn\s+by\*?\s+`([^`]+)`")


def figures(page: Path) -> Iterator[tuple[str, str, str]]:
    """Yield name, description and drawing line of each figure of a page."""
    text = page.read_text(encoding="utf-8")
    matches = list(_FIGURE.finditer(text))
    ends = [*(match.start() for match in matches[1:]), len(text)]
    for figure, after in zip(matches, ends, strict=False):
        line = _LINE.search(text[figure.end() : after])
        name = Path(figure["file"] or figure["drawn"]).name
        if line is None:
            raise SystemExit(f"{page.name}: no line that draws {name}")
        yield name, " ".join((figure["alt"] or figure["said"]).split()), " ".join(line[1].split())


def page() -> str:
    """Return the whole page."""
    parts = [HEAD]
    for folder in ("howto", "theory", "evidence", "."):
        for source in sorted((DOCS / folder).glob("*.md")):
            if source.name in {PAGE.name, "index.md"}:
                continue
            where = source.relative_to(DOCS).as_posix()
            for name, about, line in figures(source):
                parts.append(f"[![{about}](figures/{name})]({where})\n\n```sh\n{line}\n```\n")
    return "\n".join(parts)


def main(arguments: list[str]) -> int:
    """Write the page, or say whether it is up to date."""
    if "--check" not in arguments:
        PAGE.write_text(page(), encoding="utf-8")
    elif not PAGE.exists() or PAGE.read_text(encoding="utf-8") != page():
        print(f"{PAGE} is out of date: run python docs/generate_gallery.py", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
