"""Modules that a start of the command loads, and its end when it is stopped."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from rbfrag.cli.main import ONE_THREAD, run

QUESTIONS = (
    "--pgv .6 --pga .4 --p2 3 --kr .1 --component rotd50",
    "--p2 3 --kr 0.1 --pgv 0.6",
    "--height 2 --width 0.4 --phi 40 --pgv 0.9",
)
HEAVY = {"pydantic", "rich", "numpy", "scipy", "numba", "sqlalchemy", "pandas"}


def start(program: str, **environment: str) -> subprocess.CompletedProcess[str]:
    plain = {name: value for name, value in os.environ.items() if name not in ("RBFRAG_DB",)}
    path = os.pathsep.join(part for part in sys.path if part)
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False,
        env={**plain, "PYTHONPATH": path, **environment},
    )  # fmt: skip


@pytest.mark.parametrize("question", QUESTIONS)
def test_a_question_of_numbers_loads_few_modules_and_no_library(
    tmp_path: Path, question: str
) -> None:
    process = start(
        f"import os, sys; os.chdir({str(tmp_path)!r})\n"
        f"sys.argv = ['rbfrag', 'predict', *{question.split()!r}]\n"
        "from rbfrag.cli.main import run\n"
        "try:\n    run()\nexcept SystemExit as end:\n"
        "    print(end.code, file=sys.stderr)\n"
        f"    print(sorted({HEAVY!r} & set(sys.modules)), file=sys.stderr)\n"
        "    print(*[name for name, module in sys.modules.items() if name.startswith('rbfrag')\n"
        "            and not hasattr(module, '__path__')], file=sys.stderr)\n"
    )
    *_, status, heavy, modules = process.stderr.splitlines()
    assert (status, heavy) == ("0", "[]")
    assert process.stdout
    assert len(modules.split()) <= 52


def test_the_help_of_all_commands_loads_few_modules_and_no_library() -> None:
    process = start(
        "import sys, typer\n"
        "from rbfrag.cli.main import COMMANDS, app\n"
        "command = typer.main.get_command(app)\n"
        "for name in COMMANDS:\n"
        "    words = [name, '--help']\n"
        "    assert command(words, standalone_mode=False) == 0\n"
        "    for part in getattr(command.get_command(None, name), 'commands', ()):\n"
        "        assert command([name, part, '--help'], standalone_mode=False) == 0\n"
        f"print(sorted({HEAVY - {'rich'}!r} & set(sys.modules)), file=sys.stderr)\n"
        "print(*[name for name in sys.modules if name.startswith('rbfrag')], file=sys.stderr)\n"
    )
    heavy, modules = process.stderr.splitlines()
    assert (process.returncode, heavy) == (0, "[]")
    assert process.stdout.count("Usage:") > len(modules.split()) / 2
    # less the modules of the commands themselves: what the help of any of them may load
    assert len([name for name in modules.split() if ".commands." not in name]) <= 60


@pytest.mark.parametrize(("setting", "used"), [("", "1"), ("2", "2")])
def test_linear_algebra_has_one_thread_unless_more_are_asked_for(setting: str, used: str) -> None:
    process = start(
        "import os, sys\n"
        f"{'' if setting else f'os.environ.pop({ONE_THREAD!r}, None)'}\n"
        "from rbfrag.cli import main\n"
        "assert 'numpy' not in sys.modules\n"
        "sys.argv[1:] = ['--version']\n"
        f"try:\n    main.run()\nexcept SystemExit:\n    print(os.environ[{ONE_THREAD!r}])\n",
        **({ONE_THREAD: setting} if setting else {}),
    )
    assert process.stdout.split()[-1] == used


@pytest.mark.parametrize("module", ["typer", "rbfrag.cli.commands.predict", "rbfrag.version"])
def test_an_interrupt_while_libraries_load_has_its_status(module: str) -> None:
    process = start(
        "import sys\n"
        "class Pressed:\n"
        "    def find_spec(self, name, *_):\n"
        f"        if name == {module!r}:\n            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Pressed())\n"
        "sys.argv = ['rbfrag', 'predict', '--p2', '3']\n"
        "from rbfrag.cli.main import run\nrun()\n"
    )
    assert (process.returncode, process.stderr, process.stdout) == (130, "", "")


def test_a_second_interrupt_ends_in_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    def pressed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("rbfrag.cli.main.app", pressed)
    before = signal.getsignal(signal.SIGINT)
    try:
        with pytest.raises(SystemExit) as ended:
            run()
    finally:
        signal.signal(signal.SIGINT, before)
    assert ended.value.code == 130


def test_a_closed_pipe_ends_without_a_traceback() -> None:
    process = start(
        "import os, sys\n"
        "reader, writer = os.pipe()\n"
        "os.close(reader)\n"
        "os.dup2(writer, 1)\n"
        "sys.argv = 'rbfrag predict --p2 3 --kr 0.1 --pgv 0.6 --json'.split()\n"
        "from rbfrag.cli.main import run\nrun()\n"
    )
    assert (process.returncode, process.stderr) == (1, "")
