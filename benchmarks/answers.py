"""Whether two versions of rbfrag give the same answers:  python -m benchmarks.answers

`--write FILE` keeps the brackets of every 13th record (both polarities, six p²) and the outcomes
of blocks of 25 strengths on every 20th; `--compare FILE` prints how far the installed version is
from them. Only public functions are called, so that an older version can be asked, too: run the
script with PYTHONPATH at its checkout.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import rbfrag

P2 = (30.0, 10.0, 3.0, 1.0, 0.3, 0.1)
Y_OVER_PGV = np.geomspace(0.1, 4.0, 25).tolist()
MOTIONS_OF_GRIDS = 20
BRACKET = ("status", "certified", "kr_over_pga", "lower", "upper", "k_up_over_pga")


def main(arguments: Sequence[str] | None = None) -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--records", type=Path, required=True, help="folder of accelerograms")
    options.add_argument("--every", type=int, default=13, help="take one record in so many")
    options.add_argument("--write", type=Path, help="keep the answers in this file")
    options.add_argument("--compare", type=Path, help="compare with the answers in this file")
    chosen = options.parse_args(arguments)
    records = list(_records(chosen.records))
    answers = {
        "brackets": _brackets(records[:: chosen.every]),
        "outcomes": _outcomes(records[:: max(len(records) // MOTIONS_OF_GRIDS, 1)]),
    }
    if chosen.write is not None:
        chosen.write.write_text(json.dumps(answers), encoding="utf-8")
    if chosen.compare is not None:
        _compare(json.loads(chosen.compare.read_text(encoding="utf-8")), answers)


def _records(root: Path) -> Iterator[Any]:
    """Yield the horizontal motions, each accelerogram once, in an order that never changes."""
    seen = set()
    for file in sorted(path for path in root.rglob("*") if path.is_file()):
        try:
            motions = rbfrag.read_motions(file)
        except rbfrag.RbfragError:
            continue  # manifests and read-mes lie beside the records
        for motion in motions:
            usable = motion.is_vertical is not True and motion.npts > 1
            if usable and motion.acceleration_g.any() and motion.sha256 not in seen:
                seen.add(motion.sha256)
                yield motion


def _brackets(motions: Sequence[Any]) -> dict[str, dict[str, Any]]:
    found = {}
    for motion in motions:
        for polarity in ("forward", "reverse"):
            for p2 in P2:
                result = rbfrag.critical(motion, p2=p2, polarity=polarity)
                values = {name: getattr(result, name) for name in BRACKET}
                found[f"{motion.sha256} {polarity} {p2:g}"] = values
    return found


def _outcomes(motions: Sequence[Any]) -> dict[str, list[tuple[str, float | None]]]:
    found = {}
    for motion in motions[:MOTIONS_OF_GRIDS]:
        for polarity in ("forward", "reverse"):
            for p2 in P2:
                kr = [y * motion.pgv_m_s * math.sqrt(p2) / 9.80665 for y in Y_OVER_PGV]
                runs = [rbfrag.respond(motion, p2=p2, kr=k, polarity=polarity) for k in kr]
                rows = [(str(run.outcome), run.peak_theta_n) for run in runs]
                found[f"{motion.sha256} {polarity} {p2:g}"] = rows
    return found


def _compare(then: dict[str, Any], now: dict[str, Any]) -> None:
    brackets = [(then["brackets"][key], now["brackets"][key]) for key in then["brackets"]]
    greatest = 0.0
    for one, other in brackets:
        for name in BRACKET[2:]:
            if (one[name] is None) != (other[name] is None):
                greatest = math.inf
            elif one[name] is not None:
                greatest = max(greatest, abs(one[name] - other[name]) / abs(one[name]))
    same = sum(all(one[n] == other[n] for n in BRACKET[:2]) for one, other in brackets)
    print(
        f"{len(brackets)} brackets: status and certificate equal in {same}, greatest relative "
        f"difference {greatest:.3g}"
    )
    pairs = [
        (tuple(one), tuple(other))
        for key, rows in then["outcomes"].items()
        for one, other in zip(rows, now["outcomes"][key], strict=True)
    ]
    outcomes = sum(one[0] == other[0] for one, other in pairs)
    peaks = sum(one[1] == other[1] for one, other in pairs)
    print(f"{len(pairs)} blocks of grids: outcome equal in {outcomes}, peak bit for bit in {peaks}")


if __name__ == "__main__":
    main()
