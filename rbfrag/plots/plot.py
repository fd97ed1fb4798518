"""The figures by what they show, in files or notebooks: `rbfrag.plot`."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Required, TypedDict, Unpack

from numpy.typing import ArrayLike

from rbfrag.db.engine import opened_database
from rbfrag.db.models import load_model
from rbfrag.db.queries import combination_table
from rbfrag.errors import InputError
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.measures import MEASURES, spectral
from rbfrag.hazards.curve_file import CurveLike, as_curves
from rbfrag.motions.polarity import POLARITIES, Polarity
from rbfrag.motions.recognise import MotionLike, as_motion
from rbfrag.plots.canvas import plot_path
from rbfrag.question.fields import AnsweringFields, ShakingFields
from rbfrag.question.keywords import LEVEL, BlockKeywords, model_for, parts_of
from rbfrag.question.question import described
from rbfrag.solver.block.geometry import Block

if TYPE_CHECKING:
    from rbfrag.hazards.answer import HazardAnswer
    from rbfrag.hazards.losses import LossAnswer
    from rbfrag.hazards.survival import SurvivalAnswer
    from rbfrag.rockmasses.joint_sets import Realisations
    from rbfrag.rockmasses.shaking import ShakenMass

Out = str | PathLike[str] | None
"""File to write (.png, .pdf, .svg); None for a picture in memory, which a notebook shows."""


@dataclass(frozen=True)
class Picture:
    """A figure.

    Args:
        path: its file; None of one in memory.
        png: the image of one in memory.
        warnings: what to know about it.
    """

    path: Path | None
    png: bytes | None = field(default=None, repr=False)
    warnings: tuple[str, ...] = ()

    def _repr_png_(self) -> bytes | None:
        """Return what a notebook shows."""
        return self.png


def _drawn(
    out: Out, draw: Callable[[str | PathLike[str]], object], warnings: Sequence[str] = ()
) -> Picture:
    """Return the figure that a function draws into a file."""
    if out is not None:
        draw(out)
        return Picture(Path(out), None, tuple(warnings))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "figure.png"
        draw(file)
        return Picture(None, file.read_bytes(), tuple(warnings))


def _checked(out: Out) -> None:
    """Refuse a file that cannot be written, before long work."""
    if out is not None:
        plot_path(out)


def fit(
    out: Out = None,
    *,
    model: str | None = None,
    log: bool = False,
    db: str | PathLike[str] | None = None,
) -> Picture:
    """Draw the data of a fit with its 2.5 %, 50 % and 97.5 % failure lines and histograms.

    Args:
        out: file to write (.png, .pdf, .svg); None for a picture that a notebook shows.
        model: name of the model; None for the database's default.
        log: logarithmic axes.
        db: the database: a path or URL; None for the default.
    """
    from rbfrag.fragility.fit.check import source_of
    from rbfrag.fragility.fit.data import fit_data
    from rbfrag.fragility.methods import method_named
    from rbfrag.fragility.model import FragilityModel
    from rbfrag.plots.fit import plot_fit

    _checked(out)
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        row = load_model(connection, model)
        fitted, source = FragilityModel.from_row(row), source_of(connection, row)
    today = fit_data(source, method_named(row.method), fitted.term, kind=row.kind)
    warnings = (
        ()
        if today.fingerprint == row.data_fingerprint
        else (
            f"the data have changed since {fitted.name} was fitted: the points are those of "
            "today; fitting it again takes them",
        )
    )
    return _drawn(
        out,
        lambda path: plot_fit(source.table, fitted, path, log=log, xp_m_s=source.xp_m_s),
        warnings,
    )


def chart(
    out: Out = None,
    *,
    model: str | None = None,
    p2: float | None = None,
    pga_g: float | None = None,
    tm_s: float | None = None,
    db: str | PathLike[str] | None = None,
) -> Picture:
    """Draw lines of equal probability of toppling over intensity and block, to read by hand.

    Args:
        out: as for :func:`fit`.
        model: model of one measure, or of PGV with PGA (and Tm); None for the one that answers
            for PGV.
        p2: frequency parameter p² of the blocks [1/s²]; None for the middle of the fitted range.
        pga_g: PGA of the motions [g]; None for one in proportion to PGV.
        tm_s: mean period of the motions [s]; None for the middle of the fitted range.
        db: as for :func:`fit`.
    """
    from rbfrag.plots.chart import plot_chart
    from rbfrag.plots.model_lines import held_measures

    chosen = find_model(model, ["pgv_m_s"] if model is None else MEASURES, db)
    held = held_measures(chosen, p2=p2, pga_g=pga_g, tm_s=tm_s)
    return _drawn(out, lambda path: plot_chart(chosen, path, held))


VARIED = {
    "pgv": "pgv_m_s", "pga": "pga_g", "pgd": "pgd_m", "sa03": "sa03_g", "sa10": "sa10_g",
    "sa20": "sa20_g", "sa30": "sa30_g",
}  # fmt: skip
"""What a curve may run over."""


class _OneCurve(TypedDict, total=False):
    """Measures that are held, and what the curve is drawn into."""

    out: Out
    sa_g: Mapping[float, float] | None


class FragilityCurveKeywords(
    BlockKeywords[float | None],
    ShakingFields[float | None],
    AnsweringFields,
    _OneCurve,
    total=False,
):
    """What a curve is of, what is held, and which model it is of."""


def curve(
    p2: float | None = None,
    kr: float | None = None,
    out: Out = None,
    /,
    *,
    over: str | None = None,
    beside: Callable[[str], Mapping[str, Callable[[Any], Any]]] | None = None,
    **question: Unpack[FragilityCurveKeywords],
) -> Picture:
    """Draw the fragility curve of one block over a measure of the shaking, with two bands.

    Args:
        p2: frequency parameter p² of the block [1/s²], if it is not given by name.
        kr: its toppling yield acceleration coefficient, likewise.
        out: as for :func:`fit`; it may be given by name.
        over: what the curve runs over: pgv, pga, pgd, sa03, sa10, sa20 or sa30; None for pgv, or
            what the model reads first.
        beside: gives other fragilities to compare with, by name, for the measure that the curve
            runs over.
        question: fields of the block, with ``kind``, the measures that are held, and ``model``,
            ``level`` and ``db``, as :func:`rbfrag.predict` has them.
    """
    from rbfrag.plots.curve import plot_curve, rise_of_curve

    numbers = [each for each in (p2, kr) if each is not None]
    block, held, answering, drawing = parts_of(
        numbers, question, BlockKeywords, ShakingFields, AnsweringFields, _OneCurve
    )
    held |= spectral(drawing.get("sa_g") or {})
    kind = block.pop("kind", None)
    blocks = described(block, kind)
    (group,) = blocks.groups
    varied = None if over is None else VARIED.get(over)
    if over is not None and varied is None:
        raise InputError(f"over = {over}: a curve runs over {', '.join(VARIED)}")
    if "model" in answering:
        chosen = model_for(answering, (*group.numbers, *MEASURES), group.kind)
        varied = varied or chosen.term.inputs[0]
    else:
        varied = varied or "pgv_m_s"
        chosen = model_for(answering, (*group.numbers, varied, *held), group.kind)
    if varied in held:
        raise InputError(
            f"{varied} is what the curve runs over: leave its value out, or say what else it runs "
            "over"
        )
    others = {} if beside is None else beside(varied)
    return _drawn(
        drawing.get("out", out),
        lambda path: plot_curve(
            chosen, group.numbers, path, over=varied, fixed=held,
            level=answering.get("level", LEVEL), beside=others,
        ),
        (*blocks.remarks, *rise_of_curve(chosen, group.numbers)),
    )  # fmt: skip


def sensitivity(
    out: Out = None, *, suite: str | None = None, db: str | PathLike[str] | None = None
) -> Picture:
    """Draw critical k_r/PGA over the frequency ratio ω_m/p, with the lines of single lobes.

    Args:
        out: as for :func:`fit`.
        suite: motions of this suite only.
        db: as for :func:`fit`.
    """
    from rbfrag.plots.critical_strength import plot_sensitivity

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        table = combination_table(connection, suite=suite)
    data = "without vertical motion" + (f", suite {suite}" if suite else "")
    return _drawn(out, lambda path: plot_sensitivity(table, path, data=data))


def vertical(
    out: Out = None, *, suite: str | None = None, db: str | PathLike[str] | None = None
) -> Picture:
    """Draw critical strengths with vertical motion beside those without it.

    Args:
        out: as for :func:`fit`.
        suite: motions of this suite only.
        db: as for :func:`fit`.
    """
    from rbfrag.plots.critical_strength import plot_vertical, vertical_pairs

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        without = combination_table(connection, suite=suite)
        with_it = combination_table(connection, suite=suite, vertical="with")
    pairs = vertical_pairs(without, with_it)
    return _drawn(out, lambda path: plot_vertical(pairs, path))


def calibration(
    out: Out = None,
    *,
    models: Sequence[str] = (),
    seed: int = 0,
    db: str | PathLike[str] | None = None,
) -> Picture:
    """Draw predicted probabilities beside the shares that toppled, earthquakes left out in turn.

    Args:
        out: as for :func:`fit`.
        models: names of up to four stored models, each fitted again without each earthquake; none
            for the default.
        seed: seed of the draws of earthquakes.
        db: as for :func:`fit`.
    """
    from rbfrag.fragility.fit.check import held_out_of
    from rbfrag.plots.calibration import plot_calibration

    _checked(out)
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        names: Sequence[str | None] = models or [None]
        answers = [held_out_of(connection, name, seed=seed) for name in names]
    bins, scores = ({each.name: getattr(each, of) for each in answers} for of in ("bins", "scores"))
    return _drawn(
        out, lambda path: plot_calibration(bins, path, scores=scores, data=answers[0].outcomes)
    )


def spectrum(
    motions: MotionLike | Sequence[MotionLike],
    out: Out = None,
    *,
    p2: Sequence[float] = (0.1, 30.0),
    polarities: Sequence[Polarity] = POLARITIES,
) -> Picture:
    """Draw the toppling spectra of motions over the size of the block, with PGV beside them.

    Args:
        motions: up to eight motions or their files.
        out: as for :func:`fit`.
        p2: the figure spans at least these p² [1/s²].
        polarities: ``forward``, ``reverse`` or both.
    """
    from rbfrag.plots.spectrum import plot_spectrum

    _checked(out)
    given: Any = motions if isinstance(motions, list | tuple) else [motions]
    records = [as_motion(each) for each in given]
    return _drawn(out, lambda path: plot_spectrum(records, path, polarities=polarities, p2=p2))


def response(
    motion: MotionLike,
    out: Out = None,
    *,
    p2: float,
    kr: float,
    vertical: MotionLike | None = None,
    polarity: Polarity = "forward",
) -> Picture:
    """Draw acceleration against k_r(θ), and θ over the critical angle, in time.

    Args:
        motion: horizontal ground motion, or its file.
        out: as for :func:`fit`.
        p2: frequency parameter p² of the block [1/s²].
        kr: its toppling yield acceleration coefficient.
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` or ``reverse``.
    """
    from rbfrag.plots.response import plot_response
    from rbfrag.solver.toppling_run import respond

    _checked(out)
    ground = as_motion(motion)
    upward = None if vertical is None else as_motion(vertical, "vertical")
    shaken = respond(ground, p2=p2, kr=kr, vertical=upward, polarity=polarity, history=True)
    reverse = polarity == "reverse"
    return _drawn(
        out,
        lambda path: plot_response(shaken, path, p2=p2, kr=kr, reverse=reverse, title=ground.label),
    )


class ModePlanes(TypedDict, total=False):
    """The planes that modes are drawn for, and blocks to show on them."""

    phi_deg: Required[float]
    beta_deg: float
    phi_back_deg: float | None
    back_fracture: bool
    alpha1_deg: ArrayLike | None
    alpha3_deg: ArrayLike | None


def modes(out: Out = None, **planes: Unpack[ModePlanes]) -> Picture:
    """Draw failure modes and yield accelerations over the block angles α1 and α3.

    Args:
        out: as for :func:`fit`.
        planes: ``phi_deg``, friction angle of the base [deg]; ``beta_deg``, its dip for the yield
            accelerations [deg]; ``phi_back_deg``, friction angle of the back plane [deg], None for
            that of the base; ``back_fracture``, whether there is a fracture behind the block;
            ``alpha1_deg`` and ``alpha3_deg``, angles of heel and toe of blocks to show [deg].
    """
    from rbfrag.plots.modes import plot_modes

    return _drawn(out, lambda path: plot_modes(path, **planes))


def rotation(
    block: Block,
    out: Out = None,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    back_follows: Sequence[float] = (0.0, 0.5, 1.0),
) -> Picture:
    """Draw the yield of a slump or a confined topple over its rotation.

    Args:
        block: the block.
        out: as for :func:`fit`.
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        back_follows: shares of the rotation by which the back plane turns with the block.
    """
    from rbfrag.plots.rotation import plot_rotation

    return _drawn(
        out,
        lambda path: plot_rotation(
            block, path, beta_deg=beta_deg, phi_deg=phi_deg, phi_back_deg=phi_back_deg,
            shares=back_follows,
        ),
    )  # fmt: skip


def hazard(
    curve: CurveLike,
    answer: HazardAnswer,
    out: Out = None,
    *,
    imt: str | None = None,
    site: str | None = None,
) -> Picture:
    """Draw a hazard curve and where the failures of the first block come from.

    Args:
        curve: hazard curve, or its file.
        answer: of :func:`rbfrag.hazard` under it.
        out: as for :func:`fit`.
        imt: as for :func:`rbfrag.hazard`.
        site: as for :func:`rbfrag.hazard`.
    """
    from rbfrag.plots.hazard import plot_contribution

    (read,) = as_curves(curve, imt=imt, site=site)
    return _drawn(out, lambda path: plot_contribution(read, answer, path))


def survival(
    curves: CurveLike | Sequence[CurveLike],
    answer: SurvivalAnswer,
    out: Out = None,
    *,
    imt: str | None = None,
    site: str | None = None,
) -> Picture:
    """Draw hazard curves, survival over a factor on their rates, and weights of branches.

    Args:
        curves: hazard curves, or their files.
        answer: of :func:`rbfrag.survival` under them.
        out: as for :func:`fit`.
        imt: as for :func:`rbfrag.hazard`.
        site: as for :func:`rbfrag.hazard`.
    """
    from rbfrag.plots.survival import plot_survival

    read = as_curves(curves, imt=imt, site=site)
    return _drawn(out, lambda path: plot_survival(read, answer, path))


def losses(answer: LossAnswer, out: Out = None) -> Picture:
    """Draw how often numbers of failures, and losses, are reached.

    Args:
        answer: of :func:`rbfrag.losses`, with samples.
        out: as for :func:`fit`.
    """
    from rbfrag.plots.losses import plot_losses

    return _drawn(out, lambda path: plot_losses(answer, path))


class _OfRockMass(Protocol):
    """What :func:`rbfrag.rockmass` answers."""

    @property
    def blocks(self) -> Realisations: ...
    @property
    def outcomes(self) -> ShakenMass | None: ...
    @property
    def level(self) -> float: ...


def rockmass(answer: _OfRockMass, out: Out = None) -> Picture:
    """Draw the cumulative counts of blocks against PGA by mode; with a motion the shares that fail.

    Args:
        answer: of :func:`rbfrag.rockmass`.
        out: as for :func:`fit`.
    """
    from rbfrag.plots.rockmass import plot_failures, plot_rockmass

    ran = answer.outcomes
    if ran is None:
        return _drawn(out, lambda path: plot_rockmass(answer.blocks, path))
    return _drawn(out, lambda path: plot_failures(ran, path, level=answer.level))


class _OfMap(Protocol):
    """What :func:`rbfrag.shakemap` answers."""

    @property
    def columns(self) -> Mapping[str, Any]: ...
    @property
    def title(self) -> str: ...
    @property
    def epicentre(self) -> tuple[float, float] | None: ...
    @property
    def shape(self) -> tuple[int, int] | None: ...


def shakemap(answer: _OfMap, out: Out = None) -> Picture:
    """Draw the map of probabilities.

    Args:
        answer: of :func:`rbfrag.shakemap`.
        out: as for :func:`fit`.
    """
    from rbfrag.plots.shakemap import plot_shakemap

    lon, lat, probability = (answer.columns[name] for name in ("lon", "lat", "probability"))
    return _drawn(
        out,
        lambda path: plot_shakemap(
            lon, lat, probability, path, title=answer.title, epicentre=answer.epicentre,
            shape=answer.shape,
        ),
    )  # fmt: skip
