"""The quick way of `predict` and the full command line say the same."""

import os
import signal
import subprocess
import sys

import pytest
import typer

from rbfrag.cli.main import app
from rbfrag.cli.start import NAMES, NUMBERS, ONE_THREAD, numbers_and_names, quick_predict, run
from rbfrag.db.engine import opened_database
from rbfrag.db.models import save_model
from tests.cli.conftest import Shell
from tests.fragility.conftest import model_row

PLAIN = [
    ["--p2", "3", "--kr", "0.1", "--pgv", "0.6"],
    ["--p2=3", "--kr=.1", "--pgv=6e-1", "--json"],
    ["--json", "--pga", "0.5", "--tm", "0.5", "--kr", "0.1", "--p2", "3", "--pgv", "0.6"],
    ["--p2", "3", "--kr", "0.1", "--pgv", "60", "--level", "0.5"],
    ["--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--model", "wls-pgv"],
]
OF_THE_REFERENCE = [
    ["--ky", "0.1", "--displacement", "0.1", "--pgv", "0.6", "--kind", "sliding"],
    ["--ks", "0.1", "--ps2", "3", "--rotation", "2", "--pgv", "0.6", "--json"],
]
SHAPES = [
    ["--height", "2.4", "--width", "0.5", "--dip", "3", "--pgv", "0.6"],
    ["--height=2", "--width=0.4", "--beta=10", "--phi=35", "--pgv=0.8", "--json"],
    ["--height", "2.5", "--width", "2.5", "--dip", "20", "--phi", "32", "--displacement", "0.1",
     "--pgv", "0.5", "--verbose"],
    ["--s1", "1", "--s2", "0.4", "--gamma", "25", "--beta", "20", "--phi", "40", "--pgv", "0.4"],
    ["--height", "2", "--width", "0.4", "--kind", "rocking", "--pgv", "0.6"],
]  # fmt: skip
REFUSED = [
    ["--p2", "3"],
    ["--ky", "0.1", "--pgv", "0.6"],
    ["--height", "2.5", "--width", "2.5", "--dip", "20", "--phi", "32", "--pgv", "0.5"],
    ["--p2", "3", "--kr", "0.1", "--pgv", "-0.6"],
    ["--p2", "3", "--kr", "0.1"],
    ["--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--model", "nobody"],
    ["--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--level", "95"],
    ["--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--db", "none.db"],
    ["--p2", "3", "--kr", "0.1", "--beta", "5", "--pgv", "0.6"],
]


@pytest.fixture
def database(tmp_path, shell):
    with opened_database("rbfrag.db", create=True) as engine, engine.begin() as connection:
        for term in ("pgv", "pga_tm"):
            save_model(connection, model_row(term))


def same_answer(arguments, shell: Shell, capsys):
    assert quick_predict(arguments) == 0
    quick = capsys.readouterr()
    full = shell("predict", *arguments)
    assert quick.out == full.stdout != ""
    assert quick.err == full.stderr


@pytest.mark.parametrize("arguments", PLAIN, ids=" ".join)
@pytest.mark.usefixtures("database")
def test_the_same_answers(arguments, shell: Shell, capsys):
    same_answer(arguments, shell, capsys)


@pytest.mark.parametrize("arguments", [*OF_THE_REFERENCE, *SHAPES], ids=" ".join)
def test_the_same_answers_of_the_reference(arguments, shell: Shell, capsys):
    same_answer(arguments, shell, capsys)


@pytest.mark.parametrize("arguments", REFUSED, ids=" ".join)
@pytest.mark.usefixtures("database")
def test_what_is_refused_is_said_by_the_full_command(arguments, shell: Shell, capsys):
    assert quick_predict(arguments) is None
    assert capsys.readouterr() == ("", "")
    assert shell("predict", *arguments, expect=2).stderr.startswith("rbfrag: ")


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        [],
        ["--height", "2", "--width", "0.5", "--dip", "3", "--beta", "3", "--pgv", "0.6"],
        ["--p2", "three", "--kr", "0.1"],
        ["--p2", "3", "--kr", "0.1", "--pgv"],
        ["--p2", "3", "--kr", "0.1", "--pgx", "0.6"],
        ["--p2", "3", "--kr", "0.1", "extra"],
        ["--p2", "nan", "--kr", "0.1"],
        ["--p2", "3", "--kr", "0.1", "--motion", "a.AT2"],
        ["--batch", "a.csv", "--out", "b.csv"],
        ["--p2", "3", "--kr", "0.1", "--db", ""],
    ],
)
def test_all_else_is_left_to_the_full_command(arguments):
    assert numbers_and_names(arguments) is None


def test_every_quick_option_is_one_of_the_command():
    command = typer.main.get_command(app).get_command(None, "predict")  # type: ignore[attr-defined]
    known = {name for parameter in command.params for name in parameter.opts}
    assert {*NUMBERS, *NAMES, "--json"} <= known


def test_a_question_of_numbers_loads_few_modules_and_no_library(tmp_path):
    program = (
        "import sys; sys.argv = ['rbfrag', 'predict', '--p2', '3', '--kr', '0.1', '--pgv', '0.6']\n"
        "from rbfrag.cli.start import run\n"
        "try:\n    run()\nfinally:\n"
        "    heavy = {'typer', 'pydantic', 'numpy', 'scipy', 'numba', 'sqlalchemy', 'pandas'}\n"
        "    print(sorted(heavy & set(sys.modules)))\n"
        "    own = [name for name, module in sys.modules.items()\n"
        "           if name.startswith('rbfrag') and not hasattr(module, '__path__')]\n"
        "    print(*sorted(own))\n"
    )
    plain = {key: value for key, value in os.environ.items() if key != "RBFRAG_DB"}
    environment = {**plain, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True, text=True, cwd=tmp_path, env=environment, check=True,
    )  # fmt: skip
    lines = done.stdout.splitlines()
    assert lines[0].startswith("Of 100 such blocks")
    assert lines[-2] == "[]"
    # the model's digest, the words of the answer and the facts of its kind are among them
    assert len(lines[-1].split()) <= 45


@pytest.mark.parametrize(("stated", "used"), [(None, "1"), ("2", "2")])
def test_linear_algebra_has_one_thread_unless_more_are_asked_for(
    stated: str | None, used: str
) -> None:
    code = (
        "import os, sys\n"
        "from rbfrag.cli import start\n"
        "assert 'numpy' not in sys.modules\n"
        "sys.argv[1:] = ['--version']\n"
        "try:\n    start.run()\n"
        "except SystemExit:\n    print(os.environ[start.ONE_THREAD])\n"
    )
    env = {name: value for name, value in os.environ.items() if name != ONE_THREAD}
    env |= {} if stated is None else {ONE_THREAD: stated}
    done = subprocess.run(
        [sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True
    )
    assert done.stdout.split()[-1] == used


@pytest.mark.parametrize("words", [["predict", "--p2", "3", "--kr", "0.1"], ["block"]])
def test_an_interrupt_at_any_moment_has_its_status(
    monkeypatch: pytest.MonkeyPatch, words: list[str]
) -> None:
    def pressed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("rbfrag.cli.start.quick_predict", pressed)
    monkeypatch.setattr("rbfrag.cli.main.run", pressed)
    monkeypatch.setattr("sys.argv", ["rbfrag", *words])
    before = signal.getsignal(signal.SIGINT)
    try:
        with pytest.raises(SystemExit) as ended:
            run()
    finally:
        signal.signal(signal.SIGINT, before)
    assert ended.value.code == 130
