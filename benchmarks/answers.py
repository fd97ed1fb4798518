"""Whether two versions of rbfrag give the same answers:  python -m benchmarks.answers

`--write FILE` keeps the brackets of every 13th record (both polarities, six p², without and with a
vertical motion that is made of the record), the outcomes of blocks of 25 strengths on every 20th,
and what blocks of the other kinds do under every 13th; `--compare FILE` prints how far the
installed version is from them, and lists what is not certified or differs. Only public functions
are called, so that an older version can be asked, too: run the script with PYTHONPATH at its
checkout.
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
VERTICAL_G = 0.8  # peak of the vertical motion made of a record
BLOCKS = {
    "slides": ((1.0, 2.0, 60.0), 5.0, 30.0),
    "slides, then tips back": ((1.0, 0.6, 45.0), 30.0, 40.0),
    "slumps": ((0.5, 0.2, 30.0), 0.0, 35.0),
    "slumps, driven back": ((2.0, 0.4, 35.0), 0.0, 30.0),
    "confined": ((1.5, 0.6, 110.0), 5.0, 35.0),
    "confined, steep": ((1.0, 0.3, 125.0), 0.0, 45.0),
}
"""Spacings [m] and angle of the planes [deg], dip of the base, friction [deg]."""
KEPT_OF_RUNS = ("outcome", "peak_theta_rad", "peak_forward_rad", "peak_backward_rad", "impacts",
                "displacement_m", "peak_displacement_m", "error_estimate")  # fmt: skip
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
        "runs": _runs(records[:: chosen.every]),
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
            is_usable = motion.is_vertical is not True and motion.npts > 1
            if is_usable and motion.acceleration_g.any() and motion.sha256 not in seen:
                seen.add(motion.sha256)
                yield motion


def _brackets(motions: Sequence[Any]) -> dict[str, dict[str, Any]]:
    answers = {}
    for motion in motions:
        for vertical in (None, _vertical(motion)):
            for polarity in ("forward", "reverse"):
                for p2 in P2:
                    result = rbfrag.critical(motion, p2=p2, vertical=vertical, polarity=polarity)
                    key = f"{motion.sha256} {polarity} {p2:g} {'' if vertical is None else 'V'}"
                    answers[key] = {name: getattr(result, name) for name in BRACKET}
    return answers


def _vertical(motion: Any) -> Any:
    """Return the record turned by 37 samples, as strong as a vertical motion can be."""
    turned = np.roll(motion.acceleration_g, 37)
    turned *= VERTICAL_G / np.abs(turned).max()
    return rbfrag.GroundMotion(acceleration_g=turned, dt_s=motion.dt_s)


def _runs(motions: Sequence[Any]) -> dict[str, dict[str, Any]]:
    """Return what blocks of every other kind do."""
    answers = {}
    for motion in motions:
        for polarity in ("forward", "reverse"):
            requests: dict[str, dict[str, Any]] = {}
            for ratio in (0.2, 0.5, 0.9):
                kr = ratio * motion.pga_g
                requests[f"slides, level, {ratio}"] = {"ky": kr}
                for p2 in (10.0, 1.0):
                    for e in (None, 0.85):
                        requests[f"rocking {p2:g} {ratio} {e}"] = {
                            "p2": p2, "kr": kr, "kind": "rocking", "restitution": e,
                        }  # fmt: skip
            for name, (spacings, beta, phi) in BLOCKS.items():
                block = rbfrag.Block.from_fractures(*spacings)
                requests[name] = {"block": block, "beta_deg": beta, "phi_deg": phi}
            for name, request in requests.items():
                try:
                    result = rbfrag.respond(motion, polarity=polarity, **request)
                    values = {name: getattr(result, name, None) for name in KEPT_OF_RUNS}
                    values = {**values, "outcome": str(result.outcome)}
                except rbfrag.RbfragError as error:
                    values = {"outcome": f"rejected: {error}"}
                answers[f"{name}: {motion.sha256[:12]} {polarity}"] = values
    return answers


def _outcomes(motions: Sequence[Any]) -> dict[str, list[tuple[str, float | None]]]:
    answers: dict[str, list[tuple[str, float | None]]] = {}
    for motion in motions[:MOTIONS_OF_GRIDS]:
        for polarity in ("forward", "reverse"):
            for p2 in P2:
                kr = [y * motion.pgv_m_s * math.sqrt(p2) / 9.80665 for y in Y_OVER_PGV]
                runs = [rbfrag.respond(motion, p2=p2, kr=k, polarity=polarity) for k in kr]
                rows = [(str(run.outcome), run.peak_theta_n) for run in runs]
                answers[f"{motion.sha256} {polarity} {p2:g}"] = rows
    return answers


def _compare(then: dict[str, Any], now: dict[str, Any]) -> None:
    for certified in (True, False):
        _compare_brackets(then["brackets"], now["brackets"], certified)
    pairs = [
        (tuple(older), tuple(other))
        for key, rows in then["outcomes"].items()
        for older, other in zip(rows, now["outcomes"][key], strict=True)
    ]
    outcomes = sum(older[0] == other[0] for older, other in pairs)
    peaks = sum(older[1] == other[1] for older, other in pairs)
    print(f"{len(pairs)} blocks of grids: outcome equal in {outcomes}, peak bit for bit in {peaks}")
    kinds: dict[str, list[tuple[str, dict[str, Any], dict[str, Any]]]] = {}
    for key, older in then["runs"].items():
        kinds.setdefault(key.split(":")[0].split(" ")[0], []).append((key, older, now["runs"][key]))
    for kind, runs in kinds.items():
        differs = [run for run in runs if run[1] != run[2]]
        print(f"{len(runs)} runs, {kind.rstrip(',')}: {len(runs) - len(differs)} bit for bit equal")
        for key, older, other in differs:
            changed = (
                f"{name} {older.get(name)} -> {other.get(name)}"
                for name in KEPT_OF_RUNS
                if older.get(name) != other.get(name)
            )
            print(f"  {key}: {', '.join(changed)}")


def _compare_brackets(then: dict[str, Any], now: dict[str, Any], certified: bool) -> None:
    """Compare the answers whose certificate was given, or was not, by the older version."""
    keys = [key for key, older in then.items() if older["certified"] is certified]
    greatest = dict.fromkeys(BRACKET[2:], 0.0)
    for key in keys:
        for name in greatest:
            older, other = then[key][name], now[key][name]
            if (older is None) != (other is None):
                greatest[name] = math.inf
            elif older is not None:
                greatest[name] = max(greatest[name], abs(older - other) / abs(older))
    same = sum(all(then[key][n] == now[key][n] for n in BRACKET[:2]) for key in keys)
    differences = ", ".join(f"{name} {value:.3g}" for name, value in greatest.items())
    print(
        f"{len(keys)} brackets {'' if certified else 'not '}certified: status and certificate "
        f"equal in {same}, greatest relative differences: {differences}"
    )
    if not certified:
        for key in keys:
            print(f"  {key}: {_ends(then[key])} -> {_ends(now[key])}")


def _ends(bracket: dict[str, Any]) -> str:
    return f"[{bracket['lower']}, {bracket['upper']}], K_up {bracket['k_up_over_pga']}"


if __name__ == "__main__":
    main()
