"""Fitting the models of blocks that slide or slump: maximum likelihood with censored rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_ndtr, ndtr

from rbfrag.db.model_file import ModelRow
from rbfrag.errors import FitError, InputError
from rbfrag.fragility.fit.kind_data import KindData, sliding_data, slumping_data
from rbfrag.fragility.fit.scores import brier, calibration, log_loss
from rbfrag.fragility.kind_formulas import FORMULAS, METHODS, Formula, Numbers
from rbfrag.fragility.model import FragilityModel
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.models.sliding import KY_OVER_PGA, THRESHOLDS_M
from rbfrag.solver.models.slumping import RATIOS

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from rbfrag.db.queries import Vertical

FloatArray = NDArray[np.float64]

ARRAYS = Numbers(np.log, np.exp)

STARTS: Mapping[tuple[str, str], tuple[float, ...]] = {
    ("sliding", "pgv_pga"): (0.3, 0.8, 3.5, -0.5, 1.3),
    ("sliding", "pgv"): (0.8, 0.5, 2.9, -2.0, -0.3, 0.6),
    ("slumping", "pgv_pga"): (0.0, 1.0, -1.0),
    ("slumping", "pgv"): (0.0, 1.0, -1.0),
}
"""Where the search for the maximum begins; it is the same maximum from anywhere near."""


@dataclass(frozen=True, eq=False)
class KindFit:
    """A fitted model with what a study of it needs.

    Args:
        row: the model, ready to be stored.
        data: what it was fitted to.
        judged: what it was judged by.
        held_out: its probabilities, each earthquake predicted from the others.
    """

    row: ModelRow
    data: KindData
    judged: Judged
    held_out: FloatArray

    @property
    def model(self) -> FragilityModel:
        """The model, ready to answer."""
        return FragilityModel.from_row(self.row)


@dataclass(frozen=True, eq=False)
class Judged:
    """Blocks that a model is judged by, on a grid that does not depend on the outcome.

    Args:
        values: what the formulas read, shape (n, m) or broadcast to it.
        failed: 1 failed, 0 not, NaN not known, shape (n, m).
        event: number of the earthquake, shape (n,).
    """

    values: dict[str, FloatArray]
    failed: FloatArray
    event: NDArray[np.intp]

    @property
    def known(self) -> NDArray[np.bool_]:
        """Where the outcome is known."""
        return np.isfinite(self.failed)


def fit_kind(
    connection: Connection,
    *,
    kind: str,
    term: str = "pgv_pga",
    rotation_deg: float | None = None,
    suite: str | None = None,
    vertical: Vertical = "without",
    name: str | None = None,
) -> KindFit:
    """Fit a model of blocks that slide or slump; nothing is stored.

    Args:
        connection: the database.
        kind: ``sliding`` or ``slumping``.
        term: ``pgv_pga`` or ``pgv``.
        rotation_deg: slumping: the rotation that counts as failure [deg]; None past recovery.
        suite: suite of motions to fit; None for all.
        vertical: ``without`` or ``with`` vertical motion, or ``both``.
        name: name of the model; None for one made of kind, rotation and term.

    Raises:
        InputError: a kind or term that there is no model of.
        FitError: the data cannot carry the fit.
    """
    if (kind, term) not in FORMULAS:
        known = ", ".join(f"{k} on {t}" for k, t in FORMULAS)
        raise InputError(f"there is no model of {kind} on the term {term}: known are {known}")
    if kind == "sliding":
        if rotation_deg is not None:
            raise InputError("a rotation is no failure of a block that slides: leave it out")
        data = sliding_data(connection, suite=suite, vertical=vertical)
    else:
        data = slumping_data(connection, rotation_deg=rotation_deg, suite=suite, vertical=vertical)
    failure = ""
    if kind == "slumping":
        failure = "-recovery" if rotation_deg is None else f"-{rotation_deg:g}deg"
    return fit_kind_data(
        data,
        term,
        name=name or f"{kind}{failure}-{term}",
        selection={"rotation_deg": rotation_deg, "suite": suite, "vertical": vertical},
    )


def fit_kind_data(
    data: KindData, term: str, *, name: str, selection: Mapping[str, object]
) -> KindFit:
    """Fit one model to data in hand; arguments as for :func:`fit_kind`."""
    formula = FORMULAS[data.kind, term]
    start = np.array(STARTS[data.kind, term])
    everything = np.ones(data.found.size, dtype=np.bool_)
    best = maximum_likelihood(formula, data, everything, start)
    judged = judged_by(data)
    held_out = np.full(judged.failed.shape, np.nan)
    others = []
    for event in range(data.events):
        rest = data.event != event
        found = maximum_likelihood(formula, data, rest, best)
        others.append(found)
        here = judged.event == event
        held_out[here] = probabilities(formula, found, judged)[here]
    covariance = _jackknife(np.array(others))
    errors = np.sqrt(np.diag(covariance))
    names = formula.parameters
    seen = probabilities(formula, best, judged)
    scores = {
        "in_sample_log_loss": log_loss(seen, judged.failed, judged.known),
        "held_out_log_loss": log_loss(held_out, judged.failed, judged.known),
        "held_out_brier": brier(held_out, judged.failed, judged.known),
        "calibration_slope": calibration(held_out, judged.failed, judged.known).slope,
    }
    row = ModelRow(
        name=name,
        kind=data.kind,
        term=term,
        method=METHODS[data.kind],
        coefficients=dict(zip(names, best.tolist(), strict=True)),
        covariance=tuple(tuple(line) for line in covariance.tolist()),
        domain=_domain(data),
        data_fingerprint=data.fingerprint,
        diagnostics={
            "standard_errors": dict(zip(names, errors.tolist(), strict=True)),
            "n": int(data.found.sum()),
            "n_censored": int((~data.found).sum()),
            "events": data.events,
            "degrees_of_freedom": data.events - 1,
            "guessed_events": data.guessed_events,
            "scores": scores,
            "judged_outcomes": int(judged.known.sum()),
            "warnings": _warnings(data),
            **selection,
        },
        created=datetime.now(UTC).isoformat(timespec="seconds"),
    )
    return KindFit(row, data, judged, held_out)


def maximum_likelihood(
    formula: Formula, data: KindData, chosen: NDArray[np.bool_], start: FloatArray
) -> FloatArray:
    """Return the parameters under which the chosen rows are likeliest.

    A found row has the density φ(eta)/σ of its critical value, a censored one the probability
    Φ(-eta) of failing beyond it.

    Raises:
        FitError: there is no maximum.
    """
    values = {name: value[chosen] for name, value in data.values.items()}
    found = data.found[chosen]

    def cost(p: FloatArray) -> tuple[float, FloatArray]:
        eta, log_sigma, by_parameter, of_sigma = formula.eta(p.tolist(), values, ARRAYS)
        log_tail = log_ndtr(-eta)
        each = np.where(found, -0.5 * eta * eta - log_sigma, log_tail)
        # by eta: -eta where found, minus the hazard of the normal distribution where not
        hazard = np.exp(-0.5 * eta * eta - log_tail) / np.sqrt(2.0 * np.pi)
        by_eta = np.where(found, -eta, -hazard)
        slopes = np.array(
            [
                np.mean(by_eta * one - np.where(found, other, 0.0))
                for one, other in zip(by_parameter, of_sigma, strict=True)
            ]
        )
        return -float(np.mean(each)), -slopes

    done = minimize(cost, start, jac=True, method="BFGS", options={"gtol": 1e-9, "maxiter": 500})
    if not np.all(np.isfinite(done.x)) or np.max(np.abs(done.jac)) > 1e-4:
        raise FitError(
            "the likelihood of this model has no maximum on these data: add motions, or fit "
            "another term"
        )
    return np.asarray(done.x, dtype=np.float64)


def probabilities(formula: Formula, parameters: FloatArray, judged: Judged) -> FloatArray:
    """Return the probabilities of the blocks that models are judged by, shape (n, m)."""
    eta = formula.eta(parameters.tolist(), judged.values, ARRAYS).eta
    return np.broadcast_to(ndtr(eta), judged.failed.shape).copy()


def judged_by(data: KindData) -> Judged:
    """Return the blocks that models are judged by.

    Sliding: the stored strengths and the displacements 1, 5, 15 and 30 cm. Slumping: 25 values of
    k_s/PGA of each block of the family, the record scaled to them.
    """
    if data.kind == "sliding":
        distances = np.array(THRESHOLDS_M)
        values = {name: value[:, None] for name, value in data.values.items()}
        failed = (data.values["displacement_m"][:, None] > distances).astype(np.float64)
        values["displacement_m"] = np.broadcast_to(distances, failed.shape)
        return Judged(values, failed, data.event)
    ks, ps2 = data.values["ks"], data.values["ps2"]
    critical = ks / data.values["pga_g"]
    pulse = data.values["pgv_m_s"] / data.values["pga_g"]
    pga = ks[:, None] / RATIOS
    failed = (critical[:, None] >= RATIOS).astype(np.float64)
    # nothing is known of stronger records than the model could follow
    failed[~data.found[:, None] & (critical[:, None] > RATIOS)] = np.nan
    values = {
        "ks": ks[:, None],
        "ps2": ps2[:, None],
        "pga_g": pga,
        "pgv_m_s": pulse[:, None] * pga,
    }
    return Judged(values, failed, data.event)


def _jackknife(left_out: FloatArray) -> FloatArray:
    """Return the covariance of the parameters from the fits that each leave an earthquake out."""
    events = left_out.shape[0]
    off = left_out - left_out.mean(axis=0)
    covariance: FloatArray = (events - 1) / events * off.T @ off
    return 0.5 * (covariance + covariance.T)


def _domain(data: KindData) -> dict[str, tuple[float, float]]:
    pulse = data.pgv_m_s / (data.pga_g * STANDARD_GRAVITY_M_S2)
    columns = {"pgv_over_pga_s": pulse}
    if data.kind == "sliding":
        columns |= {
            "pgv_m_s": data.pgv_m_s,
            "pga_g": data.pga_g,
            "displacement_m": data.values["displacement_m"][data.found],
            "k_over_pga": np.array([KY_OVER_PGA[0], 1.0]),
        }
    else:
        ks, ps2 = data.values["ks"], data.values["ps2"]
        columns |= {
            "ps2": ps2,
            "y_m_s": ks * STANDARD_GRAVITY_M_S2 / np.sqrt(ps2),
            "k_over_pga": np.array([float((ks / data.values["pga_g"]).min()), 1.0]),
        }
    return {name: (float(value.min()), float(value.max())) for name, value in columns.items()}


def _warnings(data: KindData) -> list[str]:
    warnings = []
    if data.guessed_events:
        warnings.append(
            f"{data.guessed_events} of {data.events} earthquakes are guessed from file headers: "
            "one earthquake may be counted as several, which makes standard errors too small; name "
            "them by  motions add --metadata"
        )
    if data.kind == "slumping":
        share = float(np.mean(~data.found))
        warnings.append(
            f"{100 * share:.0f} % of the blocks leave their back plane, or stay, before they fail: "
            "they count as failing under stronger motions than those"
        )
    return warnings
