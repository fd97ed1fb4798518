"""Which model answers follows from what is given of the shaking, in every interface alike."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

import rbfrag
from rbfrag.db.location import REFERENCE
from rbfrag.service.app import make_app
from rbfrag.service.settings import ServiceSettings
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S
from tests.cli.conftest import Shell
from tests.cli.conftest import shell as shell

MEASURES: dict[str, Any] = {"pgv_m_s": 0.6, "pga_g": 0.5, "tm_s": 0.7, "magnitude": 6.8}
SPECTRUM = {t: round(0.9 * min(1.0, t / 0.4, 0.5 / t), 4) for t in SPECTRUM_PERIODS_S}

PGV, PGA, TM, M = ("pgv_m_s",), ("pga_g",), ("tm_s",), ("magnitude",)
SETS: tuple[tuple[tuple[str, ...], tuple[float, ...], str, str], ...] = (
    # measures, periods of SA, model of backed blocks, model of free-standing blocks
    (PGV, (), "toppling-pgv", "rocking-pgv"),
    (PGV + TM, (), "toppling-pgv", "rocking-pgv"),
    (PGV, (1.0,), "toppling-pgv", "rocking-pgv"),
    (PGV + PGA, (), "toppling-pgv_pga", "rocking-pga"),
    (PGV + PGA + TM, (), "toppling-pgv_pga", "rocking-pga"),
    (PGV + PGA, (0.3, 1.0, 3.0), "toppling-pgv_pga", "rocking-pga"),
    (PGV + PGA, (0.6,), "toppling-pgv_pga", "rocking-pga"),
    (PGV + PGA, SPECTRUM_PERIODS_S, "toppling-pgv_pga", "rocking-pga"),
    (PGA, (), "toppling-pga", "rocking-pga"),
    (PGA + TM, (), "toppling-pga", "rocking-pga"),
    (PGA + M, (), "toppling-pga", "rocking-pga"),
    (PGA, (0.2, 0.5, 1.0, 2.0, 3.0), "toppling-pga", "rocking-pga"),
    (PGA + TM, (1.0,), "toppling-pga", "rocking-pga"),
    ((), (1.0,), "toppling-sa", "rocking-sa"),
    ((), (0.4,), "toppling-sa", "rocking-sa"),
    (TM, (0.5, 2.0), "toppling-sa", "rocking-sa"),
    ((), SPECTRUM_PERIODS_S, "toppling-sa", "rocking-sa"),
)

CASES = [
    pytest.param(kind, inputs, periods, model, id=f"{model}: {', '.join(inputs)} {len(periods)} SA")
    for inputs, periods, *models in SETS
    for kind, model in zip(("toppling", "rocking"), models, strict=True)
]

OPTIONS = {"pgv_m_s": "pgv", "pga_g": "pga", "tm_s": "tm", "magnitude": "magnitude"}
NUMBERS = ("probability", "ci_low", "ci_high")


@pytest.fixture(scope="module")
def client() -> Iterator[TestClient]:
    with TestClient(make_app(ServiceSettings(db=str(REFERENCE)))) as client:
        yield client


@pytest.mark.parametrize(("kind", "inputs", "periods", "model"), CASES)
def test_every_interface_answers_by_the_same_model(
    shell: Shell,
    client: TestClient,
    kind: str,
    inputs: tuple[str, ...],
    periods: tuple[float, ...],
    model: str,
) -> None:
    measures = {name: MEASURES[name] for name in inputs}
    spectrum = {t: SPECTRUM.get(t, 0.7) for t in periods}
    question: dict[str, Any] = dict(measures, **({"sa_g": spectrum} if spectrum else {}))
    single = rbfrag.predict(3.0, 0.1, kind=kind, **question)
    assert single.model == model
    assert 0.0 < single.probability < 1.0
    expected = [getattr(single, name) for name in NUMBERS]

    def agrees(document: dict[str, Any]) -> None:
        assert document["model"] == model
        assert [document[name] for name in NUMBERS] == pytest.approx(expected, rel=1e-12)

    # arrays of blocks and of shaking
    for varied in ("kr", *measures, *(["sa_g"] if spectrum else [])):
        arrays: dict[str, Any] = {"kr": 0.1, **question}
        if varied == "sa_g":
            arrays["sa_g"] = {t: np.array([sa, 1.2 * sa]) for t, sa in spectrum.items()}
        else:
            arrays[varied] = np.array([arrays[varied], 1.2 * arrays[varied]])
        many = rbfrag.predict(3.0, **arrays, kind=kind)
        assert many.model == model
        first = [float(getattr(many, name)[0]) for name in NUMBERS]
        assert first == pytest.approx(expected, rel=1e-12)

    # the shell, and a table
    words = [part for name, x in measures.items() for part in (f"--{OPTIONS[name]}", str(x))]
    words += [part for t, sa in spectrum.items() for part in ("--sa", f"{t:g}={sa}")]
    block = ("--p2", "3", "--kr", "0.1", "--kind", kind)
    agrees(shell.json("predict", *block, *words))
    row = {"p2_1_s2": 3.0, "kr": 0.1, **measures, **{f"sa({t:g})": x for t, x in spectrum.items()}}
    with Path("blocks.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, [*row])
        table.writeheader()
        table.writerow(row)
    table_answer = shell.json("predict", "--blocks", "blocks.csv", "--kind", kind)
    (answered,) = table_answer["blocks"]
    assert [answered[name] for name in NUMBERS] == pytest.approx(expected, rel=1e-12)
    assert table_answer["model"] == model

    # requests
    query: dict[str, Any] = {"p2": 3.0, "kr": 0.1, "kind": kind}
    query |= {OPTIONS[name]: x for name, x in measures.items()}
    by_query = {**query, "sa": [f"{t:g}:{sa}" for t, sa in spectrum.items()]} if spectrum else query
    agrees(client.get("/v1/predict", params=by_query).json())
    by_body = {**query, "sa": {f"{t:g}": sa for t, sa in spectrum.items()}} if spectrum else query
    agrees(json.loads(client.post("/v1/predict", json=by_body).text))
