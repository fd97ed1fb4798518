"""Is this commit fit for a package index?  make release-check

From a clean copy of the last commit, without files of git: builds the source distribution and the
wheel, compares their files with the commit, checks metadata, version, changelog and citation,
installs the wheel into bare environments (newest and lowest versions of its dependencies), runs
`rbfrag demo` there without a network, lists the licences of all that the wheel and its extras
bring, and writes its bill of materials (CycloneDX). Where nothing fails, both distributions are in
dist/ with the bill beside them, for `twine upload dist/*.whl dist/*.tar.gz`.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from benchmarks.floors import ROOT, TOOLS, floors

LICENCES = (
    "Apache",
    "BSD",
    "CMU",
    "ISC",
    "LGPL",
    "Lesser General",
    "MIT",
    "Mozilla",
    "MPL",
    "PSF",
    "Python Software",
    "Unlicense",
    "Zlib",
    "0BSD",
)
"""A word of these is in the licence of whatever may be imported."""

DATA_ONLY = ("pyslammer",)
"""Under other licences: read as data files, never imported (docs/dependencies.md)."""

SHIPPED = "rbfrag/service/page/vendor/d3"
"""Code of others that the wheel holds."""

_HEADING = re.compile(r"^## \[(?P<version>[^\]]+)\](?: - (?P<day>\d{4}-\d\d-\d\d))?$", re.M)


def run(
    command: Sequence[str | Path], *, cwd: Path | None = None, env: dict[str, str] | None = None
) -> str:
    """Return what a command prints.

    Raises:
        RuntimeError: it failed; with its last lines.
    """
    process = subprocess.run(
        [str(part) for part in command],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=cwd,
        env=env,
        check=False,
    )
    if process.returncode:
        last = "\n".join(process.stdout.splitlines()[-15:])
        raise RuntimeError(f"{' '.join(map(str, command))}: status {process.returncode}\n{last}")
    return process.stdout


def versions_agree(root: Path = ROOT) -> str:
    """Return the version that package, CITATION.cff and first heading of the changelog state.

    Raises:
        RuntimeError: they differ, or that heading has no day.
    """
    version = re.search(r'__version__ = "([^"]+)"', (root / "rbfrag/version.py").read_text())
    cited = re.search(r"^version: (\S+)$", (root / "CITATION.cff").read_text(), re.M)
    heading = _HEADING.search((root / "CHANGELOG.md").read_text(encoding="utf-8"))
    if version is None or cited is None or heading is None:
        raise RuntimeError("no version in rbfrag/version.py, CITATION.cff or CHANGELOG.md")
    versions = {
        "rbfrag/version.py": version[1],
        "CITATION.cff": cited[1],
        "CHANGELOG.md": heading["version"],
    }
    if len(set(versions.values())) > 1:
        raise RuntimeError(
            "the versions differ: " + ", ".join(f"{name} {text}" for name, text in versions.items())
        )
    if heading["day"] is None:
        raise RuntimeError(
            f"CHANGELOG.md: the heading of {version[1]} has no day (## [X.Y.Z] - YYYY-MM-DD)"
        )
    return version[1]


def shipped_component(folder: Path) -> dict[str, object]:
    """Return the entry of a library that is shipped, as a bill of materials has it.

    Args:
        folder: holds the library, SHA256SUMS and LICENSE; the library's first line states its
            version.
    """
    checksum, name = (folder / "SHA256SUMS").read_text(encoding="utf-8").split()
    with (folder / name).open(encoding="utf-8") as file:
        version = re.search(r"\bv(\d+\.\d+\.\d+)\b", file.readline())
    if version is None:
        raise RuntimeError(f"{folder / name} states no version in its first line")
    return {
        "type": "library",
        "bom-ref": f"{folder.name}=={version[1]}",
        "name": folder.name,
        "version": version[1],
        "purl": f"pkg:npm/{folder.name}@{version[1]}",
        "hashes": [{"alg": "SHA-256", "content": checksum}],
        "licenses": [{"license": {"id": "ISC"}}],
    }


def differing(shipped: Iterable[str], committed: Iterable[str]) -> str:
    """Return which files are there too many or too few, as a text; empty when none."""
    there, expected = set(shipped), set(committed)
    parts = [("not in the commit", there - expected), ("missing", expected - there)]
    return "; ".join(f"{word}: {', '.join(sorted(names)[:8])}" for word, names in parts if names)


class Check:
    """One run in a folder of its own."""

    def __init__(self, work: Path, python: str) -> None:
        self.work, self.python = work, python
        self.source, self.dist = work / "source", work / "dist"
        self.committed = run(["git", "ls-files"], cwd=ROOT).split("\n")[:-1]

    def build(self) -> str:
        self.source.mkdir()
        packed = self.work / "source.tar"
        run(["git", "archive", "--output", packed, "HEAD"], cwd=ROOT)
        with tarfile.open(packed) as archive:
            archive.extractall(self.source, filter="data")
        run([sys.executable, "-m", "build", "--outdir", self.dist, self.source])
        self.wheel = next(self.dist.glob("*.whl"))
        self.sdist = next(self.dist.glob("*.tar.gz"))
        return ", ".join(
            f"{file.name} {file.stat().st_size / 1e6:.1f} MB" for file in (self.sdist, self.wheel)
        )

    def metadata(self) -> str:
        run([sys.executable, "-m", "twine", "check", "--strict", self.sdist, self.wheel])
        version = versions_agree(self.source)
        if self.wheel.name.split("-")[1] != version:
            raise RuntimeError(f"{self.wheel.name} is not of version {version}")
        cited = self.source / "CITATION.cff"
        run([Path(sys.executable).with_name("cffconvert"), "--validate", "--infile", cited])
        return f"{version} in package, wheel, citation and changelog; CITATION.cff is valid"

    def files(self) -> str:
        with zipfile.ZipFile(self.wheel) as packed:
            shipped = [name for name in packed.namelist() if ".dist-info/" not in name]
        with tarfile.open(self.sdist) as archive:
            sources = [m.name.split("/", 1)[1] for m in archive.getmembers() if m.isfile()]
        for name, there, expected in (
            ("wheel", shipped, [file for file in self.committed if file.startswith("rbfrag/")]),
            ("source distribution", sources, [*self.committed, "PKG-INFO"]),
        ):
            if words := differing(there, expected):
                raise RuntimeError(f"{name}: {words}")
        return f"wheel {len(shipped)} files, source distribution {len(sources)}, as committed"

    def install(self, name: str, extras: Iterable[str], *options: str | Path) -> Path:
        home = self.work / name
        run([self.python, "-m", "venv", home])
        run(
            [
                home / "bin/python",
                "-m",
                "pip",
                "install",
                "--quiet",
                "--disable-pip-version-check",
                *options,
                f"{self.wheel}[{','.join(extras)}]",
            ]
        )
        return home

    def answers(self, home: Path) -> str:
        """Return what a bare environment answers, its network taken away."""
        folder = home / "try"
        folder.mkdir()
        environment = {"HOME": str(folder), "PATH": os.environ["PATH"], "LANG": "C.UTF-8"}
        alone = ["unshare", "--map-root-user", "--net"]
        if not shutil.which("unshare") or subprocess.run([*alone, "true"], check=False).returncode:
            raise RuntimeError(
                "the network cannot be taken away: unshare --map-root-user --net does not work here"
            )
        command = [*alone, home / "bin/rbfrag"]
        answer = json.loads(
            run(
                [*command, "predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--json"],
                cwd=folder,
                env=environment,
            )
        )
        demo = run([*command, "demo"], cwd=folder, env=environment)
        seconds = re.search(r"^done in (\d+ s)", demo, re.M)
        run([*command, "db", "check", "--db", "rbfrag-demo.db"], cwd=folder, env=environment)
        took = seconds[1] if seconds else "did not end"
        return f"predict {answer['probability']:.4f}; demo without a network: {took}"

    def newest(self) -> str:
        about = tomllib.loads((self.source / "pyproject.toml").read_text(encoding="utf-8"))
        extras = [
            name
            for name in about["project"]["optional-dependencies"]
            if name not in TOOLS or name == "samples"
        ]
        self.full = self.install("newest", extras)
        return self.answers(self.full)

    def lowest(self) -> str:
        bounds = self.work / "floors.txt"
        bounds.write_text(
            "".join(f"{name}=={version}\n" for name, version in sorted(floors().items()))
        )
        return self.answers(self.install("lowest", ["plot", "samples"], "--constraint", bounds))

    def licences(self) -> str:
        rows = json.loads(
            run(
                [
                    sys.executable,
                    "-m",
                    "piplicenses",
                    "--python",
                    self.full / "bin/python",
                    "--from",
                    "mixed",
                    "--format",
                    "json",
                ]
            )
        )
        odd = []
        for row in sorted(rows, key=lambda row: str(row["Name"]).lower()):
            licence = " ".join(row["License"].split())[:80]
            print(f"        {row['Name']:28} {row['Version']:14} {licence}")
            is_known = any(word in row["License"] for word in LICENCES)
            if not is_known and row["Name"] not in DATA_ONLY:
                odd.append(f"{row['Name']}: {row['License'][:40]}")
        if odd:
            raise RuntimeError("a licence that is not on the list: " + "; ".join(odd))
        return f"{len(rows)} packages"

    def materials(self) -> str:
        """Write what the wheel and its extras bring, and return how much it is."""
        version = versions_agree(self.source)
        bill = self.dist / f"rbfrag-{version}.cdx.json"
        command = [Path(sys.executable).with_name("cyclonedx-py"), "environment"]
        command += ["--output-reproducible", "--pyproject", self.source / "pyproject.toml"]
        run([*command, "--output-file", bill, self.full / "bin/python"])
        content = json.loads(bill.read_text(encoding="utf-8"))
        content["metadata"]["component"]["version"] = version
        content["components"].append(shipped_component(self.source / SHIPPED))
        text = json.dumps(content, indent=1)
        if str(self.work) in text or "file:" in text:
            raise RuntimeError("the bill of materials names files of this machine")
        bill.write_text(text, encoding="utf-8")
        self.bill = bill
        return f"{bill.name}, {len(content['components'])} components"


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--python", default=sys.executable, help="interpreter of the bare environments"
    )
    chosen = parser.parse_args(arguments)
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        check = Check(Path(folder), chosen.python)
        steps: tuple[tuple[str, Callable[[], str]], ...] = (
            ("build without git's files", check.build),
            ("metadata", check.metadata),
            ("files", check.files),
            ("newest versions, all extras", check.newest),
            ("lowest versions", check.lowest),
            ("licences", check.licences),
            ("bill of materials", check.materials),
        )
        for name, step in steps:
            try:
                print(f"ok      {name}: {step()}", flush=True)
            except (RuntimeError, OSError, StopIteration, AttributeError) as error:
                failed += 1
                print(f"FAILED  {name}: {error}", flush=True)
        if not failed:
            (ROOT / "dist").mkdir(exist_ok=True)
            for file in (check.sdist, check.wheel, check.bill):
                shutil.copy(file, ROOT / "dist")
    print(
        "fit for release; both distributions are in dist/, and their bill of materials"
        if not failed
        else f"{failed} of {len(steps)} steps failed"
    )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
