"""NRML: the samples, the way there and back, and files that are not whole."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbfrag.errors import InputError
from rbfrag.exchange.fragility_function import discrete_function, lognormal_function
from rbfrag.exchange.nrml import nrml_text, read_nrml
from rbfrag.hazards.curve import IntensityType

PGV = IntensityType("pgv_m_s", 0.01)
PGA = IntensityType("pga_g", 1.0)


def test_version_04_continuous(formats_dir: Path) -> None:
    parsed = read_nrml(formats_dir / "nrml04_fragility_continuous.xml")
    assert [(f.name, f.limit_state) for f in parsed] == [
        ("RC", "LS1"), ("RC", "LS2"), ("RM", "LS1"), ("RM", "LS2")
    ]  # fmt: skip
    # mean 0.2 and stddev 0.05 are those of the variable: β² = ln(1 + 1/16)
    assert parsed[0].beta == pytest.approx(math.sqrt(math.log(1.0625)), rel=1e-12)
    assert parsed[0].median == pytest.approx(0.2 / math.sqrt(1.0625), rel=1e-12)


def test_version_04_discrete(formats_dir: Path) -> None:
    first, second = read_nrml(formats_dir / "nrml04_fragility_discrete.xml")
    assert first.at([0.1, 0.25, 0.5, 9.0]) == pytest.approx([0.0073, 0.545, 0.99, 0.99])
    assert second.limit_state == "LS2"


def test_version_05(formats_dir: Path) -> None:
    parsed = read_nrml(formats_dir / "nrml05_fragility_continuous_and_discrete.xml")
    assert len(parsed) == 8
    assert [f.is_lognormal for f in parsed] == [True] * 4 + [False] * 4
    discrete = parsed[4]
    assert discrete.kind == IntensityType("sa_g", 1.0, 0.3)
    assert discrete.at([0.04, 0.05, 15.0]).tolist() == [0.0, 2.50257e-05, 1.0]


@given(
    st.floats(1e-3, 1e2),
    st.floats(0.02, 2.0),
    st.sampled_from([PGV, PGA]),
)
def test_lognormal_there_and_back(
    tmp_path_factory: pytest.TempPathFactory, median: float, beta: float, kind: IntensityType
) -> None:
    path = tmp_path_factory.getbasetemp() / "there.xml"
    single = lognormal_function("a", "toppled", kind, median, beta, "test")
    path.write_text(nrml_text([single]))
    (back,) = read_nrml(path)
    x = median * np.exp(beta * np.linspace(-5.0, 5.0, 41))
    assert np.abs(back.at(x) - single.at(x)).max() < 1e-9


@given(st.lists(st.tuples(st.floats(1e-3, 1.0), st.floats(0.0, 1.0)), min_size=2, max_size=30))
def test_discrete_there_and_back(
    tmp_path_factory: pytest.TempPathFactory, steps: list[tuple[float, float]]
) -> None:
    path = tmp_path_factory.getbasetemp() / "back.xml"
    levels = np.cumsum([step for step, _ in steps])
    p = np.sort([value for _, value in steps])
    single = discrete_function("a & <b>", "toppled", PGV, levels, p, "test", 0.5 * levels[0])
    path.write_text(nrml_text([single]))
    (back,) = read_nrml(path)
    assert back.name == "a & <b>"
    x = np.linspace(0.0, 1.2 * levels[-1], 101)
    assert back.at(levels) == pytest.approx(p, abs=1e-9)
    apart = np.abs(x[:, None] - np.append(levels, 0.5 * levels[0])).min(axis=1) > 1e-9
    assert np.abs(back.at(x) - single.at(x))[apart].max() < 1e-6


def test_velocity_is_written_in_cm_s(tmp_path: Path) -> None:
    text = nrml_text([lognormal_function("a", "toppled", PGV, 0.5, 0.3, "test")])
    assert 'imt="PGV"' in text
    assert f'mean="{50.0 * math.exp(0.045)!r}"' in text


def test_what_cannot_be_written() -> None:
    single = lognormal_function("a", "toppled", PGV, 0.5, 0.3, "test")
    other = lognormal_function("b", "moved", PGV, 0.5, 0.3, "test")
    with pytest.raises(InputError, match="no fragility function"):
        nrml_text([])
    with pytest.raises(InputError, match="'a' occurs twice"):
        nrml_text([single, other, single])
    with pytest.raises(InputError, match="'b' has other limit states"):
        nrml_text([single, other])


COMPLETE = """<?xml version="1.0"?>
<nrml xmlns="http://openquake.org/xmlns/nrml/0.5">
<fragilityModel id="m" assetCategory="x" lossCategory="y"><limitStates>low high</limitStates>
<fragilityFunction id="A" format="discrete"><imls imt="PGV">10 20</imls>
<poes ls="low">0.1 0.5</poes>
<poes ls="high">0.0 0.2</poes>
</fragilityFunction></fragilityModel></nrml>"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('<poes ls="high">0.0 0.2</poes>', "", "line 4: 'A' lacks the limit state 'high'"),
        ('ls="high"', 'ls="higher"', "lacks the limit state 'high'"),
        ('ls="high"', 'ls="low"', "line 6: limit state 'low' is given twice"),
        ("0.1 0.5", "0.1", "2 levels and 1 probabilities"),
        ("0.1 0.5", "0.5 0.1", "decreases with increasing level"),
        ("0.1 0.5", "0.1 1.5", "outside 0 to 1"),
        ("0.1 0.5", "0.1 x", "'x' is not a number"),
        ("10 20", "20 10", "the levels must increase"),
        ('imt="PGV"', 'imt="CAV"', "'CAV' is unknown"),
        ('format="discrete"', 'format="other"', "neither continuous nor discrete"),
        ("<limitStates>low high</limitStates>", "", "limitStates is missing"),
        ("low high", " ", "there is no limit state"),
        ('id="A" ', "", "has no id"),
        ("</nrml>", "", "not well-formed"),
        ("<nrml xmlns", '<!DOCTYPE nrml [<!ENTITY a "b">]><nrml xmlns',
         "document type definition, which is not supported"),
    ],
)  # fmt: skip
def test_bad_files_are_rejected(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in COMPLETE
    path = tmp_path / "a.xml"
    path.write_text(COMPLETE.replace(old, new))
    with pytest.raises(InputError, match=words):
        read_nrml(path)


def test_an_entity_bomb_does_not_go_off(tmp_path: Path) -> None:
    entities = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10 if i else "boom"}">' for i in range(12))
    path = tmp_path / "bomb.xml"
    path.write_text(f"<!DOCTYPE nrml [{entities}]><nrml>&e11;</nrml>")
    with pytest.raises(InputError, match="document type definition"):
        read_nrml(path)


@pytest.mark.parametrize("text", ["", "<nrml/>", "no xml"])
def test_empty_files_are_rejected(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.xml"
    path.write_text(text)
    with pytest.raises(InputError, match=r"empty|no fragility function|not well-formed"):
        read_nrml(path)
