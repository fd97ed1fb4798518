"""Excitation of one block size, in the form used by the kernels of the critical search."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.spans import COLUMNS, LENGTHS, SPAN_ERROR, SPAN_PH, fill_spans
from rbfrag.solver.integrator.taylor import PH_MAX
from rbfrag.solver.results import FloatArray, IntArray


@kernel
def remaining_excitation(
    interval_s: FloatArray, k_h: FloatArray, p: float, remaining: FloatArray
) -> tuple[float, int]:
    """Fill the remaining excitation; return its maximum and the node after it.

    `remaining` at a node is G(t) = p integral_t^inf k_h(s) exp(-p (s - t)) ds, by G' = p (G - k_h)
    from the end backwards. In the linear model without vertical motion a block topples from
    (theta, theta') if theta'/p + G > theta_c - theta; the maximum of G, which may lie inside
    an interval where G = k_h, is the largest critical angle over all starts from rest.
    """
    g = 0.0
    greatest = 0.0
    where = 0
    h = -1.0
    decay = 0.0
    remaining[k_h.size - 1] = 0.0
    for i in range(interval_s.size - 1, -1, -1):
        # records are sampled evenly: one exponential serves them
        if interval_s[i] != h:
            h = interval_s[i]
            decay = math.exp(-p * h)
        # backwards in closed form over an interval: G' = p (G - k_h), k_h a straight line
        if h > 0.0:
            slope = (k_h[i + 1] - k_h[i]) / h
            rest = g - k_h[i + 1] - slope / p  # times exp(-p (t_end - t))
            # G turns where slope + p rest exp(-p (t_end - t)) = 0
            # G is greatest where G = k_h on a rise (docs/theory/toppling-spectrum.md)
            if slope > 0.0 and rest < 0.0:
                faded = -slope / (p * rest)
                if decay < faded <= 1.0:
                    turn = k_h[i + 1] + slope * math.log(faded) / p
                    if turn > greatest:
                        greatest = turn
                        where = i + 1
            g = k_h[i] + slope / p + rest * decay
        remaining[i] = g
        if g > greatest:
            greatest = g
            where = i
    return greatest, where


SPAN_LEVELS = 3
"""Lengths of span in use at a time: near an event only short ones fit."""


class BlockExcitation(NamedTuple):
    """One excitation and one p².

    Args:
        time_s: node times [s], shape (n,).
        interval_s: interval lengths [s], shape (n - 1,).
        k_h: driving acceleration at the nodes [g], shape (n,).
        w: 1 + k_v at the nodes, shape (n,).
        q: k_h/(1 + k_v) at the nodes, shape (n,).
        tail_min_q: least q from each node on, rest after the record included, shape (n,).
        block_max_q: greatest q of each block of nodes.
        remaining: remaining excitation at the nodes (:func:`remaining_excitation`), shape (n,).
        remaining_max: greatest of it.
        remaining_max_node: node after it.
        spans: rows of `rbfrag.solver.integrator.spans`, of one length after the other.
        span_length: intervals of a span, by falling length, shape (levels,).
        span_row: row at which each length begins, shape (levels,).
        span_ph: greatest p·T of a span.
        span_error: greatest error bound of a span, as of `spans.SPAN_ERROR`.
        p: frequency parameter [1/s].
        ph_max: greatest p·h of one step.
        u: coefficients of the last step, shape (9,).
    """

    time_s: FloatArray
    interval_s: FloatArray
    k_h: FloatArray
    w: FloatArray
    q: FloatArray
    tail_min_q: FloatArray
    block_max_q: FloatArray
    remaining: FloatArray
    remaining_max: float
    remaining_max_node: int
    spans: FloatArray
    span_length: IntArray
    span_row: IntArray
    span_ph: float
    span_error: float
    p: float
    ph_max: float
    u: FloatArray


def block_excitation(
    excitation: Excitation, *, p2: float, span_ph: float = SPAN_PH, span_error: float = SPAN_ERROR
) -> BlockExcitation:
    """Return the arrays that the kernels of the search need.

    Args:
        excitation: the excitation; 1 + k_v > 0 throughout.
        p2: frequency parameter p² [1/s²].
        span_ph: greatest p·T of a span.
        span_error: greatest error bound of a span, as of `spans.SPAN_ERROR`.
    """
    # everything that depends on p and the record but not on k_r is computed once per search
    p = math.sqrt(p2)
    remaining = np.empty(excitation.q.size)
    greatest, node = remaining_excitation(excitation.interval_s, excitation.k_h, p, remaining)
    # spans pay only while p·T stays below that for which their error is bounded
    lengths: list[int] = []
    if excitation.interval_s.size:
        usual_s = float(excitation.time_s[-1] - excitation.time_s[0]) / excitation.interval_s.size
        lengths = [m for m in LENGTHS if m * usual_s * p <= span_ph][:SPAN_LEVELS]
    tables = [_spans(excitation, length) for length in lengths]
    return BlockExcitation(
        time_s=excitation.time_s,
        interval_s=excitation.interval_s,
        k_h=excitation.k_h,
        w=excitation.w,
        q=excitation.q,
        tail_min_q=excitation.tail_min_q,
        block_max_q=excitation.block_max_q,
        remaining=remaining,
        remaining_max=greatest,
        remaining_max_node=node,
        spans=np.concatenate([np.empty((0, COLUMNS)), *tables]),
        span_length=np.array(lengths, dtype=np.int64),
        span_row=np.cumsum([0, *(len(table) for table in tables)])[:-1].astype(np.int64),
        span_ph=span_ph,
        span_error=span_error,
        p=p,
        ph_max=PH_MAX,
        u=np.empty(9),
    )


def _spans(excitation: Excitation, length: int) -> FloatArray:
    rows = excitation.span_tables.get(length)
    if rows is None:
        rows = np.empty((excitation.interval_s.size // length, COLUMNS))
        fill_spans(excitation.interval_s, excitation.k_h, excitation.w, length, rows)
        excitation.span_tables[length] = rows
    return rows
