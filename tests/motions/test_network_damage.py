"""Files of networks damaged at random: a clean rejection or a valid motion, nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbfrag.errors import RbfragError
from rbfrag.motions.formats.rbfrag_csv import write
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import read_motions
from tests.motions.test_network_round_trips import STATE_NO_UNIT, WRITTEN
from tests.motions.written import at2, v2a
from tests.synthetic import shaking

SAMPLES = [f"{value:.3f}" for value in 10.0 * shaking(1, 40)]
FILES = {
    **WRITTEN,
    "PEER AT2": lambda: at2(SAMPLES, 0.01),
    "GeoNet V2A": lambda: v2a([("N28W", SAMPLES), ("UP", SAMPLES)], 0.02),
    "rbfrag CSV": lambda: (
        "\n".join(write([GroundMotion(shaking(2, 40), 0.02, station="S")])) + "\n"
    ),
}

PIECES = [
    b"nan", b"-", b"+", b".", b"E", b"9", b"0", b" ", b"\n", b"\r", b",", b";", b"#", b":", b"/",
    b"/&", b"(", b"inf", b"1e999", b"1e308", b"\xff", b"\xe2\x80\xa8", b"\x0c", b"\x1c", b"_",
    b"\xd9\xa3", b'"', b"[", b"{", b"}", b"null", b"true", b"|", b"*",
]  # fmt: skip

EDITS = ["flip", "replace", "insert", "delete", "drop line", "double line", "swap lines", "cut"]


def damaged(content: bytes, data: st.DataObject) -> bytes:
    text = bytearray(content)
    for _ in range(data.draw(st.integers(1, 4), label="edits")):
        edit = data.draw(st.sampled_from(EDITS))
        at = data.draw(st.integers(0, max(len(text) - 1, 0)), label="at")
        if "line" in edit:
            lines = text.splitlines(keepends=True)
            i = text.count(b"\n", 0, at)
            if i + 1 >= len(lines):
                continue
            if edit == "drop line":
                del lines[i]
            elif edit == "double line":
                lines.insert(i, lines[i])
            else:
                lines[i], lines[i + 1] = lines[i + 1], lines[i]
            text = bytearray(b"".join(lines))
        elif edit == "flip" and text:
            text[at] ^= data.draw(st.integers(1, 255))
        elif edit == "delete":
            del text[at : at + data.draw(st.integers(1, 100))]
        elif edit == "cut":
            del text[at:]
        else:
            piece = data.draw(st.sampled_from(PIECES))
            text[at : at + (len(piece) if edit == "replace" else 0)] = piece
    return bytes(text)


@pytest.mark.parametrize("name", FILES)
@settings(
    max_examples=200,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(data=st.data())
def test_damaged(tmp_path: Path, name: str, data: st.DataObject) -> None:
    path = tmp_path / "damaged"
    content = damaged(FILES[name]().encode(), data)
    path.write_bytes(content)
    last = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n").count(b"\n") + 1
    try:
        motions = read_motions(
            path,
            units="g" if name in STATE_NO_UNIT else data.draw(st.sampled_from(["g", None, None])),
            allow_partial=data.draw(st.booleans(), label="allow_partial"),
        )
    except RbfragError as error:
        message, line, motions = str(error), getattr(error, "line", None), []
    else:
        message, line = str(path), None
        assert motions
    assert str(path) in message
    assert line is None or 1 <= line <= last
    for motion in motions:
        assert np.isfinite(motion.acceleration_g).all()
        assert motion.dt_s is not None
        assert 0.0 < motion.dt_s < np.inf
