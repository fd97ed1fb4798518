"""The ground under one size of block, as the kernels of the critical search take it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.remaining_drive import linear_drive
from rbfrag.solver.integrator.spans import COLUMNS, LENGTHS, SPAN_PH, fill_spans
from rbfrag.solver.integrator.taylor import PH_MAX

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SPAN_LEVELS = 3
"""Lengths of span in use at a time: near an event only short ones fit."""


class Ground(NamedTuple):
    """One excitation and one p².

    Args:
        time_s: node times [s], shape (n,).
        interval_s: interval lengths [s], shape (n - 1,).
        k_h: driving acceleration at the nodes [g], shape (n,).
        w: 1 + k_v at the nodes, shape (n,).
        q: k_h/(1 + k_v) at the nodes, shape (n,).
        tail_min_q: least q from each node on, rest after the record included, shape (n,).
        block_max_q: greatest q of each block of nodes.
        still: what of the drive is to come (`rbfrag.solver.integrator.remaining_drive`), shape
            (n,).
        still_max: greatest of it.
        still_node: node after that.
        spans: rows of `rbfrag.solver.integrator.spans`, of one length after the other.
        span_length: intervals of a span, by falling length, shape (levels,).
        span_row: row at which each length begins, shape (levels,).
        span_ph: greatest p·T of a span.
        p: frequency parameter [1/s].
        ph_max: greatest p·h of one step.
        linear: the linear model.
        u: work, shape (9,).
        us: work, shape (9,), linear model only.
        uc: work, shape (9,), linear model only.
    """

    time_s: FloatArray
    interval_s: FloatArray
    k_h: FloatArray
    w: FloatArray
    q: FloatArray
    tail_min_q: FloatArray
    block_max_q: FloatArray
    still: FloatArray
    still_max: float
    still_node: int
    spans: FloatArray
    span_length: IntArray
    span_row: IntArray
    span_ph: float
    p: float
    ph_max: float
    linear: bool
    u: FloatArray
    us: FloatArray
    uc: FloatArray


def ground_of(drive: Excitation, *, p2: float, linear: bool, span_ph: float = SPAN_PH) -> Ground:
    """Bring together what the kernels need.

    Args:
        drive: the excitation; 1 + k_v > 0 throughout.
        p2: frequency parameter p² [1/s²].
        linear: the linear model, which is flown without spans.
        span_ph: greatest p·T of a span.
    """
    p = math.sqrt(p2)
    still = np.empty(drive.q.size)
    greatest, node = linear_drive(drive.interval_s, drive.k_h, p, still)
    lengths: list[int] = []
    if not linear and drive.interval_s.size:
        usual_s = float(drive.time_s[-1] - drive.time_s[0]) / drive.interval_s.size
        lengths = [m for m in LENGTHS if m * usual_s * p <= span_ph][:SPAN_LEVELS]
    tables = [_spans(drive, length) for length in lengths]
    return Ground(
        time_s=drive.time_s,
        interval_s=drive.interval_s,
        k_h=drive.k_h,
        w=drive.w,
        q=drive.q,
        tail_min_q=drive.tail_min_q,
        block_max_q=drive.block_max_q,
        still=still,
        still_max=greatest,
        still_node=node,
        spans=np.concatenate([np.empty((0, COLUMNS)), *tables]),
        span_length=np.array(lengths, dtype=np.int64),
        span_row=np.cumsum([0, *(len(table) for table in tables)])[:-1].astype(np.int64),
        span_ph=span_ph,
        p=p,
        ph_max=PH_MAX,
        linear=linear,
        u=np.empty(9),
        us=np.empty(9),
        uc=np.empty(9),
    )


def _spans(drive: Excitation, length: int) -> FloatArray:
    rows = drive.span_tables.get(length)
    if rows is None:
        rows = np.empty((drive.interval_s.size // length, COLUMNS))
        fill_spans(drive.interval_s, drive.k_h, drive.w, length, rows)
        drive.span_tables[length] = rows
    return rows
