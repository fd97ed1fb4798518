"""Kernels say when they are compiled; those that only kernels call have no entry from Python."""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import pytest

import rbfrag
from rbfrag.solver.integrator.compiled import inner_kernel, kernel

SCRIPT = """
from rbfrag.solver.integrator.compiled import on_compilation
on_compilation(lambda: print("compiles"))
from rbfrag.solver.integrator.state import at_rest
from rbfrag.solver.integrator.taylor import turn
turn(0.1, 0.9, 0.01), at_rest(0.1)
"""


def test_the_first_compilation_is_announced_once_and_never_from_the_cache(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    message = [
        subprocess.run(
            [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True,
            check=True,
        ).stdout
        for _ in range(2)
    ]  # fmt: skip
    assert message == ["compiles\n", ""]


def test_machine_code_of_another_version_is_compiled_anew(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    run = [sys.executable, "-c", SCRIPT]
    subprocess.run(run, env=environment, check=True)
    (index,) = tmp_path.rglob("*.turn-*.nbi")
    # an index of this numba that names a class which is no longer there
    missing = b"cno_such_module\nNoSuchClass\n."
    index.write_bytes(pickle.dumps(numba.__version__) + missing)
    message = subprocess.run(run, env=environment, capture_output=True, text=True, check=True)
    assert message.stdout == "compiles\n"


def test_a_change_in_any_file_of_the_solver_outdates_machine_code(tmp_path: Path) -> None:
    package = tmp_path / "rbfrag"
    shutil.copytree(Path(rbfrag.__file__).parent, package)
    environment = {
        **os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(tmp_path)
    }  # fmt: skip

    def run_output() -> str:
        return subprocess.run(
            [sys.executable, "-c", SCRIPT], env=environment, cwd=tmp_path, capture_output=True,
            text=True, check=True,
        ).stdout  # fmt: skip

    assert [run_output(), run_output()] == ["compiles\n", ""]
    other = package / "solver" / "integrator" / "excursion.py"  # not where `turn` stands
    other.write_text(other.read_text() + "\n")
    assert run_output() == "compiles\n"


@pytest.mark.parametrize("safe", [True, False, "another's"])
def test_where_nothing_can_be_written_machine_code_is_kept_in_a_folder_of_the_users_own(
    tmp_path: Path, safe: bool | str
) -> None:
    expected = tmp_path / f"rbfrag-kernels-{os.getuid()}"
    if not safe:  # others may write there, and what lies in it would be run
        expected.mkdir()
        expected.chmod(0o777)
    if safe == "another's":
        if os.getuid() != 0:
            pytest.skip("only root can make a folder of another user")
        expected.mkdir(mode=0o700)
        os.chown(expected, 65534, 65534)
    environment = {
        **os.environ, "TMPDIR": str(tmp_path), "NUMBA_CACHE_DIR": "",
        # neither beside the package nor in a home
        "NUMBA_CACHE_LOCATOR_CLASSES": "UserProvidedCacheLocator",
    }  # fmt: skip
    script = (
        SCRIPT + "from rbfrag.solver.integrator.compiled import where_kept\nprint(where_kept())"
    )
    first, second = (
        subprocess.run(
            [sys.executable, "-c", script], env=environment, capture_output=True, text=True,
            check=True,
        ).stdout
        for _ in range(2)
    )  # fmt: skip
    if safe is True:
        assert first == f"compiles\nonce; they are kept in {expected}\n"
        assert second == first.removeprefix("compiles\n")
        assert expected.stat().st_mode & 0o077 == 0
    else:
        assert first == second
        assert first.startswith("compiles\nat each start: no folder")
        assert not list(expected.iterdir())


@inner_kernel
def doubled(x: float) -> float:
    return 2.0 * x


@kernel
def doubled_and_one(x: float) -> float:
    return doubled(x) + 1.0


def test_a_kernel_without_an_entry_rejects_a_call_from_python() -> None:
    assert doubled_and_one(2.0) == 5.0
    with pytest.raises(TypeError, match="doubled is called by other kernels only"):
        doubled(2.0)
