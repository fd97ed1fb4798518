"""The probability that a block fails: `predict`, for every kind of failure.

For single numbers neither numpy nor any other library is loaded.
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import TYPE_CHECKING, Literal, overload

from rbfrag.errors import InputError
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.measures import spectral
from rbfrag.fragility.prediction import answer_given

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rbfrag.fragility.model import Model
    from rbfrag.fragility.prediction import Prediction
    from rbfrag.fragility.prediction_array import PredictionArray
    from rbfrag.fragility.prediction_motion import Polarity
    from rbfrag.motions.recognise import MotionLike


@overload
def predict(
    p2: float | None = ...,
    kr: float | None = ...,
    *,
    kind: str | None = ...,
    ky: float | None = ...,
    displacement_m: float | None = ...,
    beta_deg: float | None = ...,
    ks: float | None = ...,
    ps2: float | None = ...,
    rotation_deg: float | None = ...,
    leaves_g: float | None = ...,
    restitution: float | None = ...,
    p2_sigma: float | None = ...,
    kr_sigma: float | None = ...,
    ky_sigma: float | None = ...,
    ks_sigma: float | None = ...,
    ps2_sigma: float | None = ...,
    restitution_sigma: float | None = ...,
    pgv_m_s: float | None = ...,
    pga_g: float | None = ...,
    tm_s: float | None = ...,
    pgd_m: float | None = ...,
    sa_g: Mapping[float, float] | None = ...,
    motion: MotionLike | None = ...,
    polarity: Polarity = ...,
    model: Model | None = ...,
    level: float = ...,
    db: str | PathLike[str] | None = ...,
    nan: Literal["propagate", "raise"] = ...,
    interval: bool = ...,
    weights: ArrayLike | None = ...,
) -> Prediction: ...


@overload
def predict(
    p2: ArrayLike | None = ...,
    kr: ArrayLike | None = ...,
    *,
    kind: str | None = ...,
    ky: ArrayLike | None = ...,
    displacement_m: ArrayLike | None = ...,
    beta_deg: ArrayLike | None = ...,
    ks: ArrayLike | None = ...,
    ps2: ArrayLike | None = ...,
    rotation_deg: float | None = ...,
    leaves_g: ArrayLike | None = ...,
    restitution: ArrayLike | None = ...,
    p2_sigma: ArrayLike | None = ...,
    kr_sigma: ArrayLike | None = ...,
    ky_sigma: ArrayLike | None = ...,
    ks_sigma: ArrayLike | None = ...,
    ps2_sigma: ArrayLike | None = ...,
    restitution_sigma: ArrayLike | None = ...,
    pgv_m_s: ArrayLike | None = ...,
    pga_g: ArrayLike | None = ...,
    tm_s: ArrayLike | None = ...,
    pgd_m: ArrayLike | None = ...,
    sa_g: Mapping[float, ArrayLike] | None = ...,
    motion: MotionLike | None = ...,
    polarity: Polarity = ...,
    model: Model | None = ...,
    level: float = ...,
    db: str | PathLike[str] | None = ...,
    nan: Literal["propagate", "raise"] = ...,
    interval: bool = ...,
    weights: ArrayLike | None = ...,
) -> Prediction | PredictionArray: ...


def predict(
    p2: ArrayLike | None = None,
    kr: ArrayLike | None = None,
    *,
    kind: str | None = None,
    ky: ArrayLike | None = None,
    displacement_m: ArrayLike | None = None,
    beta_deg: ArrayLike | None = None,
    ks: ArrayLike | None = None,
    ps2: ArrayLike | None = None,
    rotation_deg: float | None = None,
    leaves_g: ArrayLike | None = None,
    restitution: ArrayLike | None = None,
    p2_sigma: ArrayLike | None = None,
    kr_sigma: ArrayLike | None = None,
    ky_sigma: ArrayLike | None = None,
    ks_sigma: ArrayLike | None = None,
    ps2_sigma: ArrayLike | None = None,
    restitution_sigma: ArrayLike | None = None,
    pgv_m_s: ArrayLike | None = None,
    pga_g: ArrayLike | None = None,
    tm_s: ArrayLike | None = None,
    pgd_m: ArrayLike | None = None,
    sa_g: Mapping[float, ArrayLike] | None = None,
    motion: MotionLike | None = None,
    polarity: Polarity = "both",
    model: Model | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
    nan: Literal["propagate", "raise"] = "propagate",
    interval: bool = True,
    weights: ArrayLike | None = None,
) -> Prediction | PredictionArray:
    """Return the probability that a block fails, with its confidence interval.

    P = F(eta), with eta and F of the model's method (docs/theory/fragility.md), is the share of
    such blocks that fail over all earthquakes and sites with these measures. The interval
    F(eta ± t s) says how well that is known, s being the standard error of eta from the fits that
    each leave an earthquake out and t Student's quantile for as many earthquakes as tell of this
    block. The range of one earthquake says what share of such blocks at many sites fails in one
    single earthquake. Without shaking, and where mechanics forbids failure (k >= PGA, say), P is 0
    whatever the model says.

    A block is given by p2 and kr (it topples, or rocks if `kind` says so), by ky and displacement_m
    (it slides further than that), or by ks and ps2 (it slumps); each is a number or an array. What
    is given with a standard deviation is the median of what the block may be: P is then the mean
    over all that, with its interval, and ``block_sd`` how much P differs among them. Strength and
    size are lognormal, a restitution is normal, cut off at 0 and 1, and all are independent.

    Args:
        p2: frequency parameter p² of the block [1/s²].
        kr: its yield acceleration coefficient for toppling at rest [-].
        kind: how it fails; None for what the block is given by.
        ky: yield acceleration coefficient of sliding, tan(phi - beta) [-].
        displacement_m: the displacement down the base that is too far [m].
        beta_deg: with ky: dip of the base, out of the slope positive [deg]; level if not given.
        ks: yield acceleration coefficient of slumping [-].
        ps2: frequency parameter p_s² of slumping at rest [1/s²].
        rotation_deg: with ks: rotation that counts as failure [deg], of which there must be a
            model; None for failure past recovery.
        leaves_g: with ks: acceleration at which the block leaves its back plane [g]: above it the
            answer warns.
        restitution: of a block that rocks: speed after an impact over that before it, above 0 and
            up to 1; None for what angular momentum leaves.
        p2_sigma: standard deviation of ln p2.
        kr_sigma: standard deviation of ln kr.
        ky_sigma: standard deviation of ln ky.
        ks_sigma: standard deviation of ln ks.
        ps2_sigma: standard deviation of ln ps2.
        restitution_sigma: standard deviation of the restitution.
        pgv_m_s: peak ground velocity of the horizontal component [m/s].
        pga_g: peak ground acceleration [g].
        tm_s: mean period [s].
        pgd_m: peak ground displacement [m].
        sa_g: spectral accelerations of the horizontal component at 5 % damping [g] by their
            period, 0.3, 1, 2 or 3 s: ``{1.0: 0.4}``.
        motion: the accelerogram itself or its file, instead of its measures.
        polarity: ``forward`` or ``reverse`` where it is known how the motion points at the slope;
            ``both`` gives the mean of the two, which stand beside it (motion only).
        model: a model, the name of a stored one, or None for the one of the best score that what
            is given suffices for, or the database's default where no other reads more of the
            motion.
        level: confidence level of the interval and of the range of one earthquake, between 0
            and 1.
        db: database of the model: a path or SQLAlchemy URL; None for ``RBFRAG_DB``, or else
            ``rbfrag.db`` in the current folder, or else the reference that is shipped.
        nan: in arrays, ``propagate`` answers NaN with its reason where the input cannot be
            used, ``raise`` refuses such arrays.
        interval: in arrays, False leaves interval and range out (their ends are then NaN), which
            takes less time.
        weights: makes the arrays that describe the block draws of one block, of these weights (1:
            all the same): one answer, over all of them.

    Returns:
        :class:`Prediction` when every argument is a single number (with `motion` and both
        polarities :class:`MotionPrediction`), otherwise
        :class:`~rbfrag.fragility.prediction_array.PredictionArray` of the broadcast shape. In
        arrays a block with a strength <= 0 fails at rest: P = 1 with the reason ``unstable``.

    Raises:
        InputError: a value that cannot be used, or measures the model cannot work with.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    if nan not in ("propagate", "raise"):
        raise InputError(f"nan = {nan!r}: use 'propagate' or 'raise'")
    # one by one: a comprehension makes a question of numbers 9 % slower
    given: dict[str, ArrayLike] = {}
    if p2 is not None:
        given["p2"] = p2
    if kr is not None:
        given["kr"] = kr
    if ky is not None:
        given["ky"] = ky
    if displacement_m is not None:
        given["displacement_m"] = displacement_m
    if beta_deg is not None:
        given["beta_deg"] = beta_deg
    if ks is not None:
        given["ks"] = ks
    if ps2 is not None:
        given["ps2"] = ps2
    if leaves_g is not None:
        given["leaves_g"] = leaves_g
    if restitution is not None:
        given["restitution"] = restitution
    if p2_sigma is not None:
        given["p2_sigma"] = p2_sigma
    if kr_sigma is not None:
        given["kr_sigma"] = kr_sigma
    if ky_sigma is not None:
        given["ky_sigma"] = ky_sigma
    if ks_sigma is not None:
        given["ks_sigma"] = ks_sigma
    if ps2_sigma is not None:
        given["ps2_sigma"] = ps2_sigma
    if restitution_sigma is not None:
        given["restitution_sigma"] = restitution_sigma
    if pgv_m_s is not None:
        given["pgv_m_s"] = pgv_m_s
    if pga_g is not None:
        given["pga_g"] = pga_g
    if tm_s is not None:
        given["tm_s"] = tm_s
    if pgd_m is not None:
        given["pgd_m"] = pgd_m
    if sa_g is not None:
        given |= spectral(sa_g)
    if motion is not None:
        # Kept apart: a motion needs numpy.
        from rbfrag.fragility.prediction_motion import predict_motion

        return predict_motion(
            given, motion, kind=kind, rotation_deg=rotation_deg, polarity=polarity, model=model,
            level=level, db=db, weights=weights,
        )  # fmt: skip
    chosen = find_model(model, given, db, kind=kind, rotation_deg=rotation_deg)
    return answer_given(chosen, given, level, nan=nan, interval=interval, weights=weights)
