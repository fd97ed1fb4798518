"""The certificate and the accuracy of the solver, studied:  python -m benchmarks.certify

Six parts, each a module with a `study`; `--only` picks some. Every draw is seeded.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.certify import accuracy, borders, combinations, digits, intervals, islands
from benchmarks.certify.recordings import Recording, choose, recordings
from benchmarks.page import machine_sentence

PARTS = ("combinations", "islands", "intervals", "borders", "accuracy", "digits")


def main(arguments: Sequence[str] | None = None) -> dict[str, Any]:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--records", help="folder with MANIFEST.csv (RBFRAG_TEST_RECORDS)")
    options.add_argument("--combinations", type=int, default=500)
    options.add_argument("--vertical", type=int, default=120, help="more, with vertical motion")
    options.add_argument("--islands", type=int, default=60, help="combinations with islands")
    options.add_argument("--values", type=int, default=10_000, help="blocks run in each of them")
    options.add_argument("--intervals", type=int, default=50_000)
    options.add_argument("--borders", type=int, default=120, help="combinations")
    options.add_argument("--digits", type=int, default=60, help="combinations")
    options.add_argument("--strengths", type=int, default=2, help="k_r of each record and p²")
    options.add_argument("--every", type=int, default=1, help="accuracy on each n-th record only")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    options.add_argument("--out", type=Path, help="JSON file for the figures")
    chosen = options.parse_args(arguments)
    records = recordings(chosen.records)
    results: dict[str, Any] = {
        "records": len(records),
        "with_vertical": sum(recording.vertical is not None for recording in records),
        "seed": chosen.seed,
    }
    for part in PARTS:
        if part not in chosen.only:
            continue
        started = time.process_time()
        # every part draws for itself: the same with the others or without
        rng = np.random.default_rng([chosen.seed, PARTS.index(part)])
        results[part] = STUDIES[part](records, chosen, rng)
        results[part]["processor_s"] = time.process_time() - started
        show(part, results[part])
    print(f"\n{machine_sentence()}")
    if chosen.out is not None:
        chosen.out.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return results


def _mixed(records: list[Recording], rng: np.random.Generator, number: int = 10**6) -> list[Any]:
    """Combinations in random order, every fourth with its vertical."""
    flat = choose(records, number, rng, with_vertical=False)
    up = choose(records, number // 3, rng, with_vertical=True)
    together = [*flat, *up]
    return [together[i] for i in rng.permutation(len(together))]


def _combinations(
    records: list[Recording], chosen: argparse.Namespace, rng: np.random.Generator
) -> dict[str, Any]:
    return {
        name: combinations.study(choose(records, number, rng, with_vertical=up))
        for name, number, up in (
            ("horizontal", chosen.combinations, False),
            ("with vertical", chosen.vertical, True),
        )
        if number
    }


STUDIES: dict[str, Callable[..., dict[str, Any]]] = {
    "combinations": _combinations,
    "islands": lambda records, chosen, rng: islands.study(
        _mixed(records, rng), chosen.islands, chosen.values
    ),
    "intervals": lambda records, chosen, rng: intervals.study(
        _mixed(records, rng), chosen.intervals, rng
    ),
    "borders": lambda records, chosen, rng: borders.study(
        _mixed(records, rng)[: chosen.borders], rng
    ),
    "accuracy": lambda records, chosen, rng: accuracy.study(
        records[:: chosen.every], chosen.strengths, rng
    ),
    "digits": lambda records, chosen, rng: digits.study(_mixed(records, rng)[: chosen.digits]),
}


def show(name: str, results: dict[str, Any], indent: str = "") -> None:
    """Print figures as lines, nested ones indented, lists by their length and first entries."""
    print(f"{indent}{name}", flush=True)
    indent += "  "
    for key, value in results.items():
        label = key.replace("_", " ")
        if isinstance(value, dict):
            show(label, value, indent)
        elif isinstance(value, list):
            print(f"{indent}{label:<44} {len(value)}")
            for entry in value[:5]:
                print(f"{indent}  {entry}")
        else:
            text = f"{value:.4g}" if isinstance(value, float) else f"{value:,}"
            print(f"{indent}{label:<44} {text}")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
