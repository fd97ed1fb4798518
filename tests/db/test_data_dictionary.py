"""Tables as columns, and the dictionary of what they mean."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from sqlalchemy import Engine, func, select, update

from rbfrag.db import data_dictionary as table_frames
from rbfrag.db import schema
from rbfrag.db.data_dictionary import (
    TABLES,
    columns_as_markdown,
    data_dictionary,
    dictionary_as_json,
    dictionary_as_markdown,
)
from rbfrag.errors import InputError
from rbfrag.exchange.database_tables import read_table

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "data-dictionary.md"

UNIT_OF_SUFFIX = {
    "_m_s": "m/s", "_rad_s": "rad/s", "_rad": "rad", "_deg": "deg", "_g": "g", "_m": "m", "_s": "s",
}  # fmt: skip


class TestDictionary:
    def test_every_column_of_the_schema_has_an_entry_in_its_order(self) -> None:
        documented = {table.name: [c.name for c in table.columns] for table in data_dictionary()}
        assert documented == {
            name: [column.name for column in table.c]
            for name, table in schema.metadata.tables.items()
        }

    def test_every_entry_says_something(self) -> None:
        for table in data_dictionary():
            assert table.meaning.endswith("."), table.name
            for column in table.columns:
                assert len(column.meaning) > 5, (table.name, column.name)

    def test_units_are_those_in_the_names(self) -> None:
        for table in data_dictionary():
            for column in table.columns:
                suffix = next((s for s in UNIT_OF_SUFFIX if column.name.endswith(s)), None)
                if suffix is not None:
                    assert column.unit == UNIT_OF_SUFFIX[suffix], (table.name, column.name)

    def test_types_and_references_come_from_the_schema(self) -> None:
        column = {c.name: c for c in TABLES["combination"].columns}
        assert column["motion_id"].type == "integer"
        assert column["motion_id"].refers_to == "motion.id"
        assert column["vertical_motion_id"].may_be_missing
        assert column["certified"].type == "true/false"
        assert column["kr"].type == "number"
        assert TABLES["motion"].columns[-3].type == "array"

    def test_json_and_markdown_name_every_column(self) -> None:
        document, text = dictionary_as_json(), dictionary_as_markdown()
        names = [(t["name"], c["name"]) for t in document["tables"] for c in t["columns"]]
        assert len(names) == sum(len(table.c) for table in schema.metadata.tables.values())
        for line in text.splitlines():
            if line.startswith("|"):
                assert len(re.findall(r"(?<!\\)\|", line)) == 5, line
        for table, column in names:
            section = text.split(f"## {table}\n")[1].split("## ")[0]
            assert f"| {column} |" in section

    def test_the_page_has_every_column(self) -> None:
        text = PAGE.read_text(encoding="utf-8")
        common = text.split("### Columns of several tables\n")[1].split("\n### ")[0]
        for table in data_dictionary():
            section = text.split(f"\n### {table.name}\n")[1].split("\n### ")[0]
            for column in table.columns:
                row = columns_as_markdown([column]).splitlines()[-1]
                assert row in section or (row in common and f"`{column.name}`" in section), row


def url(engine: Engine) -> str:
    return engine.url.render_as_string(hide_password=False)


class TestFrames:
    def test_numbers_texts_and_truths(self, filled: Engine) -> None:
        table = read_table("combination", db=url(filled))
        assert list(table) == [column.name for column in schema.combination.c]
        assert table.dtypes.astype(str).to_dict() == {
            **dict.fromkeys(table, str(pd.Series([""]).dtype)),
            "reentrant": "object",
            **dict.fromkeys(("id", "campaign_id", "motion_id", "n_runs", "digest"), "int64"),
            **dict.fromkeys(("linear", "certified"), "bool"),
            "vertical_motion_id": "Int64",
            **dict.fromkeys(
                ("p2", "yield_g", "search_limit", "kr_over_pga", "lower", "upper", "kr", "y_m_s",
                 "k_up_over_pga", "undecided", "island_width", "kr_over_pga_resolved"),
                "float64",
            ),
        }  # fmt: skip
        assert (table["kr"].isna() == (table["status"] == "below_limit")).all()
        assert table["id"].is_monotonic_increasing
        assert table["vertical_motion_id"].isna().all()
        assert "samples" not in read_table("motion", db=url(filled))

    def test_values_are_those_of_the_rows(self, filled: Engine) -> None:
        columns = read_table("simulation", db=url(filled))
        with filled.connect() as connection:
            rows = connection.execute(
                select(schema.simulation).order_by(*schema.simulation.primary_key.columns)
            ).all()
        assert [row.kr_over_pga for row in rows] == columns["kr_over_pga"].tolist()
        assert [row.outcome for row in rows] == columns["outcome"].tolist()
        theta = [np.nan if row.theta_n is None else row.theta_n for row in rows]
        np.testing.assert_array_equal(columns["theta_n"], theta)

    def test_samples_are_arrays(self, filled: Engine, make_motion: Any) -> None:
        with filled.begin() as connection:
            last = connection.scalar(select(func.max(schema.motion.c.id)))
            gone = update(schema.motion).where(schema.motion.c.id == last).values(samples=None)
            connection.execute(gone)
        samples = read_table("motion", db=url(filled), arrays=True)["samples"]
        np.testing.assert_array_equal(samples[0], make_motion(1).acceleration_g)
        assert samples[2] is None

    def test_batches_make_one_table(self, filled: Engine, monkeypatch: Any) -> None:
        table = read_table("simulation", db=url(filled))
        monkeypatch.setattr(table_frames, "_ROWS", 4)
        with filled.connect() as connection:
            frames = table_frames.frames(connection, "simulation", TABLES["simulation"].columns)
            assert [len(frame) for frame in frames] == [4, 4, 4, 4, 2]
        pd.testing.assert_frame_equal(read_table("simulation", db=url(filled)), table)

    def test_chosen_columns_and_empty_tables(self, filled: Engine) -> None:
        selection = read_table("motion", db=url(filled), columns=["pga_g", "id", "pga_g"])
        none = read_table("response", db=url(filled))
        assert list(selection) == ["pga_g", "id"]
        assert none["kr"].shape == (0,)
        assert none["kr"].dtype == np.float64

    def test_unknown_names_are_rejected_with_those_there_are(self, filled: Engine) -> None:
        with pytest.raises(InputError, match="unknown table 'motions'; the tables are earthquake"):
            read_table("motions", db=url(filled))
        with pytest.raises(InputError, match="no column 'pga'; it has: id, recording_id"):
            read_table("motion", db=url(filled), columns=["pga"])
