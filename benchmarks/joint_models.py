"""The models of one scale over block size, and their predictions of held-out earthquakes.

    eta = h(p) (b · terms),   h(p) = exp(A l - B l²),   l = ln(p s)

A and B are given, b is fitted. What the study of joint failures starts from.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select

from rbfrag.db import schema
from rbfrag.db.engine import opened_database
from rbfrag.fragility.fit.clusters import cr3, jackknife_steps
from rbfrag.fragility.fit.data import Y0_OVER_PGV, read_source
from rbfrag.fragility.fit.likelihood import Binomial, maximise, most_likely
from rbfrag.fragility.methods import LOGIT, LOGLOG, Link
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]
Labels = NDArray[np.intp]

FOLDS = 16
LEAST_P = 1e-4


@dataclass(frozen=True, eq=False)
class Outcomes:
    """Blocks of the grid of y/PGV with what they did, all of shape (n,).

    Args:
        failed: 1 or 0; blocks of unknown outcome are left out.
        event: number of the earthquake.
        site: number of the recording.
        motion: number of the component.
        polarity: +1 forward, -1 reverse.
        fold: number of the fold that the earthquake is held out in.
        value: measures and block by the name of the formulas.
    """

    failed: FloatArray
    event: Labels
    site: Labels
    motion: Labels
    polarity: Labels
    fold: Labels
    value: dict[str, FloatArray]


def read_outcomes(path: str | Path) -> Outcomes:
    """Read the outcomes of toppling without vertical motion."""
    with opened_database(path, read_only=True) as engine, engine.connect() as connection:
        source = read_source(connection)
        motion = schema.motion
        pairs = connection.execute(select(motion.c.id, motion.c.recording_id)).all()
    recording = {row.id: row.recording_id for row in pairs}
    table, ground = source.table, source.table.pga_g * STANDARD_GRAVITY_M_S2
    p = np.sqrt(table.p2)
    y = source.k_over_pga * (ground / p)[:, None]
    read = np.isfinite(source.failed) & (y / table.pgv_m_s[:, None] >= Y0_OVER_PGV[0] * 0.999999)

    def each(values: NDArray[np.generic]) -> NDArray[np.generic]:
        return np.broadcast_to(values[:, None], read.shape)[read]

    def numbers(values: NDArray[np.generic]) -> Labels:
        return np.unique(each(values), return_inverse=True)[1].astype(np.intp)

    event = numbers(table.event_id.astype(str))
    size = np.bincount(event)
    fold = np.empty(size.size, dtype=np.intp)
    fold[np.argsort(-size, kind="stable")] = np.arange(size.size) % FOLDS  # dealt by size
    value = {"y": y[read], "p": each(p), "p2": each(table.p2), "pgv": each(table.pgv_m_s)}
    value |= {"pga": each(table.pga_g), "tm": each(table.tm_s), "xp": each(source.xp_m_s)}
    return Outcomes(
        failed=source.failed[read],
        event=event,
        site=numbers(np.array([recording[one] for one in table.motion_id.tolist()])),
        motion=numbers(table.motion_id),
        polarity=each(np.where(table.polarity == "forward", 1, -1)),
        fold=fold[event],
        value=value,
    )


@dataclass(frozen=True, eq=False)
class Shape:
    """A model, and what statistics of it were published.

    Args:
        name: of the model.
        link: F in P = F(eta).
        a: A of h(p).
        b: B of h(p).
        coefficients: published b.
        errors: published CR3 errors of b.
        log_loss: published log loss of held-out earthquakes.
    """

    name: str
    link: Link
    a: float
    b: float
    coefficients: tuple[float, ...]
    errors: tuple[float, ...]
    log_loss: float

    def terms(self, value: dict[str, FloatArray]) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return h(p) · terms, shape (n, k), and which blocks mechanics lets fail."""
        y, p, ln = value["y"], value["p"], np.log
        size, pulse = ln(p), p / STANDARD_GRAVITY_M_S2
        r, v, u = y * pulse / value["pga"], y / (2.0 * value["pgv"]), y / value["xp"]
        with np.errstate(invalid="ignore", divide="ignore"):
            if self.name == "pgv":
                free, some = v < 1.0, [-ln(v), ln(1.0 - v), size, size * size]
            elif self.name == "record":
                free = (u < 1.0) & (r < 1.0)
                some = [-ln(u), ln(pulse * value["xp"] / value["pga"])]
            else:
                free = (v < 1.0) & (r < 1.0)
                some = [-ln(r), ln(1.0 - r), ln(1.0 - v), ln(pulse * value["pgv"] / value["pga"])]
            if self.name == "pgv_pga_tm":
                some.append(ln(p * value["tm"] / (2.0 * np.pi)))
        scale = np.exp(self.a * size - self.b * size * size)
        return scale[:, None] * np.column_stack([np.ones_like(y), *some]), free


SHAPES = (
    Shape("pgv", LOGLOG, 0.18, 0.06, (-1.120, 2.662, 2.161, 0.042, -0.266),
          (0.480, 0.284, 0.443, 0.088, 0.033), 0.1652),
    Shape("pgv_pga", LOGLOG, 0.18, 0.06, (2.509, 2.284, 4.192, 2.386, 2.783),
          (0.435, 0.253, 0.422, 0.356, 0.238), 0.1522),
    Shape("pgv_pga_tm", LOGLOG, 0.18, 0.06, (2.938, 2.282, 4.255, 2.635, 1.582, 1.253),
          (0.368, 0.263, 0.346, 0.383, 0.301, 0.143), 0.1480),
    Shape("record", LOGIT, 0.30, 0.0, (3.111, 3.816, 1.064), (0.242, 0.394, 0.073), 0.0882),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class HeldOut:
    """A fitted model and its predictions of earthquakes it was not fitted to.

    Args:
        shape: the model.
        coefficients: b of the fit to all, shape (k,).
        errors: their CR3 errors.
        probability: P of every block by the fit without its fold, shape (n,).
        log_loss: mean over all blocks.
    """

    shape: Shape
    coefficients: FloatArray
    errors: FloatArray
    probability: FloatArray
    log_loss: float


def held_out(shape: Shape, data: Outcomes) -> HeldOut:
    """Fit a model to all earthquakes, and to those outside of each fold."""
    terms, free = shape.terms(data.value)
    rows = Binomial(
        shape.link, terms[free], data.failed[free], np.ones(int(free.sum())), data.event[free]
    )
    b = most_likely(rows)
    own = np.zeros(rows.outcome.size)
    fold = data.fold[free]
    for number in range(FOLDS):
        here = fold == number
        without = maximise(rows.only(~here), b, tolerance=1e-9)[0]
        own[here] = rows.only(here).probability(without)
    probability = np.zeros(data.failed.size)
    probability[free] = own
    clipped = np.clip(probability, LEAST_P, 1.0 - LEAST_P)
    loss = -np.where(data.failed > 0.5, np.log(clipped), np.log1p(-clipped))
    errors = np.sqrt(np.diag(cr3(jackknife_steps(rows, b))))
    return HeldOut(shape, b, errors, probability, float(loss.mean()))
