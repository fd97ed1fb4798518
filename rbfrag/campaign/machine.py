"""Processor and versions, recorded with computing times."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("rbfrag", "numpy", "numba", "scipy")


def machine() -> dict[str, str | int | float | None]:
    """Return processor, cores, load and versions; nothing that identifies the computer."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "load": _load(),
        "system": platform.system(),
        "python": platform.python_version(),
        **{name: _version(name) for name in PACKAGES},
    }


def processor_and_compiler() -> str:
    """Return processor and compiler; if both are equal, results are bit-identical."""
    about = machine()
    return f"{about['processor']}, numba {about['numba']}"


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.processor() or platform.machine()
    for line in text.splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.machine()


def _load() -> float | None:
    """Return the load average of the last minute."""
    try:
        return round(os.getloadavg()[0], 2)
    except (AttributeError, OSError):
        return None


def _version(package: str) -> str | None:
    from rbfrag.version import __version__

    if package == "rbfrag":
        return __version__
    try:
        return version(package)
    except PackageNotFoundError:
        return None
