"""`rbfrag warm-up` leaves no kernel to compile."""

from __future__ import annotations

import pkgutil
import subprocess
from importlib import import_module

from numba.core.registry import CPUDispatcher

import rbfrag.hazards
import rbfrag.solver
from benchmarks.durability import COMMAND, environment
from tests.cli.conftest import Shell, shell

__all__ = ["shell"]


def test_every_kernel_is_there_afterwards_and_is_not_compiled_again(shell: Shell) -> None:
    first = shell("warm-up")
    assert "campaigns of kind rocking" in first.stderr
    # machine code on disk, of this state of the sources; inner kernels are compiled by others
    missing = [
        f"{name}.{item}"
        for package in (rbfrag.hazards, rbfrag.solver)
        for _, name, _ in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
        for item, kernel in vars(import_module(name)).items()
        if isinstance(kernel, CPUDispatcher) and kernel.py_func.__module__ == name
        if hasattr(kernel._cache, "_cache_file") and not kernel._cache._cache_file._load_index()
    ]
    assert missing == []
    # in another process nothing is left to compile
    message = subprocess.run(
        [*COMMAND, "warm-up"], env=environment(), capture_output=True, text=True, check=True,
        timeout=900,
    ).stderr  # fmt: skip
    assert "compiling" not in message
    assert "responses and searches" in message
