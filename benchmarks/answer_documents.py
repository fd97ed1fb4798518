"""What two versions of rbfrag answer:  python -m benchmarks.answer_documents --old CHECKOUT.

Both versions run the same commands with `--json`, and print the help of every command. Of the
documents the keys, numbers, truth values and words without a blank are compared; with `--texts`
sentences and help as well. The exit status is 1 where anything differs.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent

BLOCKS = (
    "--p2 3 --kr .1", "--p2 3 --kr .1 --kr-sigma .2", "--height 2 --width .4",
    "--height 2 --width .4 --dip 10 --phi 35", "--height 2 --width .4 --kind rocking",
    "--height 2.5 --width 2.5 --dip 20 --phi 32 --displacement .1", "--ky .12",
    "--ks .2 --ps2 4", "--kct .2 --pct2 4", "--alpha1 -10 --alpha3 20 --r3 1 --dip 5 --phi 35",
    "--s1 1 --s2 .6 --gamma 25 --beta 20 --phi 40", "--s1 .5 --s2 .15 --gamma 95 --beta 5 --phi 25",
    "--p2 3 --kr .1 --kind rocking --restitution .9 --restitution-sigma .02",
    "--base 25/102 --back 75/290 --face 70/100 --s1 1 --s2 .6 --phi 40",
    "--height 2 --width .4 --phi 40 --water .5 --density 2600",
    "--height 2 --width .4 --phi 40 --water .5 --density 2600 --drainage drained",
    "--height 2 --width .4 --phi 28 --jrc 8 --jcs 60 --density 2600",
    "--block docs/examples/block-fractures.toml",
)  # fmt: skip
SHAKING = (
    "--pgv .6", "--pgv 60cm/s --pga .4g", "--pga .5 --tm .5", "--pga .4 --sa 1=.3",
    "--pgv .6 --pga .5 --sa 1=.4 --sa 3=.1 --sa .3=.9",
    "--pgv .6 --pga .4 --arias 2 --magnitude 6.5",
    "--pgv .6 --pgv-sigma .4 --component rotd50", "--pgv 40 --pga .4 --tm 30",
    "--magnitude 6.8 --rjb 12 --vs30 760 --mechanism reverse --sites 5",
    "--motion RECORD --polarity both", "--pgd 50 --tm .01", "--pgv -1",
    "--pgv .6 --pga .01 --arias 200 --magnitude 2 --pgd 30",
)  # fmt: skip
OTHER_QUESTIONS = (
    "block --height 2 --width .4 --dip 10 --phi 35", "block --p2 3 --kr .1",
    "block --s1 1 --s2 .6 --gamma 25 --beta 20 --phi 40 --kv .1", "block --height -1 --width .4",
    "respond RECORD --p2 3 --kr .1", "respond RECORD --height 2 --width .4 --kind rocking",
    "respond RECORD --ky .1", "critical RECORD --p2 3", "critical RECORD --height 2 --width .5",
    "spectrum RECORD --p2 30,3", "motions show RECORD", "models list",
    "db info --db rbfrag/reference/reference.db",
    "scenario --magnitude 6.8 --rjb 12 --vs30 760", "scenario --magnitude 6 --rjb 30 --vs30 400",
    "hazard examples/pgv-curve.csv --p2 3 --kr .1", "hazard examples/pgv-curve.csv --height 2.4 "
    "--width .5 --dip 3 --phi 35", "hazard examples/pgv-curve.csv --p2 3 --kr .1 --kind rocking",
    "hazard examples/pgv-curve.csv --imt SA(2.0) --p2 3 --kr .1",
    "survival examples/pgv-curve.csv --p2 3 --kr .1 --kind rocking --age 10000",
    "losses docs/examples/event-set --blocks docs/examples/event-set/blocks.csv",
    "rockmass docs/examples/rockmass.toml --n 500 --pgv .5",
    "rockmass docs/examples/rockmass.toml --n 500 --pgv .5 --pga .4",
    "predict --blocks TABLE --pgv .6", "predict --blocks TABLE", "predict --blocks FREMD",
    "predict --blocks FREMD --pgv .6 --ignore-columns Bemerkung",
    "predict --blocks docs/examples/event-set/blocks.csv --pgv .6",
    "hazard examples/ridge.csv --blocks docs/examples/event-set/blocks.csv --joint",
    "predict --blocks examples/segments.csv --pgv .6", "predict --blocks WRONG --pgv .6",
    "predict --rockmass docs/examples/rockmass.toml --pgv .5 --n 200",
    "predict --p2 x --kr .1 --pgv .6", "predict --p2 3 --kr .1 --sa20 .3",
)  # fmt: skip

TABLES = {
    "TABLE": "name,Height [cm],width,dip,Friction angle,kind,PGV [cm/s],PGA [g]\n"
    "a,200,.4,3,35,,60,.4\nb,250,2.5,20,32,sliding,50,.3\nc,200,.4,0,,rocking,70,.5\n"
    "d,200,,3,35,,60,.4\n",
    "FREMD": "Bezeichnung;Höhe [cm];Breite [m];Neigung der Basis;Reibungswinkel;Anzahl;Bemerkung;"
    "Bodengeschwindigkeit [cm/s];freistehend\nA;200;0,4;3;35;2;gut;60;nein\n"
    "B;150;0,5;2;40;1;;50;ja\n",
    "WRONG": "block,hieght_m,width,Neigungsgrad,pgv\na,2,.4,3,.6\n",
}


def main(arguments: Sequence[str] | None = None) -> int:
    from benchmarks.page import parser
    from tests.synthetic import shaking, write_at2

    options = parser(__doc__)
    options.add_argument("--old", type=Path, required=True, help="checkout of the older version")
    options.add_argument("--texts", action="store_true", help="compare sentences and help as well")
    chosen = options.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        files = {"RECORD": str(write_at2(Path(folder) / "record.AT2", shaking(3)))}
        for name, text in TABLES.items():
            files[name] = str(Path(folder) / f"{name.lower()}.csv")
            Path(files[name]).write_text(text, encoding="utf-8")
        lines = [[files.get(word, word) for word in shlex.split(line)] for line in command_lines()]
        old, new = (answers(checkout, lines) for checkout in (chosen.old.resolve(), ROOT))
    different = [
        name
        for name in old | new
        if compared(old.get(name), chosen.texts) != compared(new.get(name), chosen.texts)
    ]
    documents = sum(parsed(text) is not None for text in new.values())
    print(f"{documents} documents and {len(new) - documents} pages; {len(different)} differ")
    for name in different:
        print(f"\n{name}\n  old: {old.get(name)}\n  new: {new.get(name)}")
    return 1 if different else 0


def command_lines() -> Iterator[str]:
    for block, measures in itertools.product(BLOCKS, SHAKING):
        yield f"predict {block} {measures} --json"
    yield from (f"{line} --json" for line in OTHER_QUESTIONS)
    yield from (f"{line}" for line in OTHER_QUESTIONS)


def answers(checkout: Path, lines: Sequence[Sequence[str]]) -> dict[str, str]:
    """Return what a checkout prints, by command line."""
    environment = {**os.environ, "PYTHONPATH": str(checkout), "COLUMNS": "100"}
    environment.pop("RBFRAG_DB", None)
    process = subprocess.run(
        [sys.executable, "-P", __file__], input=json.dumps(lines), cwd=checkout, env=environment,
        check=True, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    return dict(json.loads(process.stdout))


def run(lines: Sequence[Sequence[str]]) -> dict[str, str]:
    """Return what this process prints, by command line; of a failure its message."""
    import typer.main
    from typer.testing import CliRunner

    from rbfrag.cli.main import COMMANDS, app

    printed = {}
    root: Any = typer.main.get_command(app)
    pages = [[name, "--help"] for name in COMMANDS]
    for name in COMMANDS:
        below = getattr(root.get_command(None, name), "commands", {})
        pages += [[name, command, "--help"] for command in below]
    for words in (*lines, *pages):
        with contextlib.chdir(Path.cwd()):
            result = CliRunner().invoke(app, words)
        text = result.stdout if result.exit_code == 0 and result.stdout else ""
        printed[shlex.join(words)] = text or f"{result.exit_code} {result.output}"
    return printed


def parsed(text: str | None) -> Any:
    try:
        return json.loads(text or "")
    except ValueError:
        return None


def compared(text: str | None, texts: bool) -> Any:
    """Return what of an answer is compared."""
    if texts:
        return text
    document = parsed(text)
    return (text or "")[:1] if document is None else without_sentences(document)


def without_sentences(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: without_sentences(part) for name, part in value.items()}
    if isinstance(value, list):
        return [without_sentences(part) for part in value]
    return "" if isinstance(value, str) and " " in value else value


if __name__ == "__main__":
    # of the older version only the package is read: the commands are those of this file
    if len(sys.argv) == 1:
        print(json.dumps(run(json.load(sys.stdin))))
    else:
        sys.exit(main())
