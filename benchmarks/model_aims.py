"""Aims of the fragility models in cross-validation, by what is given of the shaking.

Losses and coefficients are those of the study that the models were chosen by, which cross-validated
by 16 folds of earthquakes. Here each earthquake is held out alone: this changes losses by up to
0.0003, and by 0.0008 where magnitude is given.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from benchmarks.held_out import Predicted
from benchmarks.page import markdown
from rbfrag.db.model_file import ModelRow
from rbfrag.fragility.fit.data import REAL_KR
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S, spectral_name

Loss = tuple[float, float]
"""Log loss of blocks with k_r >= 0.02 and with k_r >= 0.05."""

KR_CLASSES = (0.02, 0.05, 0.1, 0.2, 0.4)
"""Edges of the classes of k_r."""

CALIBRATED_P2 = (30.0, 10.0, 3.0, 1.0, 0.3)
"""Sizes p² [1/s²] whose calibration slope is aimed at."""

STRONG_KR = 0.2
"""From here on predicted failures are compared with observed ones."""

RARE_P = 0.01
"""Failures of blocks with a lower P are counted."""

WITHIN, WITHIN_PGA_ALONE, WITHIN_SLIDING = 0.001, 0.003, 0.002
SLOPE, SLOPE_POOR = (0.85, 1.15), (0.75, 1.3)
CLASS_SLOPE, RATIO = (0.75, 1.25), (0.75, 1.4)


@dataclass(frozen=True)
class MeasureSet:
    """Intensity measures that are given in addition to those that a model requires.

    Args:
        periods_s: oscillator periods of the spectral accelerations [s].
        scalars: names of the measures without a period.
    """

    periods_s: tuple[float, ...] = ()
    scalars: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the measures."""
        return (*self.scalars, *map(spectral_name, self.periods_s))

    @property
    def words(self) -> str:
        """Description for a table."""
        spectrum = ", ".join(f"{period:g}" for period in self.periods_s)
        if len(self.periods_s) == len(SPECTRUM_PERIODS_S):
            spectrum = "21 periods"
        elif len(self.periods_s) > 5:
            spectrum = f"{len(self.periods_s)} periods"
        parts = [NAMES.get(name, name) for name in self.scalars]
        return ", ".join([*parts, *[f"SA({spectrum})"] * bool(spectrum)])


NAMES = {
    "pgv_m_s": "PGV", "pga_g": "PGA", "pgd_m": "PGD", "tm_s": "$T_m$", "xp_m_s": "$X(p)$",
    "magnitude": "magnitude", "arias_m_s": "$I_a$",
}  # fmt: skip
"""Intensity measures in tables."""

REQUIRED_ONLY, WITH_PGV, WITH_TM = (
    MeasureSet(),
    MeasureSet(scalars=("pgv_m_s",)),
    MeasureSet(scalars=("tm_s",)),
)
SA_21 = MeasureSet(SPECTRUM_PERIODS_S)
SA_13 = MeasureSet((0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.5, 10.0))
SA_8 = MeasureSet((0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0))
SA_TO_2_S, SA_TO_3_S = MeasureSet((0.1, 0.2, 0.5, 1.0, 2.0)), MeasureSet((0.2, 0.5, 1.0, 2.0, 3.0))
SA_4, SA_3 = MeasureSet((0.3, 0.6, 1.0, 3.0)), MeasureSet((0.3, 1.0, 3.0))
SA_2, SA_1 = MeasureSet((0.2, 1.0)), MeasureSet((1.0,))


@dataclass(frozen=True)
class Aims:
    """What is aimed at, of one model with one set of measures.

    Args:
        loss: log losses; None where nothing is aimed at.
        within: how much higher they may be.
        below: how much lower.
        slope: range of the calibration slope of blocks with k_r >= 0.05.
        is_exact: whether the spectrum is known: then the slopes of classes and the coefficients
            are aimed at, too.
    """

    loss: Loss | None = None
    within: float = WITHIN
    below: float = WITHIN
    slope: tuple[float, float] = SLOPE
    is_exact: bool = False


@dataclass(frozen=True)
class ModelAims:
    """Sets of measures that a model is judged with.

    Args:
        kind: response kind.
        sets: aims by what is given in addition to what the model requires.
        coefficients: those of the study.
        intercept: limit of the calibration intercept of a magnitude class.
    """

    kind: str = "toppling"
    sets: Mapping[MeasureSet, Aims] = field(default_factory=lambda: {REQUIRED_ONLY: Aims()})
    coefficients: tuple[float, ...] = ()
    intercept: float | None = None


def _sets(
    losses: Mapping[MeasureSet, Loss | None],
    poor: Sequence[MeasureSet] = (),
    alone: MeasureSet | None = None,
) -> dict[MeasureSet, Aims]:
    """Return aims by what is given.

    Args:
        losses: aims by what is given.
        poor: sets of which a poorer calibration is accepted.
        alone: the set that is PGA alone.
    """
    result = {}
    for measures, loss in losses.items():
        within = WITHIN_PGA_ALONE if measures == alone else WITHIN
        slope = SLOPE_POOR if measures in poor else SLOPE
        # the study did not reach what the product does with the magnitude
        below = math.inf if "magnitude" in measures.scalars else within
        result[measures] = Aims(loss, within, below, slope, is_exact=measures == SA_21)
    return result


def _sliding(loss: float | None) -> Aims:
    """Return aims of blocks without k_r, which have one loss."""
    return Aims(loss and (loss, math.inf), WITHIN_SLIDING, WITHIN_SLIDING)


_SPECTRA = (SA_21, SA_13, SA_8, SA_TO_2_S, SA_4, SA_3, SA_2, SA_1)
_PGV_PGA = (
    (0.0990, 0.0721), (0.0995, 0.0725), (0.1019, 0.0751), (0.1024, 0.0753), (0.1027, 0.0755),
    (0.1059, 0.0787), (0.1059, 0.0784), (0.1066, 0.0789),
)  # fmt: skip
_PGA = (
    (0.1082, 0.0774), (0.1089, 0.0778), (0.1133, 0.0824), (0.1210, 0.0857), (0.1204, 0.0865),
    (0.1264, 0.0915), (0.1480, 0.1056), (0.1466, 0.1029),
)  # fmt: skip
_SA = (
    (0.1126, 0.0821), (0.1135, 0.0828), (0.1181, 0.0881), (0.1273, 0.0929), (0.1327, 0.0971),
    (0.1417, 0.1058), (0.1615, 0.1207), (0.1917, 0.1433),
)  # fmt: skip


def _with_pgv(measures: MeasureSet) -> MeasureSet:
    return MeasureSet(measures.periods_s, WITH_PGV.scalars)


MODELS: dict[str, ModelAims] = {
    "toppling-pgv_pga": ModelAims(
        sets=_sets({
            **dict(zip(_SPECTRA, _PGV_PGA, strict=True)),
            WITH_TM: (0.1067, 0.0792), REQUIRED_ONLY: (0.1129, 0.0855),
        }),
        coefficients=(2.356, 0.648, 2.292, 4.494, 1.018, 2.115),
    ),
    "toppling-pga": ModelAims(
        sets=_sets({
            **dict(zip(_SPECTRA, _PGA, strict=True)),
            WITH_TM: (0.1344, 0.0957), REQUIRED_ONLY: (0.2484, 0.1703),
        }, poor=(REQUIRED_ONLY,), alone=REQUIRED_ONLY),
        coefficients=(-1.167, 0.126, 2.977, 1.908, 3.284),
    ),
    "toppling-sa": ModelAims(
        sets=_sets(dict(zip(_SPECTRA, _SA, strict=True)), poor=_SPECTRA),
        coefficients=(-2.163, 0.155, -0.109, 3.402),
    ),
    "toppling-pgv": ModelAims(
        sets={REQUIRED_ONLY: Aims((0.1293, 0.1079), is_exact=True)},
        coefficients=(1.862, 0.567, 4.683, -0.155, -1.474),
    ),
    "record-xp": ModelAims(
        sets={REQUIRED_ONLY: Aims((0.0267, 0.0109))}, coefficients=(2.202, 1.579, 0.718)
    ),
    "logistic-pgv": ModelAims(), "logistic-pga_tm": ModelAims(), "logistic-pgd_tm": ModelAims(),
    "wls-pgv": ModelAims(),
    "rocking-pga": ModelAims(
        "rocking",
        _sets({
            SA_21: (0.1043, 0.0858), SA_13: (0.1046, 0.0861), SA_8: (0.1086, 0.0898),
            SA_TO_3_S: (0.1179, 0.0928), SA_TO_2_S: None, SA_4: None, SA_3: (0.1215, 0.0959),
            SA_2: None, SA_1: (0.1665, 0.1290),
            _with_pgv(SA_3): (0.1195, 0.0940), _with_pgv(SA_1): (0.1358, 0.1050),
            WITH_PGV: (0.1471, 0.1154), WITH_TM: (0.1699, 0.1310),
            MeasureSet(scalars=("magnitude",)): (0.2295, 0.1881), REQUIRED_ONLY: (0.2831, math.inf),
        }, poor=(REQUIRED_ONLY,), alone=REQUIRED_ONLY),
        (2.175, 1.789, 1.011, 0.576, -0.272, -4.656, 2.202),
    ),
    "rocking-sa": ModelAims(
        "rocking",
        _sets({
            **dict.fromkeys(_SPECTRA), SA_21: (0.1286, 0.1124), SA_1: (0.2008, 0.1691),
        }, poor=_SPECTRA),
        (1.065, 0.519, -0.401, -4.102, 2.229),
    ),
    "rocking-pgv": ModelAims(
        "rocking", {REQUIRED_ONLY: Aims((0.1867, 0.1526))}, (0.344, 1.612, 1.046, -0.407, -2.845)
    ),
    **{
        f"sliding-{term}": ModelAims("sliding", {REQUIRED_ONLY: _sliding(loss)}, (), intercept)
        for term, loss, intercept in (
            ("pgv_pga_m", 0.0934, 0.9), ("pgv_pga", 0.1040, None), ("pgv_pga_ia", 0.0801, None),
            ("pgv", None, None),
        )
    },
}  # fmt: skip
"""The models that are judged, by the names that they are stored under."""


@dataclass(frozen=True)
class Mark:
    """One number that is aimed at.

    Args:
        model: whose number it is.
        words: what it is.
        low: lowest accepted value.
        high: highest accepted value.
        value: what is reached; NaN where it could not be measured.
        also: a further condition, in words, and whether it holds.
    """

    model: str
    words: str
    low: float
    high: float
    value: float
    also: tuple[str, bool] | None = None

    @property
    def aim(self) -> str:
        """The accepted range in words."""
        if math.isinf(self.low):
            words = f"≤ {self.high:g}"
        elif math.isinf(self.high):
            words = f"≥ {self.low:g}"
        else:
            words = f"{self.low:g} to {self.high:g}"
        return words if self.also is None else f"{words}, {self.also[0]}"

    @property
    def is_reached(self) -> bool:
        """Whether the value is accepted."""
        return self.low <= self.value <= self.high and (self.also is None or self.also[1])

    @property
    def cell(self) -> str:
        """The value, marked where the aim is missed."""
        if math.isnan(self.value):
            return "**not measured, missed**"
        return f"{self.value:.4g}" if self.is_reached else f"**{self.value:.4g}, missed**"


def acceptance_table(marks: Sequence[Mark]) -> str:
    """Return a table of aims and what is reached."""
    head = ["model", "what", "aim", "reached"]
    return markdown((head, [[m.model, m.words, m.aim, m.cell] for m in marks]))


def rare_failures(blocks: Predicted) -> tuple[int, float, int]:
    """Return failures of blocks with P below `RARE_P`, the expected number, and the blocks."""
    rare = blocks.only(blocks.p < RARE_P)
    return int(rare.failed.sum()), float(rare.p.sum()), rare.p.size


def model_marks(
    name: str, row: ModelRow | None, predicted: Mapping[MeasureSet, Predicted | None]
) -> Iterator[Mark]:
    """Yield the aims of a model with what is reached; what is not measured is missed.

    Args:
        name: of the model.
        row: as it is stored; None where it is not.
        predicted: predictions by what is given; None where there are none.
    """
    model = MODELS[name]
    if model.coefficients:
        yield Mark(name, "largest change of a coefficient, in CR3 standard errors", -math.inf, 1.0,
                   _largest_change(model.coefficients, row))  # fmt: skip
    for measures, aims in model.sets.items():
        blocks = predicted.get(measures)
        where = f"{measures.words}: " if len(model.sets) > 1 and measures.words else ""
        yield from _set_marks(name, where, aims, model, blocks)
    if model.intercept is not None:
        blocks = predicted.get(REQUIRED_ONLY)
        finite = [] if blocks is None else [i for i in blocks.intercepts if math.isfinite(i)]
        worst = max(finite, key=abs, default=math.nan)
        words = "largest intercept of a magnitude class"
        yield Mark(name, words, -model.intercept, model.intercept, round(worst, 2))


def _set_marks(
    name: str, where: str, aims: Aims, model: ModelAims, blocks: Predicted | None
) -> Iterator[Mark]:
    if aims.loss is None:
        return
    nothing, of_kr = math.nan, model.kind != "sliding"

    def loss(words: str, value: float, part: Predicted | None) -> Mark:
        reached = nothing if part is None else round(part.loss, 4)
        low, high = round(value - aims.below, 4), round(value + aims.within, 4)
        return Mark(name, where + words, low, high, reached)

    yield loss("log loss, k_r ≥ 0.02" if of_kr else "log loss", aims.loss[0], blocks)
    if not of_kr:
        return
    real = None if blocks is None else blocks.kr_from(REAL_KR)
    if math.isfinite(aims.loss[1]):
        yield loss("log loss, k_r ≥ 0.05", aims.loss[1], real)
    slope = nothing if real is None else round(real.slope[0], 2)
    yield Mark(name, f"{where}calibration slope, k_r ≥ 0.05", *aims.slope, slope)
    ratio = nothing if blocks is None else round(blocks.kr_from(STRONG_KR).ratio, 2)
    yield Mark(name, f"{where}predicted/observed failures, k_r ≥ {STRONG_KR:g}", *RATIO, ratio)
    failures, expected = (nothing, nothing) if blocks is None else rare_failures(blocks)[:2]
    words = f"{where}failures with P < {RARE_P:g} (2 × expected + 3)"
    yield Mark(name, words, -math.inf, round(2.0 * expected + 3.0, 1), failures)
    if aims.is_exact:
        for words, slopes in class_slopes(blocks).items():
            for which, value in (("lowest", min(slopes)), ("highest", max(slopes))):
                words_of = f"{where}{which} calibration slope of a class of {words}"
                yield Mark(name, words_of, *CLASS_SLOPE, round(value, 2))


def class_slopes(blocks: Predicted | None) -> dict[str, list[float]]:
    """Return the calibration slopes by k_r and by p²; NaN for no predictions."""
    if blocks is None:
        return {"k_r": [math.nan], "p²": [math.nan]}
    return {
        "k_r": [blocks.kr_from(low, high).slope[0] for low, high in pairwise(KR_CLASSES)],
        "p²": [blocks.of_size(p2).slope[0] for p2 in CALIBRATED_P2],
    }


def _largest_change(coefficients: Sequence[float], row: ModelRow | None) -> float:
    if row is None or len(row.coefficients) != len(coefficients):
        return math.nan
    errors = [row.covariance[i][i] ** 0.5 for i in range(len(coefficients))]
    changes = [
        abs(value - aim) / error
        for value, aim, error in zip(row.coefficients.values(), coefficients, errors, strict=True)
    ]
    return round(max(changes), 2)
