"""Critical values out of a table: fits from them are those of the values themselves."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from rbfrag.db.check import check_database
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.merge import MergeReport
from rbfrag.db.queries import combination_table
from rbfrag.db.rows import IMPORTED
from rbfrag.errors import InputError, MergeConflictError
from rbfrag.exchange.tables.critical_values import NEEDED, import_critical_values
from rbfrag.fragility.fit.data import FitSource
from rbfrag.fragility.fit.fitting import fit
from rbfrag.solver.results import NUMERICS_VERSION

ROWS = 500
ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "howto" / "import-a-table.md").read_text(encoding="utf-8")
(MAP,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
"""The map of the page."""


@pytest.fixture(scope="module")
def source() -> FitSource:
    """500 critical values, of which nothing but themselves is known."""
    with opened_database(REFERENCE, read_only=True) as engine, engine.connect() as connection:
        table = combination_table(connection, doubtful_pgd=True)
    table = replace(table, upper=np.full(table.p2.size, np.nan))
    return FitSource.of_table(table).only(np.arange(ROWS))


@pytest.fixture(scope="module")
def columns(source: FitSource) -> pd.DataFrame:
    """They as the dissertation's kind of database may have them."""
    table = source.table
    return pd.DataFrame({
        "name": table.motion_id, "earthquake": table.event_id,
        "magnitude": table.measure("magnitude"),
        "pga": table.pga_g * 980.665, "pgv": table.pgv_m_s * 100.0, "pgd": table.pgd_m * 100.0,
        "tm": table.tm_s, "reverse_side": (table.polarity == "reverse").astype(int),
        "p2": table.p2, "kr": table.kr, "censored": (table.status != "found").astype(int),
    })  # fmt: skip


@pytest.fixture
def bring(columns: pd.DataFrame, tmp_path: Path) -> Callable[..., MergeReport]:
    """Import the table, with cells of its first rows and parts of its map replaced."""

    def run(
        cells: Mapping[str, object] | None = None, old: str = "", new: str = "", db: str = "ours.db"
    ) -> MergeReport:
        text = columns.astype(object)
        for row, (column, cell) in enumerate((cells or {}).items()):
            text.loc[row, column] = cell
        text.to_csv(tmp_path / "critical.tsv", sep="\t", index=False, na_rep="NULL")
        assert old in MAP
        (tmp_path / "map.toml").write_text(MAP.replace(old, new, 1), encoding="utf-8")
        files = tmp_path / "critical.tsv", tmp_path / "map.toml"
        return import_critical_values(*files, db=tmp_path / db)

    return run


def test_fits_of_the_source_are_repeated(
    bring: Callable[..., MergeReport], source: FitSource, tmp_path: Path
) -> None:
    report = bring()
    assert report.added["combination"] == ROWS
    assert report.added["simulation"] == (source.table.status == "found").sum()
    with (
        opened_database(tmp_path / "ours.db", read_only=True) as engine,
        engine.connect() as connection,
    ):
        assert check_database(connection) == []
        stored = combination_table(connection)
    assert set(stored.numerics_version) == {IMPORTED}
    order = ["event_id", "pgv_m_s", "polarity", "p2"]
    for name in (
        "kr",
        "kr_over_pga",
        "y_m_s",
        "pga_g",
        "pgd_m",
        "tm_s",
        "magnitude",
        "search_limit",
    ):
        ours, theirs = (
            pd.DataFrame({item: table.measure(item) for item in (*order, name)})
            .round({"pgv_m_s": 9})
            .sort_values(order)[name]
            for table in (stored, source.table)
        )
        np.testing.assert_allclose(ours, theirs, rtol=1e-12)
    for term in ("pgv", "pgd_tm"):
        of_table = fit(source, term=term, method="wls")
        again = fit(tmp_path / "ours.db", term=term, method="wls")
        assert again.n == of_table.n
        assert again.n_censored == of_table.n_censored
        ours, theirs = ([*item.coefficients.values()] for item in (again, of_table))
        np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-12)
    # the outcomes that the values stand for: what is weaker than the critical block topples
    strength = source.k_over_pga
    result = (source.table.status == "found")[:, None]
    outcome = np.where(result, source.table.kr_over_pga[:, None] >= strength, 0.0)
    outcome[~result & (strength <= source.table.search_limit[:, None])] = np.nan
    of_table = fit(replace(source, failed=outcome), term="pgv", method="logistic")
    again = fit(tmp_path / "ours.db", term="pgv", method="logistic")
    assert "imported" in again.warnings[0]
    for name, value in of_table.coefficients.items():
        assert again.coefficients[name] == pytest.approx(value, rel=1e-4)


def test_nothing_is_there_twice(bring: Callable[..., MergeReport]) -> None:
    assert bring().added["combination"] == ROWS
    again = bring()
    assert again.same["combination"] == ROWS
    assert again.added.keys() <= {"campaign"}
    with pytest.raises(MergeConflictError, match=r"critical.tsv \(there\).*kr_over_pga"):
        bring({"kr": 0.012345})
    with pytest.raises(MergeConflictError, match=r"pgd_m is .* here and .* there"):
        bring({}, '"cm"', '"mm"')


def test_fits_read_own_results_before_imported_ones(
    bring: Callable[..., MergeReport], tmp_path: Path
) -> None:
    shutil.copy(REFERENCE, tmp_path / "ours.db")
    bring()
    with (
        opened_database(tmp_path / "ours.db", read_only=True) as engine,
        engine.connect() as connection,
    ):
        assert set(combination_table(connection).numerics_version) == {NUMERICS_VERSION}


@pytest.mark.parametrize(
    ("cells", "old", "new", "message"),
    [
        ({"pgv": "fast"}, "", "", "critical.tsv, line 2: pgv_m_s is 'fast': it must be a number"),
        ({"name": 1, "p2": -3.0}, "", "", "line 3: p2 is '-3.0'"),
        ({"tm": "inf"}, "", "", "line 2: tm_s is 'inf'"),
        ({"earthquake": None}, "", "", "line 2: event is nan: give it a name"),
        ({"censored": "2"}, "", "", "line 2: status is '2': the map knows '0', '1', 'no_motion'"),
        ({"kr": None, "censored": 0}, "", "", "line [23]: kr is .*: where no block topples"),
        ({"kr": 40.0}, "", "", "line 2: kr is '40.0': it is above PGA"),
        ({}, '"cm/s2"', '"g"', "pga_g is .*: no ground shakes so: check its unit"),
        ({}, '"cm/s2"', '"kine"', "map.toml: the unit 'kine' of pga_g is not one of g, %g, m/s2"),
        ({}, '"tm"', '"t_m"', "critical.tsv has no column 't_m' of tm_s: name, earthquake"),
        ({}, 'event = "earthquake"\n', "", r"map.toml: \[columns\] must name event"),
        ({}, "kr =", "k_r =", "must name kr or kr_over_pga"),
        ({}, "polarity", "side", "side is not a field; the fields are motion"),
        ({}, "forward", "toe", "write polarity = .*forward"),
        ({}, "0.01", "-1", "and search_limit"),
        ({}, 'p2 = "p2"', 'p2 = { column = "reverse_side" }', "line .: p2 is '0'"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_rejected_with_its_line(
    bring: Callable[..., MergeReport], cells: dict[str, object], old: str, new: str, message: str,
    tmp_path: Path,
) -> None:  # fmt: skip
    with pytest.raises(InputError, match=message):
        bring(cells, old, new)
    assert not (tmp_path / "ours.db").exists()


def test_lines_of_one_table_do_not_contradict_each_other(tmp_path: Path) -> None:
    (tmp_path / "map.toml").write_text(
        "[columns]\n" + "\n".join(f'{name} = "{name}"' for name in (*NEEDED, "kr")), "utf-8"
    )
    head = ",".join((*NEEDED, "kr"))
    for lines, message in (
        (("a,e,3,.3,.4,.1,.05", "a,e,3,.3,.4,.1,.05"), "line 3: motion is 'a': its p²"),
        (("a,e,3,.3,.4,.1,.05", "a,e,1,.3,.5,.1,.05"), "line 3: pgv_m_s is '.5': its motion has"),
        (("a,e,3,.3,.4,.1,.05,7",), "line 2 has more cells"),
        (("a,e,3,.3,.4,.1,.05", "a,e,1,.3,.4,.1,.05,7"), "line 3"),
    ):  # fmt: skip
        (tmp_path / "t.csv").write_text("\n".join((head, *lines)))
        with pytest.raises(InputError, match=message):
            import_critical_values(tmp_path / "t.csv", tmp_path / "map.toml", db=tmp_path / "x.db")
