"""What `rbfrag predict` says in words of P, its interval and one single earthquake."""

from __future__ import annotations

from typing import Any

import pytest

from rbfrag.cli.output import prediction_in_words


def words(
    p: float, interval: tuple[float, float], event: tuple[float | None, float | None]
) -> tuple[str, ...]:
    document: dict[str, Any] = {"probability": p, "level": 0.95}
    document |= {"ci_low": interval[0], "ci_high": interval[1]}
    return prediction_in_words(document | {"event_low": event[0], "event_high": event[1]})


def test_three_statements_in_counts_of_blocks() -> None:
    assert words(0.13, (0.11, 0.152), (0.049, 0.4)) == (
        "P: of 100 such blocks 13 fail, over all earthquakes and sites with these measures.",
        "Interval of P (95 %): 11 to 15 of 100, as far as the data tell it.",
        "In one single earthquake 5 to 40 of 100 such blocks fail (95 %).",
    )


@pytest.mark.parametrize(
    ("p", "interval", "event", "said"),
    [
        (
            0.004,
            (0.001, 0.008),
            (0.0001, 0.02),
            ("of 1000 such blocks 4", "1 to 8", "fewer than 1 to 20"),
        ),
        (
            0.9996,
            (0.99, 1.0),
            (0.9, 1.0),
            ("of 10000 such blocks 9996", "9900 to 10000", "9000 to 10000"),
        ),
        (
            1e-7,
            (1e-9, 1e-6),
            (0.0, 1e-5),
            ("blocks fewer than 1 fail", "fewer than 1 of 10000", "0 to fewer than 1"),
        ),
        (0.5, (0.5, 0.5), (0.5, 0.5), ("50 fail", ": 50 of 100", "earthquake 50 of 100")),
        (0.5, (0.4, 0.6), (None, None), ("50 fail", "40 to 60", "not known.")),
    ],
)
def test_counts_tell_p_from_0_and_1(p, interval, event, said) -> None:
    for sentence, part in zip(words(p, interval, event), said, strict=True):
        assert part in sentence


def test_what_cannot_fail_is_said_once() -> None:
    assert words(0.0, (0.0, 0.0), (0.0, 0.0)) == ("P: no such block fails.",)
