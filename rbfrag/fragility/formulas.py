"""The formulas of all models for one block and one motion: plain arithmetic on single numbers.

Written once: `predict` calls these functions as they stand, and for many rows the same
functions are compiled (`rbfrag.fragility.compiled_formulas`), so that both give the same bits.
Logarithm and exponential are our own for that reason. No library is loaded here.

A model is eta = Σ b_i f_i and P = F(eta); the numbers (1)-(9) are those of
docs/theory/fragility.md. The slopes of eta by the parameters are the f_i, except for the two
normal models, whose parameters enter by their scatter too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from rbfrag.fragility.elementary import MOST, exponential, ln
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

LINE = 0
LOGNORMAL = 1
RATIO = 2
ODDS_PGV, ODDS_PGA, ODDS_TM = 3, 4, 5
BOUNDED_PGV, BOUNDED_PGA, BOUNDED_TM = 6, 7, 8
RECORD = 9
POWER = 10

NORMAL, LOGIT, LOGLOG, COMPLEMENT = 0, 1, 2, 3

FREE, NOT_LIFTED, ABOVE_TWICE_PGV, ABOVE_SPECTRUM = 0, 1, 2, 3
"""Why P is 0 by mechanics: not at all; k_r >= PGA; y >= 2 PGV; y >= X(p)."""

MOST_PARAMETERS = 6

LEAST_Y_M_S = 1e-290
"""Velocities and accelerations are taken for at least this much, which no logarithm minds."""

FLOOR_NODES = 41
"""Nodes at which the least width of an interval, over its quantile, is tabulated: by eta, and by
y/2x, the share of twice the velocity."""
FLOOR_FROM, FLOOR_STEP = -10.0, 0.5
"""The first node of eta, and from one to the next."""
FLOOR_SHARE_STEP = 0.025

SHAPES = {
    ("wls", "pgv"): LINE,
    ("wls", "pga_tm"): LINE,
    ("wls", "pgd_tm"): LINE,
    ("wls", "xp"): LINE,
    ("lognormal", "pgv"): LOGNORMAL,
    ("lognormal", "pga_tm"): LOGNORMAL,
    ("lognormal", "pgd_tm"): LOGNORMAL,
    ("lognormal", "xp"): LOGNORMAL,
    ("logistic", "pgv"): RATIO,
    ("logistic", "pga_tm"): RATIO,
    ("logistic", "pgd_tm"): RATIO,
    ("logistic", "xp"): RATIO,
    ("weibull", "pgv"): ODDS_PGV,
    ("weibull", "pgv_pga"): ODDS_PGA,
    ("weibull", "pgv_pga_tm"): ODDS_TM,
    ("bounded", "pgv"): BOUNDED_PGV,
    ("bounded", "pgv_pga"): BOUNDED_PGA,
    ("bounded", "pgv_pga_tm"): BOUNDED_TM,
    ("record", "xp"): RECORD,
    ("power", "xp"): POWER,
}
"""The formula of each method and term that go together."""

LINKS = {
    "wls": NORMAL,
    "lognormal": NORMAL,
    "logistic": LOGIT,
    "weibull": LOGLOG,
    "bounded": LOGLOG,
    "record": LOGIT,
    "power": COMPLEMENT,
}
"""How each method turns eta into a probability."""

PARAMETERS = {
    LINE: ("c0", "c1", "v0", "v1", "v2"),
    LOGNORMAL: ("ln_median", "slope", "ln_sigma", "m_minus_1"),
    RATIO: ("b0", "b_ln_x_over_y", "b_ln_p"),
    ODDS_PGV: ("b0", "b_logit_share"),
    ODDS_PGA: ("b0", "b_logit_r", "b_ln_z"),
    ODDS_TM: ("b0", "b_logit_r", "b_ln_z", "b_ln_zt"),
    BOUNDED_PGV: ("b0", "b_ln_share", "b_ln_1_minus_share"),
    BOUNDED_PGA: ("b0", "b_ln_r", "b_ln_1_minus_r", "b_ln_1_minus_share", "b_ln_z"),
    BOUNDED_TM: ("b0", "b_ln_r", "b_ln_1_minus_r", "b_ln_1_minus_share", "b_ln_z", "b_ln_zt"),
    RECORD: ("b0", "b_ln_xp_over_y", "b_ln_s"),
    POWER: ("b0", "b_ln_xp_over_y"),
}
"""The parameters of each formula, in their order; a model may have fewer from the end."""

EXPONENTS = frozenset({"m_minus_1", "b_ln_p"})
"""Parameters of models whose exponent M was estimated: P then depends on p beside y."""

_ROOT_HALF = math.sqrt(0.5)


def bound(shape: int, y: float, p: float, x: float, pga_g: float) -> int:
    """Return which bound of mechanics says that the block cannot topple, or FREE.

    Args:
        shape: one of LINE … POWER.
        y: toppling velocity of the block [m/s].
        p: its frequency parameter [1/s].
        x: intensity [m/s]; X(p) for RECORD and POWER.
        pga_g: PGA [g], for the shapes that need it.
    """
    if shape <= RATIO:
        return FREE
    if shape >= RECORD:
        return ABOVE_SPECTRUM if y >= x else FREE
    if shape != ODDS_PGV and shape != BOUNDED_PGV and y * p >= pga_g * STANDARD_GRAVITY_M_S2:
        return NOT_LIFTED
    if (shape == ODDS_PGV or shape >= BOUNDED_PGV) and y >= 2.0 * x:
        return ABOVE_TWICE_PGV
    return FREE


def features(
    shape: int, y: float, p: float, x: float, pga_g: float, tm_s: float
) -> tuple[float, float, float, float, float, float]:
    """Return f_0 … f_5 of a linear model, zero beyond its parameters.

    Only where :func:`bound` says FREE. Arguments as there, and Tm [s] for the shapes that
    need it.
    """
    ground = pga_g * STANDARD_GRAVITY_M_S2
    share = y / (2.0 * x)
    if shape >= ODDS_PGA and shape <= BOUNDED_TM and shape != BOUNDED_PGV:
        r = y * p / ground
        ln_z = ln(p * x / ground)
        ln_zt = ln(p * tm_s / (2.0 * math.pi)) if shape in (ODDS_TM, BOUNDED_TM) else 0.0
        if shape <= ODDS_TM:  # (6)
            return 1.0, ln((1.0 - r) / r), ln_z, ln_zt, 0.0, 0.0
        return 1.0, -ln(r), ln(1.0 - r), ln(1.0 - share), ln_z, ln_zt  # (7)
    if shape == ODDS_PGV:  # (5)
        return 1.0, ln((1.0 - share) / share), 0.0, 0.0, 0.0, 0.0
    if shape == BOUNDED_PGV:  # (7)
        return 1.0, -ln(share), ln(1.0 - share), 0.0, 0.0, 0.0
    ln_ratio = ln(x) - ln(y)
    if shape == RATIO:  # (4)
        return 1.0, ln_ratio, ln(p), 0.0, 0.0, 0.0
    if shape == POWER:  # (9)
        return 1.0, ln_ratio, 0.0, 0.0, 0.0, 0.0
    return 1.0, ln_ratio, ln(p * x / ground), 0.0, 0.0, 0.0  # (8)


def score(
    shape: int,
    b: Sequence[float],
    y: float,
    p: float,
    x: float,
    pga_g: float,
    tm_s: float,
) -> tuple[float, float, float, float, float, float, float]:
    """Return eta and its slopes by the six parameters.

    Args:
        shape: one of LINE … POWER.
        b: six parameters, zero beyond those of the model.
        y: toppling velocity of the block [m/s], > 0.
        p: its frequency parameter [1/s].
        x: intensity [m/s], > 0.
        pga_g: PGA [g], for the shapes that need it.
        tm_s: Tm [s], for the shapes that need it.
    """
    if shape == LINE:  # (1), (2)
        variance = (b[4] * x + b[3]) * x + b[2]
        sigma = math.sqrt(variance)
        eta = (b[1] * x + b[0] - y) / sigma
        by_v = eta / (variance * -2.0)
        return eta, 1.0 / sigma, x / sigma, by_v, by_v * x, by_v * x * x, 0.0
    if shape == LOGNORMAL:  # (3)
        sigma = exponential(b[2])
        ln_x, ln_p = ln(x), ln(p)
        eta = (b[0] + b[1] * ln_x + b[3] * ln_p - ln(y)) / sigma
        return eta, 1.0 / sigma, ln_x / sigma, -eta, ln_p / sigma, 0.0, 0.0
    f0, f1, f2, f3, f4, f5 = features(shape, y, p, x, pga_g, tm_s)
    eta = b[0] * f0 + b[1] * f1 + b[2] * f2 + b[3] * f3 + b[4] * f4 + b[5] * f5
    return eta, f0, f1, f2, f3, f4, f5


def standard_error(
    v: Sequence[float], f0: float, f1: float, f2: float, f3: float, f4: float, f5: float
) -> float:
    """Return sqrt(fᵀ Σ f).

    Args:
        v: the 21 elements of Σ on and below the diagonal, row by row, those off it doubled.
        f0: slope of eta by the first parameter; f1 … f5 those by the others.
        f1: slope.
        f2: slope.
        f3: slope.
        f4: slope.
        f5: slope.
    """
    total = (
        f0 * (f0 * v[0])
        + f1 * (f0 * v[1] + f1 * v[2])
        + f2 * (f0 * v[3] + f1 * v[4] + f2 * v[5])
        + f3 * (f0 * v[6] + f1 * v[7] + f2 * v[8] + f3 * v[9])
        + f4 * (f0 * v[10] + f1 * v[11] + f2 * v[12] + f3 * v[13] + f4 * v[14])
        + f5 * (f0 * v[15] + f1 * v[16] + f2 * v[17] + f3 * v[18] + f4 * v[19] + f5 * v[20])
    )
    return math.sqrt(total) if total > 0.0 else 0.0


def least_width(floor: Sequence[float], eta: float, share: float) -> float:
    """Return the least width of an interval over its quantile, linear between nodes.

    The less of what the tables by eta and by y/2x say; why, is told in
    :mod:`rbfrag.fragility.interval_floor`.

    Args:
        floor: values at the nodes of eta, then at those of y/2x; empty for none.
        eta: of the block.
        share: its y/2x.
    """
    if len(floor) == 0:
        return 0.0
    node, beyond, share_node, share_beyond = floor_places(eta, share)
    return less_between(floor, int(node), beyond, int(share_node), share_beyond)


def floor_places(eta: float, share: float) -> tuple[float, float, float, float]:
    """Return the node before eta, how far beyond it eta is, and the same of y/2x."""
    node, beyond = _place((eta - FLOOR_FROM) / FLOOR_STEP)
    share_node, share_beyond = _place(share / FLOOR_SHARE_STEP)
    return node, beyond, share_node + FLOOR_NODES, share_beyond


def _place(at: float) -> tuple[float, float]:
    last = FLOOR_NODES - 1.0
    at = at if at > 0.0 else 0.0
    at = at if at < last else last
    node = float(math.floor(at))
    node = node if node < last else last - 1.0
    return node, at - node


def less_between(
    floor: Sequence[float], node: int, beyond: float, share_node: int, share_beyond: float
) -> float:
    """Return the less of the two tables, each on the line from its node to the next."""
    by_eta = floor[node] + beyond * (floor[node + 1] - floor[node])
    by_share = floor[share_node] + share_beyond * (floor[share_node + 1] - floor[share_node])
    return by_eta if by_eta < by_share else by_share


def widened(least: float, middle: float, low: float, high: float) -> tuple[float, float]:
    """Return the ends of an interval of at least some width, inside 0 and 1.

    Args:
        least: width.
        middle: the probability; what lacks is added in proportion to the room on either side.
        low: lower end.
        high: upper end.
    """
    lacking = least - (high - low)
    lacking = lacking if lacking > 0.0 else 0.0
    low, high = low - lacking * middle, high + lacking * (1.0 - middle)
    below, above = -low if low < 0.0 else 0.0, high - 1.0 if high > 1.0 else 0.0
    low, high = low - above, high + below
    return low if low > 0.0 else 0.0, high if high < 1.0 else 1.0


def interval(link: int, eta: float, reach: float) -> tuple[float, float, float]:
    """Return F(eta), F(eta - reach) and F(eta + reach), reach >= 0.

    F is the normal distribution function, the logistic function, exp(-exp(-eta)) or
    1 - exp(-eta).
    """
    if link == NORMAL:
        return (
            0.5 * math.erfc(-eta * _ROOT_HALF),
            0.5 * math.erfc((reach - eta) * _ROOT_HALF),
            0.5 * math.erfc((-eta - reach) * _ROOT_HALF),
        )
    if link == COMPLEMENT:
        low, high = eta - reach, eta + reach
        return (
            -math.expm1(-eta) if eta > 0.0 else 0.0,
            -math.expm1(-low) if low > 0.0 else 0.0,
            -math.expm1(-high) if high > 0.0 else 0.0,
        )
    falling = exponential(-eta)
    spread = exponential(reach)
    if link == LOGIT:
        return 1.0 / (1.0 + falling), 1.0 / (1.0 + falling * spread), 1.0 / (1.0 + falling / spread)
    return _faded(falling), _faded(falling * spread), _faded(falling / spread)


def _faded(x: float) -> float:
    # e^-700 is not 0, which P of an impossible block is to be
    return 0.0 if x > MOST else exponential(-x)


def answer(
    shape: int,
    link: int,
    b: Sequence[float],
    v: Sequence[float],
    floor: Sequence[float],
    half_width: float,
    y: float,
    p: float,
    x: float,
    pga_g: float,
    tm_s: float,
) -> tuple[float, float, float]:
    """Return P and the ends of its confidence interval.

    Args:
        shape: one of LINE … POWER.
        link: one of NORMAL … COMPLEMENT.
        b: six parameters.
        v: their covariance as for :func:`standard_error`.
        floor: least widths as for :func:`least_width`.
        half_width: quantile of the confidence level.
        y: toppling velocity of the block [m/s], > 0.
        p: its frequency parameter [1/s].
        x: intensity [m/s], > 0.
        pga_g: PGA [g], for the shapes that need it.
        tm_s: Tm [s], for the shapes that need it.
    """
    if bound(shape, y, p, x, pga_g) != FREE:
        return 0.0, 0.0, 0.0
    eta, f0, f1, f2, f3, f4, f5 = score(shape, b, y, p, x, pga_g, tm_s)
    reach = half_width * standard_error(v, f0, f1, f2, f3, f4, f5)
    middle, low, high = interval(link, eta, reach)
    least = half_width * least_width(floor, eta, y / (2.0 * x))
    low, high = widened(least, middle, low, high)
    return middle, low, high


def is_plain(
    shape: int,
    b: Sequence[float],
    limits: Sequence[float],
    p2: float,
    p: float,
    kr: float,
    y: float,
    x: float,
    pgv_m_s: float,
    pga_g: float,
    tm_s: float,
    pgd_m: float,
) -> bool:
    """Return whether there is nothing to say about an input but its probability.

    False sends it to the checks of :mod:`rbfrag.fragility.checks`, which find the words; it may
    be false where they find none, never true where they find one.

    Args:
        shape: one of LINE … POWER.
        b: six parameters.
        limits: low and high edges of p², x, y, Tm and PGV/(PGA g).
        p2: frequency parameter p² of the block [1/s²].
        p: its root [1/s].
        kr: its yield acceleration coefficient.
        y: its toppling velocity [m/s].
        x: intensity [m/s].
        pgv_m_s: PGV [m/s], or 1 where it is not given.
        pga_g: PGA [g], or 5 where it is not given.
        tm_s: Tm [s], or 1 where it is not given.
        pgd_m: PGD [m], or 1 where it is not given.
    """
    ground = pga_g * STANDARD_GRAVITY_M_S2
    if not (
        limits[0] <= p2 <= limits[1]
        and limits[2] <= x <= limits[3]
        and limits[4] <= y <= limits[5]
        and limits[6] <= tm_s <= limits[7]
        and 0.0 < kr < pga_g <= 5.0
        and 0.0 < pgv_m_s <= 5.0
        and 0.02 <= tm_s <= 10.0
        and 0.0 < pgd_m <= 20.0
        and limits[8] * ground <= pgv_m_s <= limits[9] * ground
    ):
        return False
    if shape != LINE:
        return bound(shape, y, p, x, pga_g) == FREE
    mean = b[1] * x + b[0]
    variance = (b[4] * x + b[3]) * x + b[2]
    # 2.5 % below zero is a mean of 1.96 standard deviations; the checks decide near it
    return mean > 0.0 and mean * mean > 3.9 * variance and y >= b[0]
