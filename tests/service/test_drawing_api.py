"""Drawing of a block on the page."""

import pytest

from rbfrag.plots.block import block_lines
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.single import stability

SHAPE = {"alpha1": -15, "alpha3": 24, "r3": 2.5, "beta": 18, "phi": 38}


def test_a_shape_is_drawn_on_its_planes(client):
    answer = client.get("/v1/drawing", params=SHAPE).json()
    block = Block.from_angles(-15.0, 24.0, 2.5)
    lines = block_lines(block, stability(block, beta_deg=18.0, phi_deg=38.0))
    assert answer["block"]["mode"] == "topple"
    assert answer["numbers"] == {"p2": answer["block"]["p2"], "kr": answer["block"]["kr"]}
    assert answer["outline_m"] == [list(point) for point in lines.outline]
    assert answer["contacts_m"] == {name: list(at) for name, at in lines.contacts.items()}
    assert answer["resultant_m"] == list(lines.resultant)


def test_two_numbers_are_drawn_as_a_rectangle(client):
    answer = client.get("/v1/drawing", params={"p2": 3, "kr": 0.1}).json()
    (remaining, _), (right, bottom), (_, top), _ = answer["outline_m"]
    assert (right - remaining) / (top - bottom) == pytest.approx(0.1)
    assert answer["rectangle_r3_m"] == pytest.approx(answer["block"]["r3_m"])
    assert (answer["kind"], answer["numbers"]) == ("toppling", {"p2": 3.0, "kr": 0.1})


@pytest.mark.parametrize(
    ("query", "kind", "names"),
    [
        ({"height": 2, "width": 0.5, "dip": 5}, "toppling", {"p2", "kr"}),
        ({"height": 2, "width": 0.5, "dip": -5, "no_back": True}, "rocking", {"p2", "kr"}),
        ({"height": 1, "width": 1, "dip": 20, "phi": 30}, "sliding", {"ky", "beta_deg"}),
        ({**SHAPE, "phi": 15}, "sliding", None),  # it slides without an earthquake
    ],
)
def test_what_predictions_read_of_a_block_comes_with_its_drawing(client, query, kind, names):
    answer = client.get("/v1/drawing", params=query).json()
    assert answer["kind"] == kind
    assert answer["numbers"] is None if names is None else set(answer["numbers"]) >= names
    if names == {"p2", "kr"}:
        inputs = {**answer["numbers"], "kind": kind, "pgv": 0.6}
        shape = {**query, "kind": kind, "pgv": 0.6}
        by_numbers, by_shape = (
            client.get("/v1/predict", params=item).json()["probability"] for item in (inputs, shape)
        )
        assert by_numbers == by_shape


@pytest.mark.parametrize(
    ("query", "named"),
    [
        ("", "p2"),
        ("p2=3", "kr"),
        ("p2=3&kr=-1", "kr"),
        ("p2=3&kr=0.1&beta=20", "p2"),
        ("alpha1=1&alpha3=20&r3=2&phi=30", "beta"),
        ("alpha1=-89.999&alpha3=89.9999999&r3=1e-320&beta=0&phi=9", "out of range"),
        ("s1=1&s2=x&gamma=60&beta=20&phi=30", "s2"),
    ],
)
def test_what_is_no_block_is_rejected_in_words(client, query, named):
    answer = client.get(f"/v1/drawing?{query}")
    assert answer.status_code == 422
    assert named in answer.json()["detail"]
    assert "--" not in answer.json()["detail"]
