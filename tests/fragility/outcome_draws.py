"""Outcomes drawn from known models, with what earthquakes share."""

from __future__ import annotations

import numpy as np

from rbfrag.db.rows import CombinationTable
from rbfrag.fragility.fit.completions import spectral_velocities
from rbfrag.fragility.fit.data import Y0_OVER_PGV, FitSource, kr_over_pga_of_grid
from rbfrag.fragility.method import arrays
from rbfrag.fragility.methods import method_named
from rbfrag.solver.results import NUMERICS_VERSION
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S
from tests.synthetic import unknown_measures

G = 9.80665
P2 = (30.0, 3.0, 0.3)


def drawn_outcomes(
    method: str,
    term: str,
    parameters: tuple[float, ...],
    *,
    events: int = 47,
    motions: int = 3,
    shared: float = 0.0,
    seed: int = 1,
) -> FitSource:
    """Draw outcomes on the grid with P = F(eta) of a model, one uniform number a block.

    Args:
        method: method of the model that is true.
        term: its term.
        parameters: its parameters.
        events: number of earthquakes.
        motions: motions of each.
        shared: part of the variance of a block's normal number that its earthquake shares; the
            probability of each block stays that of the model.
        seed: of the random numbers.
    """
    random = np.random.default_rng(seed)
    count = events * motions
    motion = np.repeat(np.arange(count), len(P2))
    event = motion // motions
    pgv = np.exp(random.uniform(np.log(0.03), np.log(1.2), count))[motion]
    ratio = np.exp(random.normal(np.log(0.1), 0.4, count))[motion]
    tm = 2.0 * np.pi * ratio * np.exp(random.normal(0.0, 0.2, count))[motion]
    pga = pgv / (ratio * G)
    p2 = np.tile(P2, count)
    p = np.sqrt(p2)
    # a spectrum that bends towards PGA as those of records do
    xp = pgv * np.exp(random.normal(-0.2, 0.2, motion.size))
    xp = xp / (1.0 + p * xp / (pga * G))
    x = {"pgv": pgv, "pgv_pga": pgv, "xp": xp}[term]
    spectra = drawn_spectra(random, pga, tm)
    y0 = pgv[:, None] * Y0_OVER_PGV
    fitted = method_named(method)
    columns = {"p": p, "intensity_m_s": x, "pga_g": pga, "pgv_m_s": pgv, "tm_s": tm}
    if (velocity := fitted.forms[term].velocity) is not None:
        columns["velocity_m_s"] = spectral_velocities(velocity, spectra, p)
    values = {name: column[:, None] for name, column in columns.items()}
    values |= {"y_m_s": y0, "kr": y0 * p[:, None] / G}
    form = fitted.forms[term]
    with np.errstate(all="ignore"):
        eta = np.asarray(form.eta(parameters, values, arrays()).eta)
        probability = np.asarray(fitted.link.probability(eta, arrays()))
    for bound in form.bounds:
        probability = np.where(bound.holds(values), 0.0, probability)
    from scipy.special import ndtr

    common = random.normal(size=events)[event][:, None]
    expected = random.normal(size=y0.shape)
    uniform = ndtr(np.sqrt(shared) * common + np.sqrt(1.0 - shared) * expected)
    topples = (uniform < probability).astype(float)
    n = motion.size
    y = np.where(topples.any(axis=1), np.where(topples > 0.5, y0, 0.0).max(axis=1), np.nan)
    result = np.isfinite(y)
    table = CombinationTable(
        combination_id=np.arange(1, n + 1),
        motion_id=motion + 1,
        event_id=np.array([f"event-{i}" for i in event], dtype=object),
        event_guessed=np.zeros(n, dtype=bool),
        polarity=np.full(n, "forward", dtype=object),
        p2=p2,
        status=np.where(result, "found", "below_limit").astype(object),
        search_limit=np.full(n, 0.01),
        kr_over_pga=y * p / (G * pga),
        upper=np.full(len(p2), np.nan),
        kr=y * p / G,
        y_m_s=y,
        pga_g=pga,
        pgv_m_s=pgv,
        pgd_m=pgv * tm / (2.0 * np.pi),
        tm_s=tm,
        natural_key=np.array([f"key-{i:06d}" for i in range(n)], dtype=object),
        block=np.full(n, None, dtype=object),
        yield_g=np.full(n, np.nan),
        numerics_version=np.full(n, NUMERICS_VERSION, dtype=object),
        measures=unknown_measures(n),
    )
    return FitSource(
        table, xp, kr_over_pga_of_grid(p2, pgv, pga), topples, recording=motion, spectra=spectra
    )


def drawn_spectra(random: np.random.Generator, pga: np.ndarray, tm: np.ndarray) -> np.ndarray:
    """Return response spectra [g] that rise to the mean period and then fall, shape (n, 21)."""
    x = np.array(SPECTRUM_PERIODS_S) / tm[:, None]
    noise = np.cumsum(random.normal(0.0, 0.08, x.shape), axis=1)
    return np.asarray(pga[:, None] * 2.5 * x / (0.4 + x * x * x) ** (2.0 / 3.0) * np.exp(noise))


TRUTH = {
    ("logistic", "pgv"): (-2.0, 4.8),
    ("toppling", "pgv_pga"): (2.4, 0.6, 2.3, 4.5, 1.0, 2.1),
    ("record", "xp"): (2.2, 1.6, 0.7),
}
"""Parameters near those of the recorded motions."""
