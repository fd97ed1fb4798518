"""What of the drive is still to come, weighed as the linear model does."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rbfrag.solver.integrator.compiled import kernel

FloatArray = NDArray[np.float64]


@kernel
def linear_drive(
    interval_s: FloatArray, k_h: FloatArray, p: float, still: FloatArray
) -> tuple[float, int]:
    """Fill what of the drive is still to come; return its maximum and the node after it.

    `still` at a node is G(t) = p integral_t^inf k_h(s) exp(-p (s - t)) ds, by G' = p (G - k_h)
    from the end backwards. In the linear model without vertical motion a block topples from
    (theta, theta') if theta'/p + G > theta_c - theta; the maximum of G, which may lie inside
    an interval where G = k_h, is the largest critical angle over all fresh starts.
    """
    g = 0.0
    greatest = 0.0
    where = 0
    h = -1.0
    decay = 0.0
    still[k_h.size - 1] = 0.0
    for i in range(interval_s.size - 1, -1, -1):
        if interval_s[i] != h:
            h = interval_s[i]
            decay = math.exp(-p * h)
        if h > 0.0:
            slope = (k_h[i + 1] - k_h[i]) / h
            rest = g - k_h[i + 1] - slope / p  # times exp(-p (t_end - t))
            # G turns where slope + p rest exp(-p (t_end - t)) = 0
            if slope > 0.0 and rest < 0.0:
                faded = -slope / (p * rest)
                if decay < faded <= 1.0:
                    turn = k_h[i + 1] + slope * math.log(faded) / p
                    if turn > greatest:
                        greatest = turn
                        where = i + 1
            g = k_h[i] + slope / p + rest * decay
        still[i] = g
        if g > greatest:
            greatest = g
            where = i
    return greatest, where
