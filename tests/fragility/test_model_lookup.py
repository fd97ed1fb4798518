import os
import subprocess
import sys
from dataclasses import replace

import pytest

from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.models import load_model, save_model, set_default
from rbfrag.errors import DatabaseNotFoundError, InputError, ModelError, UnknownModelError
from rbfrag.fragility.model_selection import SHIPPED, ModelList, find_model, stored_rows
from rbfrag.question.question import predict


@pytest.fixture
def database(tmp_path, row):
    """A database that holds models named by their terms, and its path."""

    def make(*terms, default=None):
        path = tmp_path / "models.db"
        with opened_database(path, create=True) as engine, engine.begin() as connection:
            for term in terms:
                save_model(connection, row(term))
            if default is not None:
                set_default(connection, f"wls-{default}")
        return path

    return make


def test_the_default_answers_when_it_can(database):
    path = database("pgv", "pga_tm", "pgd_tm", default="pga_tm")
    assert find_model(None, ["pgv_m_s", "pga_g", "tm_s"], path).name == "wls-pga_tm"


@pytest.mark.parametrize(
    ("measures", "name"),
    [
        (["pgv_m_s"], "wls-pgv"),
        (["pgd_m", "tm_s"], "wls-pgd_tm"),
        (["pga_g", "tm_s"], "wls-pga_tm"),
        (["pgv_m_s", "pga_g", "tm_s"], "wls-pgv"),
    ],
)
def test_otherwise_the_best_that_the_measures_suffice_for(database, measures, name):
    path = database("pga_tm", "pgv", "pgd_tm", default="pgd_tm")
    assert find_model(None, measures, path).name == name


def test_terms_of_pgd_answer_by_name_alone(database):
    path = database("pgd_tm", "pga_tm")
    inputs = {"pgd_m": 0.1, "tm_s": 0.5, "db": path}
    with pytest.raises(InputError, match=r"give pga_g and tm_s; wls-pgd_tm: by name alone"):
        predict(3, 0.1, **inputs)
    assert predict(3, 0.1, **inputs, model="wls-pgd_tm").term == "pgd_tm"


def test_a_named_model_is_asked_whatever_the_default(database):
    path = database("pgv", "pga_tm")
    assert predict(3, 0.1, pga_g=0.4, tm_s=0.5, model="wls-pga_tm", db=path).term == "pga_tm"
    with pytest.raises(InputError, match=r"'wls-pga_tm' requires pga_g and tm_s .*given: pgv_m_s"):
        predict(3, 0.1, pgv_m_s=0.4, model="wls-pga_tm", db=path)
    with pytest.raises(UnknownModelError, match=r"'nobody'.*wls-pga_tm, wls-pgv"):
        predict(3, 0.1, pgv_m_s=0.4, model="nobody", db=path)


def test_measures_that_no_stored_model_works_with(database):
    path = database("pga_tm")
    with pytest.raises(InputError, match=r"no stored .* works with pgv_m_s: give pga_g and tm_s"):
        predict(3, 0.1, pgv_m_s=0.4, db=path)
    with pytest.raises(InputError, match=r"no stored .* works with pga_g: give pga_g and tm_s"):
        predict(3, 0.1, pga_g=0.4, db=path)
    with pytest.raises(
        InputError, match=r"tm_s is given: a prediction requires pga_g, or pgv_m_s, or sa"
    ):
        predict(3, 0.1, tm_s=0.4, db=path)


def test_a_database_without_models_says_how_to_make_one(database):
    with pytest.raises(UnknownModelError, match="rbfrag fit"):
        predict(3, 0.1, pgv_m_s=0.4, db=database())


def test_no_database_at_all(tmp_path):
    with pytest.raises(DatabaseNotFoundError):
        predict(3, 0.1, pgv_m_s=0.4, db=tmp_path / "none.db")


def test_a_model_answers_the_same_before_and_after_storage(database, row):
    path = database("pgv")
    assert predict(3, 0.1, pgv_m_s=0.4, db=path) == predict(3, 0.1, pgv_m_s=0.4, model=row())
    with opened_database(path, read_only=True) as engine, engine.connect() as connection:
        stored = load_model(connection, "wls-pgv")
    assert predict(3, 0.1, pgv_m_s=0.4, model=stored) == predict(3, 0.1, pgv_m_s=0.4, db=path)


def test_the_database_of_the_environment_and_folder_without_heavy_libraries(database):
    path = database("pgv")
    program = """
import sys
from dataclasses import replace
from rbfrag.question.question import predict
print(predict(3.0, 0.1, pgv_m_s=0.6).model)
heavy = {"numpy", "scipy", "pandas", "statsmodels", "numba", "matplotlib", "sqlalchemy"}
print(sorted(heavy & set(sys.modules)))
"""
    path = path.rename(path.with_name("rbfrag.db"))
    plain = {key: value for key, value in os.environ.items() if key != "RBFRAG_DB"}
    plain["PYTHONPATH"] = os.pathsep.join(p for p in sys.path if p)
    for folder, extra in ((path.parent, {}), (path.parent.parent, {"RBFRAG_DB": str(path)})):
        process = subprocess.run(
            [sys.executable, "-c", program],
            capture_output=True,
            text=True,
            cwd=folder,
            env={**plain, **extra},
        )
        assert process.returncode == 0, process.stderr
        assert process.stdout.split("\n")[:2] == ["wls-pgv", "[]"]


def test_the_reference_named_as_a_database_is_no_stopgap(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RBFRAG_DB", raising=False)
    for _ in range(2):
        assert predict(3.0, 0.1, pgv_m_s=0.6).data == SHIPPED
        answer = predict(3.0, 0.1, pgv_m_s=0.6, pga_g=0.5, db=REFERENCE, component="single")
        assert answer.warnings == ()


def test_a_database_without_a_model_does_not_take_the_place_of_the_reference(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RBFRAG_DB", raising=False)
    with opened_database("rbfrag.db", create=True):
        pass
    for _ in range(2):
        assert predict(3.0, 0.1, pgv_m_s=0.6).data == SHIPPED
    with pytest.raises(UnknownModelError, match="holds no model yet"):
        predict(3.0, 0.1, pgv_m_s=0.6, db="rbfrag.db")


@pytest.fixture
def scored(tmp_path, row):
    """A database of models with log losses, and its path."""

    def make(losses, default=None):
        path = tmp_path / "scored.db"
        with opened_database(path, create=True) as engine, engine.begin() as connection:
            for term, loss in losses.items():
                single = row(term)
                scores = {"scores": {"log_loss_held_out": loss}}
                save_model(
                    connection,
                    replace(single, diagnostics={**single.diagnostics, **scores}),
                    replace=True,
                )
            if default is not None:
                set_default(connection, f"wls-{default}")
        return path

    return make


@pytest.mark.parametrize(
    ("default", "measures", "name"),
    [
        (None, ["pgv_m_s", "pga_g", "tm_s"], "wls-pgv"),
        (None, ["pgv_m_s"], "wls-pgv"),
        (None, ["pga_g", "tm_s"], "wls-pga_tm"),
        ("pga_tm", ["pgv_m_s", "pga_g", "tm_s"], "wls-pga_tm"),
        ("pga_tm", ["pgv_m_s"], "wls-pgv"),
    ],
)
def test_the_order_of_terms_answers_unless_another_was_chosen(scored, default, measures, name):
    path = scored({"pgv": 0.20, "pga_tm": 0.15, "pgd_tm": 0.4}, default)
    for _ in range(2):
        assert find_model(None, measures, path).name == name


def stored(path, rows):
    with opened_database(path, create=True) as engine, engine.begin() as connection:
        for row in rows:
            save_model(connection, row)
    return path


def test_a_worse_model_that_is_not_known_here_hides_no_better_one(tmp_path, row):
    single = row("pgv")
    better = replace(
        single, diagnostics={**single.diagnostics, "scores": {"log_loss_held_out": 0.2}}
    )
    path = stored(tmp_path / "newer.db", [better, replace(single, name="newer", method="oracle")])
    assert predict(3.0, 0.1, pgv_m_s=0.6, db=path).model == better.name
    with pytest.raises(ModelError, match="update rbfrag"):
        predict(3.0, 0.1, pgv_m_s=0.6, db=path, model="newer")


def test_methods_that_are_compared_answer_where_no_other_does(tmp_path):
    names = ("wls-pgv", "toppling-pgv")
    rows = [replace(item, diagnostics={}) for item in stored_rows(REFERENCE) if item.name in names]
    assert len(rows) == len(names)
    result = find_model(None, ["p2", "kr", "pgv_m_s"], stored(tmp_path / "unscored.db", rows))
    assert result.name == "toppling-pgv"


def test_the_first_of_the_order_is_the_default(scored):
    path = scored({"pga_tm": 0.15, "pgv": 0.20})
    assert [row.name for row in stored_rows(path) if row.is_default] == ["wls-pgv"]
    with opened_database(path, read_only=True) as engine, engine.connect() as connection:
        assert load_model(connection).name == "wls-pgv"


def test_the_number_of_a_model_without_critical_values_is_that_of_its_outcomes():
    rows = {row.name: row for row in stored_rows(REFERENCE)}
    listed = {row["name"]: row["n"] for row in ModelList([*rows.values()]).rows()}
    rocking, toppling = (rows[name].diagnostics for name in ("rocking-pga", "toppling-pgv_pga"))
    assert rocking["n"] == 0
    assert listed["rocking-pga"] == rocking["n_outcomes"]
    assert listed["toppling-pgv_pga"] == toppling["n"] < toppling["n_outcomes"]


def test_a_model_of_another_form_is_rejected(row, tmp_path):
    file = tmp_path / "old.db"
    with opened_database(file, create=True) as engine, engine.begin() as connection:
        save_model(connection, replace(row(), form=1))
    for named in (None, "wls-pgv"):
        with pytest.raises(ModelError, match="fitted by another version of rbfrag: fit it again"):
            predict(3.0, 0.1, pgv_m_s=0.6, db=file, model=named)
