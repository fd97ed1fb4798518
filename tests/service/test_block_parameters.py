"""A block is described alike wherever one is taken: by numbers, sides, angles or fractures."""

import math

import pytest

from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.single import stability

ANGLES = {"alpha1": -15, "alpha3": 24, "r3": 2.5, "beta": 18, "phi": 38}
FRACTURES = {"s1": 4.5, "s2": 1.6, "gamma": 85, "beta": 18, "phi": 38}
RECTANGLE = {"height": 2.0, "width": 0.5, "dip": 3.0}


def numbers_of(shape):
    """p2 and kr of a shape, as Python gives them."""
    if "height" in shape:
        block = Block.rectangle(shape["height"], shape["width"])
        return block.p2, math.tan(math.atan(0.25) - math.radians(shape["dip"]))
    if "r3" in shape:
        block = Block.from_angles(-15.0, 24.0, 2.5)
    else:
        block = Block.from_fractures(4.5, 1.6, 85.0)
    return block.p2, stability(block, beta_deg=18.0, phi_deg=38.0).kr


@pytest.mark.parametrize(
    "shape", [ANGLES, FRACTURES, RECTANGLE], ids=["angles", "spacings", "sides"]
)
def test_a_shape_is_answered_as_its_numbers(client, shape):
    p2, kr = numbers_of(shape)
    result = client.get("/v1/predict", params={**shape, "pgv": 0.6}).json()
    same = client.get("/v1/predict", params={"p2": p2, "kr": kr, "pgv": 0.6}).json()
    for name in ("kind", "model"):
        assert result[name] == same[name]
    for name in ("probability", "ci_low", "ci_high", "y_m_s"):
        assert result[name] == pytest.approx(same[name], rel=1e-9)


def test_a_rectangle_without_friction_is_taken_to_topple_and_says_so(client):
    query = {**RECTANGLE, "pgv": 0.6}
    taken = client.get("/v1/predict", params=query).json()
    assert "assumed to topple" in taken["warnings"][0]
    checked = client.get("/v1/predict", params={**query, "phi": 30}).json()
    assert not [words for words in checked["warnings"] if "assumed to topple" in words]
    assert checked["probability"] == pytest.approx(taken["probability"], rel=1e-9)


def test_a_list_of_rectangles_is_answered_as_each_of_them(client):
    body = {"height": [2.0, 3.0, None], "width": 0.5, "dip": [3.0, 0.0, 0.0], "pgv": 0.6}
    result = client.post("/v1/predict", json=body).json()
    for i in range(2):
        query = {"height": body["height"][i], "width": 0.5, "dip": body["dip"][i], "pgv": 0.6}
        single = client.get("/v1/predict", params={**query, "model": result["model"]}).json()
        assert result["probability"][i] == pytest.approx(single["probability"], rel=1e-12)
    assert result["probability"][2] is None


def test_a_shape_that_slides_is_answered_where_sliding_is_asked_for(client):
    shape = {**ANGLES, "phi": 22, "pgv": 0.6}
    rejected = client.get("/v1/predict", params=shape)
    assert rejected.status_code == 422
    assert "the block slides (yield 0.07 g): give displacement" in rejected.json()["detail"]
    query = {**shape, "kind": "sliding", "displacement": 0.05}
    assert client.get("/v1/predict", params=query).json()["kind"] == "sliding"


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ("height=2", "width is missing"),
        ("height=2&width=0", "width must be above 0 m, not 0"),
        ("height=2&width=0.5&kr=0.1", "kr cannot be combined with height"),
        ("height=2&width=0.5&r3=2", "r3 cannot be combined with height"),
        ("height=2&width=0.5&dip=3&beta=3", "dip cannot be combined with beta"),
        ("alpha1=-15&alpha3=24&r3=2.5", "beta is missing"),
        ("alpha1=-15&alpha3=24&r3=2.5&beta=18", "phi is missing"),
        ("p2=3&kr=0.1&phi=30", "phi requires the geometry of a block"),
        ("p2=3&kr=0.1&no_back=true", "no_back requires the geometry of a block"),
    ],
)
def test_what_is_no_single_block_is_rejected(client, query, words):
    answer = client.get(f"/v1/predict?{query}&pgv=0.6")
    assert answer.status_code == 422
    detail = answer.json()["detail"]
    assert words in detail
    assert "--" not in detail


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"height": [2, 3], "pgv": 1}, "width is missing"),
        ({"height": 2, "width": [0.5], "kr": 0.1, "pgv": 1}, "kr cannot be combined with height"),
        ({"height": 2, "width": "0.5", "pgv": 1}, "width = '0.5' is not a number"),
    ],
)
def test_a_list_of_what_is_no_rectangle_is_rejected(client, body, words):
    answer = client.post("/v1/predict", json=body)
    assert answer.status_code == 422
    assert words in answer.json()["detail"]


def test_block_and_drawing_take_a_rectangle(client):
    query = {**RECTANGLE, "phi": 40}
    result = client.get("/v1/block", params=query).json()
    assert (result["p2"], result["kr"]) == pytest.approx(numbers_of(RECTANGLE), rel=1e-9)
    drawn = client.get("/v1/drawing", params=query).json()["block"]
    assert drawn.pop("text")["sentences"]
    assert drawn == result
