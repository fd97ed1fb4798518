"""Readers under damage:  python -m benchmarks.fuzz_readers --inputs 100000

Every input is a file of one of the formats of accelerograms, or of another reader of the list in
`benchmarks/readers.py`, after one to four random edits: bytes flipped, pieces put in or over, spans
and lines dropped, doubled or swapped, numbers changed, ends cut off. A reader must reject it in one
printable sentence of less than 500 characters that names the file and a line of it, or read it;
motions must then be fit for use: finite samples, a positive interval, measures and flags that can
be computed.
Beside each, one number of the header of a sound file is multiplied by a factor of 2 or more, which
must not go unnoticed (`benchmarks/silent_changes.py`).
Anything else is a failure and is printed with its number, from which it can be made again.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
import warnings
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import numpy as np

from benchmarks.damage import damaged
from benchmarks.readers import READERS, Reader
from benchmarks.silent_changes import Silence, change, sound_files
from benchmarks.silent_changes import table as table_of_silence
from rbfrag.errors import MOST_CHARACTERS, InputError, RbfragError
from rbfrag.motions.formats import rbfrag_csv
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.metadata import read_metadata
from rbfrag.motions.processing import processed
from rbfrag.motions.quality import quality_flags
from rbfrag.motions.readers import read_motions
from tests.motions.test_network_round_trips import STATE_NO_UNIT, WRITTEN
from tests.motions.written import AT2_SAMPLING, at2, two_columns, v2a
from tests.motions.written_by_networks import AFAD_PREAMBLE, csmip_v1, knet, scec_bbp
from tests.motions.written_miniseed import COUNTS, miniseed
from tests.synthetic import shaking

SLOW_S = 2.0
"""Processor time beyond which an input counts as a failure."""

LARGEST_REAL_BYTES = 400_000
"""Real files beyond this take too long for thousands of inputs."""

FEW_SAMPLES = 1000
"""Motions up to this size are filtered as well."""

READER_BY_NAME: dict[str, Reader] = {reader.name: reader for reader in READERS}

NEEDS: dict[str, tuple[str, float | None]] = {
    **dict.fromkeys(STATE_NO_UNIT, ("g", None)),
    "delimited text": ("g", 0.005),
    "real: geer_chihshang_2022_acc": ("m/s2", None),
    "real: fema_p695_far_field": ("g", 0.01),
    "real: geonet_ucgmsim_text": ("g", None),
}
"""Unit and interval that must be stated for a format."""

GAINS = {"miniSEED": 1000.0}
"""Gain [counts/(m/s²)] that must be."""

TOKENS = [f"{value:.5E}" for value in shaking(1, 60)]
DECIMALS = [f"{100.0 * value:.3f}" for value in shaking(2, 40)]
TIMES = [f"{0.005 * i:.3f}" for i in range(60)]


@dataclass
class Tally:
    """What became of the inputs made from one kind of file."""

    inputs: int = 0
    rejected: int = 0
    partial: int = 0
    slowest_s: float = 0.0
    reasons: Counter[str] = field(default_factory=Counter)


def bases(records: Path | None) -> dict[str, list[bytes]]:
    """Return sound files by format: made-up ones, and small real ones where there are any."""
    record = "\n".join(rbfrag_csv.write([GroundMotion(shaking(3, 40), 0.02, station="S")])) + "\n"
    contents = {name: [make().encode()] for name, make in WRITTEN.items()}
    borehole = knet([int(1000.0 * value) for value in shaking(4, 200)], 100, direction="1")
    contents["K-NET/KiK-net ASCII"].append(borehole.encode())
    series = csmip_v1([("360 Deg", [f".{i:06d}" for i in range(60)])], 0.005)
    contents["CDMG V1"].append(series.encode())
    contents["PEER AT2"] = [at2(TOKENS, 0.005, sampling=form).encode() for form in AT2_SAMPLING]
    contents["GeoNet V2A"] = [v2a([("N28W", DECIMALS), ("UP", DECIMALS)], 0.02).encode()]
    contents["delimited text"] = [
        two_columns(TIMES, TOKENS, header="# T - S-1\n# Time (s),Acceleration (g)\n").encode(),
        two_columns(TIMES, TOKENS, mark="  ").encode(),
        ("\n".join(TOKENS) + "\n").encode(),
    ]
    contents["rbfrag CSV"] = [record.encode()]
    contents["ESM ASC"].append(AFAD_PREAMBLE.encode() + contents["ESM ASC"][0])
    table = [[f"{value * f:.6e}" for f in (100, 60, -30)] for value in shaking(6, 60)]
    contents["SCEC broadband platform"] = [
        scec_bbp(table, 0.02, columns=form).encode() for form in ("names", "lines", "units")
    ]
    contents["miniSEED"] = [
        miniseed(COUNTS[:400], version=version, record_bytes=512)
        + miniseed(2 * COUNTS[:400], version=version, channel="HNZ")
        for version in (2, 3)
    ]
    if records is not None:
        for name, files in real_files(records).items():
            contents[f"real: {name}"] = files
    contents |= {reader.name: list(reader.sound()) for reader in READERS}
    return contents


def real_files(records: Path) -> dict[str, list[bytes]]:
    """Return the smallest files of each set of a manifest."""
    by_set: dict[str, set[Path]] = defaultdict(set)
    for row in read_metadata(records / "MANIFEST.csv").rows:
        by_set[row.file.split("/")[0]].add(records / row.file)
    chosen = {}
    for name, files in sorted(by_set.items()):
        small = sorted(files, key=lambda file: (file.stat().st_size, file.name))[:2]
        chosen[name] = [
            file.read_bytes() for file in small if file.stat().st_size <= LARGEST_REAL_BYTES
        ]
    return {name: files for name, files in chosen.items() if files}


def read_record(name: str, path: Path, random: Random, tally: Tally) -> str:
    """Return what is wrong with the motions of an accelerogram's file; empty when nothing is."""
    # mostly what the format needs, so that most inputs get past it
    units, dt_s = NEEDS.get(name, (None, None))
    if random.random() < 0.1:
        units, dt_s = random.choice(("g", "m/s2", None)), random.choice((None, 0.005, 1e-300))
    allow_partial = random.random() < 0.5
    motions = read_motions(
        path, units=units, dt_s=dt_s, allow_partial=allow_partial, gain=GAINS.get(name)
    )
    tally.partial += any(motion.is_partial for motion in motions)
    return next(filter(None, map(unfit, motions)), "" if motions else "no motion")


def failure(name: str, folder: Path, content: bytes, random: Random, tally: Tally) -> str:
    """Return what is wrong with what a reader made of a file; empty when nothing is."""
    reader = READER_BY_NAME.get(name)
    suffix = reader.suffix if reader else ""
    path = folder / (suffix if suffix and not suffix.startswith(".") else f"record{suffix}")
    path.write_bytes(content)
    started = time.process_time()
    try:
        wrong = ""
        if reader is None:
            wrong = read_record(name, path, random, tally)
        else:
            reader.read(path)
    except RbfragError as error:
        tally.rejected += 1
        tally.reasons[type(error).__name__] += 1
        wrong = unclear(error, path, content)
    except Exception as error:  # noqa: BLE001  # whatever else is raised is what is looked for
        wrong = f"{type(error).__name__}: {str(error)[:200]}"
    finally:
        path.unlink()  # an index beside the next file would count
    took = time.process_time() - started
    tally.slowest_s = max(tally.slowest_s, took)
    if took > SLOW_S:
        wrong = wrong or f"took {took:.1f} s"
    return wrong


def unfit(motion: GroundMotion) -> str:
    """Return why a motion must not leave a reader; empty for a valid one."""
    if motion.npts < 1 or not np.isfinite(motion.acceleration_g).all():
        return "samples that are not finite"
    if motion.dt_s is None or not 0.0 < motion.dt_s < math.inf:
        return f"dt = {motion.dt_s}"
    if motion.time_s.size != motion.acceleration_g.size:
        return "another number of times than samples"
    try:
        measures = motion.measures
    except InputError:
        return ""  # absurd units are rejected in words of their own when they are measured
    if not all(math.isfinite(value) for value in vars(measures).values() if value is not None):
        return f"measures that are not finite: {measures}"
    quality_flags(motion)
    if motion.npts < FEW_SAMPLES:
        try:
            derived = processed(motion)
        except InputError:
            return ""
        if not np.isfinite(derived.acceleration_g).all():
            return "samples that are not finite after processing"
    return ""


def unclear(error: RbfragError, path: Path, content: bytes) -> str:
    """Return what a message lacks; empty for a clear one."""
    text, line = str(error), getattr(error, "line", None)
    last = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n").count(b"\n") + 1
    # a record may be rejected for the index beside it
    if str(path.parent) not in text:
        return f"the message names no file: {text[:200]}"
    if not text.isprintable() or len(text) > MOST_CHARACTERS:
        return f"the message is not one printable sentence: {text[:200]!r}"
    if line is not None and not 1 <= line <= last:
        return f"the message names line {line} of {last}: {text[:200]}"
    return ""


def note(silence: Silence, name: str, content: bytes, path: Path, random: Random) -> None:
    """Change a number of a sound file's header, and count what became of it."""
    units, dt_s = NEEDS.get(name, (None, None))
    try:
        became, kind, line = change(name, content, path, random, units, dt_s, GAINS.get(name))
    except RbfragError:
        return  # not every file of a set needs the same unit and interval
    if not became:
        return
    silence.changed += 1
    silence.rejected += became == "rejected"
    silence.remarked += became == "remarked"
    if became == "silent":
        silence.silent[kind] += 1
        silence.lines[line] += 1


def main(arguments: Sequence[str] | None = None) -> int:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--inputs", type=int, default=100_000, help="damaged files in all")
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--records", type=Path, help="folder with MANIFEST.csv: real files too")
    options.add_argument("--only", type=int, help="make this input alone, and keep its file")
    chosen = options.parse_args(arguments)
    files = bases(chosen.records)
    names = list(files)
    tallies = {name: Tally() for name in names}
    silences = {name: Silence() for name in names if name not in READER_BY_NAME}
    sound = {name: sound_files(name, files[name]) for name in silences}
    failures = 0
    warnings.simplefilter("error")
    numbers = range(chosen.inputs) if chosen.only is None else [chosen.only]
    with tempfile.TemporaryDirectory() as folder:
        for number in numbers:
            random = Random(f"{chosen.seed} {number}")
            name = names[number % len(names)]
            content = damaged(random.choice(files[name]), random)
            tallies[name].inputs += 1
            wrong = failure(name, Path(folder), content, random, tallies[name])
            if wrong:
                failures += 1
                print(f"input {number} ({name}): {wrong}", file=sys.stderr)
            if chosen.only is not None:
                saved = Path(f"fuzz-{chosen.seed}-{number}")
                saved.write_bytes(content)
                print(f"kept as {saved}")
            if name in silences:
                content = random.choice(sound[name])
                note(silences[name], name, content, Path(folder) / "record", random)
    print(table(tallies))
    print(f"\n{table_of_silence(silences)}")
    total = sum(tally.inputs for tally in tallies.values())
    rejected = sum(tally.rejected for tally in tallies.values())
    print(f"\n{total} inputs: {rejected} rejected, {total - rejected - failures} read, ", end="")
    print(f"{failures} failures (seed {chosen.seed})")
    return 1 if failures else 0


def table(tallies: dict[str, Tally]) -> str:
    """Return what became of the inputs, a row a format."""
    rows = ["| format | inputs | rejected | read as partial | slowest [ms of processor] |",
            "| --- | --- | --- | --- | --- |"]  # fmt: skip
    rows += [
        f"| {name} | {tally.inputs} | {tally.rejected} | {tally.partial} "
        f"| {1000.0 * tally.slowest_s:.0f} |"
        for name, tally in tallies.items()
    ]
    return "\n".join(rows)


if __name__ == "__main__":
    sys.exit(main())
