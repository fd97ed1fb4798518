"""Excitation of one block size, in the form used by the kernels of the critical search.

It holds tables of spans: steps over several samples, where steps of one sample would be far more
accurate than needed. Over a span of m intervals of total length T, with tau in [0, 1] and
P = (p T)², the driving acceleration a(tau) and the effective gravity w(tau) are replaced by their
projections on cubic polynomials, which keep the moments of degree 0 to 3 exactly. What is left out,
r = a - cubic, has no effect of first order: its double integral vanishes at the end of the span.
Its greatest effect, through the rotation that it causes inside the span, is the quadratic form ::

    U(1) += P² int d g2 dtau,     theta(1) += P² int (1 - tau) d g2 dtau,
    d = a sin(psi) + w cos(psi),  g2 = double integral of a cos(psi) - w sin(psi)

of which the part that the cubics miss is a number per span, known beforehand. The next terms are
smaller by p T theta'/p.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.compiled import fused_kernel, inner_kernel, kernel, within
from rbfrag.solver.integrator.taylor import PH_MAX
from rbfrag.solver.results import FloatArray, IntArray

SPAN_PH = 0.01
"""Greatest p·T of a span: its error is then below that of the margins of the certified search."""

SPAN_ERROR = 3e-13
"""Greatest P² r² of a span, r what the cubics leave of |a| + |w| at its nodes. The error of
theta'/p at its end is within 0.9 of that, and a hundredth of it as a rule: where samples jump
about, spans err by more than their length tells."""

LENGTHS = (64, 32, 16, 8, 4, 2)
"""Numbers of intervals that a span may have."""

COLUMNS = 19
"""T; bound of |a| + |w|; a0..a3; w0..w3; what the cubics miss of a·A2, a·W2, w·A2, w·W2 in U and
in theta; r, what they leave of |a| + |w| at the nodes."""

_X3 = math.sqrt(0.6)
_X5A = math.sqrt(5.0 - 2.0 * math.sqrt(10.0 / 7.0)) / 3.0
_X5B = math.sqrt(5.0 + 2.0 * math.sqrt(10.0 / 7.0)) / 3.0
_W5A = (322.0 + 13.0 * math.sqrt(70.0)) / 900.0
_W5B = (322.0 - 13.0 * math.sqrt(70.0)) / 900.0
_GAUSS3 = ((-_X3, 5.0 / 9.0), (0.0, 8.0 / 9.0), (_X3, 5.0 / 9.0))
_GAUSS5 = (
    (-_X5B, _W5B), (-_X5A, _W5A), (0.0, 128.0 / 225.0), (_X5A, _W5A), (_X5B, _W5B),
)  # fmt: skip


@inner_kernel
def _to_powers(moments: FloatArray) -> None:
    """Fill the powers of tau for Legendre moments: of the sum of (2k + 1) m_k P_k(2 tau - 1)."""
    m0, m1, m2, m3 = moments[0], 3.0 * moments[1], 5.0 * moments[2], 7.0 * moments[3]
    moments[0] = m0 - m1 + m2 - m3
    moments[1] = 2.0 * m1 - 6.0 * m2 + 12.0 * m3
    moments[2] = 6.0 * m2 - 30.0 * m3
    moments[3] = 20.0 * m3


@within
def _add_moments(moments: FloatArray, weighted: float, z: float) -> None:
    """Add a point to the Legendre moments of degree 0 to 3, z = 2 tau - 1."""
    moments[0] += weighted
    moments[1] += weighted * z
    moments[2] += weighted * (1.5 * z * z - 0.5)
    moments[3] += weighted * ((2.5 * z * z - 1.5) * z)


@within
def _add_products(
    row: FloatArray, weight: float, remaining: float, a: float, v: float, a2: float, w2: float
) -> None:
    """Add a point to the integrals of X Y2 and, weighted by `remaining`, of (1 - tau) X Y2."""
    row[10] += weight * a * a2
    row[11] += weight * a * w2
    row[12] += weight * v * a2
    row[13] += weight * v * w2
    row[14] += remaining * a * a2
    row[15] += remaining * a * w2
    row[16] += remaining * v * a2
    row[17] += remaining * v * w2


@inner_kernel
def _take_away_cubics(row: FloatArray) -> None:
    """Subtract the same integrals of the cubics, which leaves the contribution of the residual."""
    a_0, a_1, a_2, a_3 = row[2], row[3], row[4], row[5]
    w_0, w_1, w_2, w_3 = row[6], row[7], row[8], row[9]
    # of degree 8 and 9, which five points of Gauss are exact to
    for x, share in _GAUSS5:
        y = 0.5 * (1.0 + x)
        weight = 0.5 * share
        a = a_0 + y * (a_1 + y * (a_2 + y * a_3))
        v = w_0 + y * (w_1 + y * (w_2 + y * w_3))
        a2 = y * y * (a_0 / 2.0 + y * (a_1 / 6.0 + y * (a_2 / 12.0 + y * a_3 / 20.0)))
        w2 = y * y * (w_0 / 2.0 + y * (w_1 / 6.0 + y * (w_2 / 12.0 + y * w_3 / 20.0)))
        _add_products(row, -weight, -weight * (1.0 - y), a, v, a2, w2)


@inner_kernel
def _left_at_nodes(
    row: FloatArray, interval_s: FloatArray, k_h: FloatArray, w: FloatArray, first: int, length: int
) -> float:
    """Return the maximum residual of a at the nodes plus that of w, after the cubic fit."""
    most_a = most_w = at = 0.0
    for i in range(first, first + length + 1):
        a = row[2] + at * (row[3] + at * (row[4] + at * row[5]))
        v = row[6] + at * (row[7] + at * (row[8] + at * row[9]))
        most_a = max(most_a, abs(k_h[i] - a))
        most_w = max(most_w, abs(w[i] - v))
        if i < first + length:
            at += interval_s[i] / row[0]
    return most_a + most_w


@kernel
def fill_spans(
    interval_s: FloatArray, k_h: FloatArray, w: FloatArray, length: int, rows: FloatArray
) -> None:
    """Fill the row of every complete span of `length` intervals.

    Args:
        interval_s: interval lengths [s], shape (n - 1,).
        k_h: driving acceleration at the nodes [g], shape (n,).
        w: 1 + k_v at the nodes, shape (n,).
        rows: to be filled, shape (number of whole spans, COLUMNS).
    """
    # A row holds the length, a bound of |a| + w, the cubics of a and w, and the integrals of X Y2
    # and (1 - tau) X Y2 less those of the cubics, for X, Y = a, w and Y2 the double integral of Y
    # from the start of the span: with them d and g2 of the module's equation need no sum over
    # samples in a step. Last comes the maximum residual of the cubics at the nodes

    for number in range(rows.shape[0]):
        row = rows[number]
        # a first pass for the length, which the moments are taken over, and the bound of theta''
        first = number * length
        span_s = 0.0
        size = 0.0
        for i in range(first, first + length):
            span_s += interval_s[i]
            size = max(size, abs(k_h[i]) + abs(w[i]))
        size = max(size, abs(k_h[first + length]) + abs(w[first + length]))
        row[:] = 0.0
        row[0] = span_s
        row[1] = size
        if span_s <= 0.0:
            continue
        a_moments, w_moments = row[2:6], row[6:10]
        # rate and value of the double integrals of a and of w
        ra, rw, va, vw = 0.0, 0.0, 0.0, 0.0
        at = 0.0
        for i in range(first, first + length):
            part = interval_s[i] / span_s
            if part <= 0.0:
                continue
            da = k_h[i + 1] - k_h[i]
            dw = w[i + 1] - w[i]
            # moments of degree 3 times a straight line, and X Y2 of degree 4: three points of
            # Gauss are exact to degree 5
            for x, share in _GAUSS3:
                y = 0.5 * (1.0 + x)
                weight = 0.5 * share * part
                a = k_h[i] + da * y
                v = w[i] + dw * y
                # Legendre polynomials on the whole span: the projection on cubics keeps moments
                z = 2.0 * (at + part * y) - 1.0
                _add_moments(a_moments, weight * a, z)
                _add_moments(w_moments, weight * v, z)
                h = part * y
                # the double integrals so far, closed form inside an interval
                a2 = va + h * (ra + h * (0.5 * k_h[i] + da * y * (1.0 / 6.0)))
                w2 = vw + h * (rw + h * (0.5 * w[i] + dw * y * (1.0 / 6.0)))
                _add_products(row, weight, weight * 0.5 * (1.0 - z), a, v, a2, w2)
            va += part * (ra + part * (0.5 * k_h[i] + da * (1.0 / 6.0)))
            vw += part * (rw + part * (0.5 * w[i] + dw * (1.0 / 6.0)))
            ra += part * (k_h[i] + 0.5 * da)
            rw += part * (w[i] + 0.5 * dw)
            at += part
        _to_powers(a_moments)
        _to_powers(w_moments)
        _take_away_cubics(row)
        row[18] = _left_at_nodes(row, interval_s, k_h, w, first, length)


@fused_kernel
def span_step(
    spans: FloatArray, row: int, u0: float, ph: float, s0: float, c0: float
) -> tuple[float, float]:
    """Return theta(1) - theta(0) and U(1) of one span; arguments as of a single step."""
    # theta''/p² = A cos(delta) + D sin(delta), delta the angle turned, as in `taylor.series`, but
    # A = a c - w s and D = a s + w c are cubics in tau here: pa, pa1, pa2, pa3 are the coefficients
    # of P A and pd, pd1, pd2, pd3 those of P D. With v_k = k U[k],
    #     v[k+1] = sum over i = 0..3 of (pa_i c[k-i] + pd_i s[k-i])
    big_p = ph * ph
    a, w = spans[row, 2], spans[row, 6]
    pa, pd = big_p * (a * c0 - w * s0), big_p * (a * s0 + w * c0)
    a, w = spans[row, 3], spans[row, 7]
    pa1, pd1 = big_p * (a * c0 - w * s0), big_p * (a * s0 + w * c0)
    a, w = spans[row, 4], spans[row, 8]
    pa2, pd2 = big_p * (a * c0 - w * s0), big_p * (a * s0 + w * c0)
    a, w = spans[row, 5], spans[row, 9]
    pa3, pd3 = big_p * (a * c0 - w * s0), big_p * (a * s0 + w * c0)
    # the same recurrence, to order 10: a span is many samples long
    s2 = 0.5 * pa
    c2 = -0.5 * (u0 * u0)
    v2 = pa1 + pd * u0
    s3 = (1.0 / 3.0) * (u0 * c2) + (1.0 / 6.0) * v2
    u2 = 0.5 * v2
    c3 = -(1.0 / 3.0) * (u0 * s2 + pa * u0)
    v3 = pa2 + pd1 * u0 + pa * c2 + pd * s2
    s4 = 0.25 * (pa * c2 + u0 * c3) + (1.0 / 12.0) * v3
    u3 = (1.0 / 3.0) * v3
    c4 = -0.25 * (u0 * s3 + pa * s2 + u2 * u0)
    v4 = pa3 + pd2 * u0 + pa1 * c2 + pd1 * s2 + pa * c3 + pd * s3
    s5 = 0.2 * (u2 * c2 + pa * c3 + u0 * c4) + 0.05 * v4
    u4 = 0.25 * v4
    c5 = -0.2 * (u0 * s4 + pa * s3 + u2 * s2 + u3 * u0)
    v5 = pd3 * u0 + pa2 * c2 + pd2 * s2 + pa1 * c3 + pd1 * s3 + pa * c4 + pd * s4
    s6 = (1.0 / 6.0) * (u2 * c3 + u3 * c2 + pa * c4 + u0 * c5) + (1.0 / 30.0) * v5
    u5 = 0.2 * v5
    c6 = -(1.0 / 6.0) * (u0 * s5 + pa * s4 + u2 * s3 + u3 * s2 + u4 * u0)
    v6 = pa3 * c2 + pd3 * s2 + pa2 * c3 + pd2 * s3 + pa1 * c4 + pd1 * s4 + pa * c5 + pd * s5
    s7 = (1.0 / 7.0) * (u3 * c3 + u2 * c4 + u4 * c2 + pa * c5 + u0 * c6) + (1.0 / 42.0) * v6
    u6 = (1.0 / 6.0) * v6
    c7 = -(1.0 / 7.0) * (u0 * s6 + pa * s5 + u2 * s4 + u3 * s3 + u4 * s2 + u5 * u0)
    v7 = pa3 * c3 + pd3 * s3 + pa2 * c4 + pd2 * s4 + pa1 * c5 + pd1 * s5 + pa * c6 + pd * s6
    s8 = 0.125 * (u3 * c4 + u4 * c3 + u2 * c5 + u5 * c2 + pa * c6 + u0 * c7) + (1.0 / 56.0) * v7
    u7 = (1.0 / 7.0) * v7
    c8 = -0.125 * (u0 * s7 + pa * s6 + u2 * s5 + u3 * s4 + u4 * s3 + u5 * s2 + u6 * u0)
    v8 = pa3 * c4 + pd3 * s4 + pa2 * c5 + pd2 * s5 + pa1 * c6 + pd1 * s6 + pa * c7 + pd * s7
    s9 = (1.0 / 9.0) * (u4 * c4 + u3 * c5 + u5 * c3 + u2 * c6 + u6 * c2 + pa * c7 + u0 * c8)
    s9 += (1.0 / 72.0) * v8
    c9 = -(1.0 / 9.0) * (
        u0 * s8 + pa * s7 + u2 * s6 + u3 * s5 + u4 * s4 + u5 * s3 + u6 * s2 + u7 * u0
    )
    v9 = pa3 * c5 + pd3 * s5 + pa2 * c6 + pd2 * s6 + pa1 * c7 + pd1 * s7 + pa * c8 + pd * s8
    v10 = pa3 * c6 + pd3 * s6 + pa2 * c7 + pd2 * s7 + pa1 * c8 + pd1 * s8 + pa * c9 + pd * s9
    # what the cubics miss, with the angle at the middle of the span
    s = s0 - 0.5 * u0 * c0
    c = c0 + 0.5 * u0 * s0
    ss, sc, cc = s * s, s * c, c * c
    missed = big_p * big_p
    u_missed = missed * (
        sc * (spans[row, 10] - spans[row, 13]) - ss * spans[row, 11] + cc * spans[row, 12]
    )
    missed *= sc * (spans[row, 14] - spans[row, 17]) - ss * spans[row, 15] + cc * spans[row, 16]
    turned = (
        (1.0 / 12.0) * v3 + 0.05 * v4 + (1.0 / 30.0) * v5 + (1.0 / 42.0) * v6
        + (1.0 / 56.0) * v7 + (1.0 / 72.0) * v8 + (1.0 / 90.0) * v9 + (1.0 / 110.0) * v10
    )  # fmt: skip
    u_end = (
        (1.0 / 3.0) * v3 + 0.25 * v4 + 0.2 * v5 + (1.0 / 6.0) * v6
        + (1.0 / 7.0) * v7 + 0.125 * v8 + (1.0 / 9.0) * v9 + 0.1 * v10
    )  # fmt: skip
    turned = (u0 + (0.5 * pa + (1.0 / 6.0) * v2)) + (turned + missed)
    return turned, (u0 + (pa + 0.5 * v2)) + (u_end + u_missed)


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
        spans: rows of `rbfrag.solver.integrator.block_excitation`, of one length after the other.
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
    tables = excitation.span_tables
    for length in lengths:
        if length not in tables:
            tables[length] = np.empty((excitation.interval_s.size // length, COLUMNS))
            fill_spans(excitation.interval_s, excitation.k_h, excitation.w, length, tables[length])
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
        spans=np.concatenate([np.empty((0, COLUMNS)), *(tables[length] for length in lengths)]),
        span_length=np.array(lengths, dtype=np.int64),
        span_row=np.cumsum([0, *(len(tables[length]) for length in lengths)])[:-1].astype(np.int64),
        span_ph=span_ph,
        span_error=span_error,
        p=p,
        ph_max=PH_MAX,
        u=np.empty(9),
    )
