"""Figures by subject, for files or notebooks: `rbfrag.plot`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from os import PathLike
from typing import TYPE_CHECKING, Any, Unpack

from rbfrag.db.engine import opened_database
from rbfrag.db.models import load_model
from rbfrag.db.queries import combination_table
from rbfrag.errors import InputError
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_selection import find_model, stored_row, unused_measures
from rbfrag.fragility.prediction import Prediction
from rbfrag.motions.polarity import Polarity
from rbfrag.motions.readers import MotionLike, as_motion
from rbfrag.plots.canvas import Out, Picture, plot_path
from rbfrag.question.fields import BlockKeywords, MeasureFields, RangeFields
from rbfrag.question.keywords import LEVEL, model_for, parts_of
from rbfrag.question.nominal import described
from rbfrag.results.diagnostic import diagnostics
from rbfrag.vocabulary.quantities import BLOCKS, INTENSITY, RANGE
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S, period_of, spectral_name

if TYPE_CHECKING:
    from rbfrag.plots.hazard import plot_contribution as hazard
    from rbfrag.plots.hazard import plot_losses as losses
    from rbfrag.plots.hazard import plot_survival as survival
    from rbfrag.plots.modes import plot_modes as modes
    from rbfrag.plots.modes import plot_rotation as rotation
    from rbfrag.plots.spectrum import plot_spectrum as spectrum

__all__ = (
    "Picture", "calibration", "chart", "critical", "curve", "fit", "hazard", "losses", "modes",
    "response", "rockmass", "rotation", "sensitivity", "shakemap", "spectrum", "survival",
    "vertical",
)  # fmt: skip

_DRAWN_THERE = {
    "hazard": ("hazard", "plot_contribution"), "losses": ("hazard", "plot_losses"),
    "modes": ("modes", "plot_modes"), "rotation": ("modes", "plot_rotation"),
    "spectrum": ("spectrum", "plot_spectrum"), "survival": ("hazard", "plot_survival"),
}  # fmt: skip
"""File and name of each figure of an answer or a motion, loaded when first used."""


def __getattr__(name: str) -> Any:
    """Load the figure of a file (PEP 562)."""
    if name not in _DRAWN_THERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    file, function = _DRAWN_THERE[name]
    return getattr(import_module(f"rbfrag.plots.{file}"), function)


def __dir__() -> list[str]:
    """List the figures."""
    return [*__all__]


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
    from rbfrag.fragility.fit.data import fit_data
    from rbfrag.fragility.fit.stored import source_of
    from rbfrag.fragility.methods import method_named
    from rbfrag.plots.fit import plot_fit

    plot_path(out)
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
    measures = {"xp_m_s": source.xp_m_s}
    if source.spectra is not None:
        measures |= zip(map(spectral_name, SPECTRUM_PERIODS_S), source.spectra.T, strict=True)
    fitted = fitted.for_inputs((*fitted.term.inputs, *measures))
    picture = plot_fit(source.table, fitted, out, log=log, measures=measures)
    return replace(picture, warnings=warnings)


def chart(
    out: Out = None,
    *,
    model: str | None = None,
    p2: float | None = None,
    pga_g: float | None = None,
    tm_s: float | None = None,
    displacement_m: float | None = None,
    db: str | PathLike[str] | None = None,
) -> Picture:
    """Draw the design chart: lines of equal probability of toppling against intensity and block.

    Of other kinds than toppling: of failure over intensity and yield acceleration.

    Args:
        out: as for :func:`fit`.
        model: a model, drawn over PGV, PGA or SA; None for the one that answers for PGV and the
            given measures.
        p2: frequency parameter p² of the blocks [1/s²]; None for the middle of the fitted range.
        pga_g: PGA of the motions [g], with PGV as the abscissa; None for one in proportion to PGV.
        tm_s: mean period of the motions [s], of models that use it.
        displacement_m: of a model of slides the displacement that is too far [m]; None likewise.
        db: as for :func:`fit`.
    """
    from rbfrag.fragility.method import TOPPLING_BLOCK
    from rbfrag.plots.chart import plot_chart
    from rbfrag.plots.model_lines import held_measures

    row = None if model is None else stored_row(model, db)
    rotation = None if row is None else FragilityModel.from_row(row).criterion
    measures = {"pga_g": pga_g, "tm_s": tm_s}
    names = [name for name, value in measures.items() if value is not None]
    names += ["pgv_m_s"] if row is None or pga_g is not None else []
    names += [] if row is None else TERMS[row.term].inputs or ["sa(1)"]
    chosen = find_model(model, names, db, rotation_deg=rotation)
    if chosen.method.block.kind != TOPPLING_BLOCK.kind:
        from rbfrag.plots.chart import plot_kind_chart

        size = next((n for n in chosen.method.block.names if not n.startswith("k")), "p2")
        size = "p2" if size == "displacement_m" else size
        inputs = {size: p2, **measures, "displacement_m": displacement_m}
        return plot_kind_chart(
            chosen, out, {name: value for name, value in inputs.items() if value is not None}
        )
    if displacement_m is not None:
        raise InputError(
            f"displacement_m is for sliding: model {chosen.name!r} does not use it",
            fields=("displacement_m",),
        )
    held = held_measures(chosen, p2=p2, **measures)
    return plot_chart(chosen, out, held)


def planes(
    out: Out = None, *, face: str | None = None, base: str | None = None, back: str | None = None
) -> Picture:
    """Draw a block's planes on a stereonet, and mark planes that do not belong to the section.

    Args:
        out: as for :func:`fit`.
        face: plane of the slope's face, as dip/dip direction [deg].
        base: plane of the base.
        back: plane of the back.
    """
    from rbfrag.plots.block import plot_planes
    from rbfrag.solver.block.planes import plane_of

    if face is None or base is None:
        name = "face" if face is None else "base"
        raise InputError(f"{name} is missing: give base and face as 25/102", fields=(name,))
    plane_texts = {"face": face, "base": base} | ({} if back is None else {"back": back})
    return plot_planes({name: plane_of(text, name) for name, text in plane_texts.items()}, out)


VARIED = {"pgv": "pgv_m_s", "pga": "pga_g", "pgd": "pgd_m"}
"""What a curve may run over, beside a spectral acceleration by its name."""


class FragilityCurveKeywords(
    BlockKeywords[float | None], MeasureFields[float | None], RangeFields, total=False
):
    """Keywords of a fragility curve: block, held measures and model."""

    out: Out


def curve(
    p2: float | None = None,
    kr: float | None = None,
    out: Out = None,
    /,
    *,
    over: str | None = None,
    compared: Callable[[str], Mapping[str, Callable[[Any], Any]]] | None = None,
    **question: Unpack[FragilityCurveKeywords],
) -> Picture:
    """Draw the fragility curve of one block against an intensity measure, with its interval.

    Args:
        p2: frequency parameter p² of the block [1/s²], if it is not given by name.
        kr: its toppling yield acceleration coefficient, likewise.
        out: as for :func:`fit`; it may be given by name.
        over: abscissa: pgv, pga, pgd or a spectral acceleration such as sa(1); None for pgv, or
            the first predictor of the model that is not held.
        compared: gives other fragilities to compare with, by name, for the measure that the curve
            runs over.
        question: fields of the block, with ``kind``, the measures that are held, and ``model``,
            ``level``, ``sites`` and ``db``, as :func:`rbfrag.predict` has them.
    """
    from rbfrag.plots.curve import plot_curve

    numbers = [number for number in (p2, kr) if number is not None]
    block, held, answering, drawing = parts_of(
        numbers, question, BLOCKS, INTENSITY, RANGE, ("out",)
    )
    kind = block.pop("kind", None)
    blocks = described(block, kind)
    (group,) = blocks.groups
    varied = None if over is None else over if period_of(over) is not None else VARIED.get(over)
    if over is not None and varied is None:
        raise InputError(f"over = {over}: use {', '.join(VARIED)} or sa(1)")
    if varied is None and (name := answering.get("model")) is not None:
        term = TERMS[stored_row(name, answering.get("db")).term]
        varied = next((n for n in term.inputs or ("sa(1)",) if n not in held), None)
    varied = varied or "pgv_m_s"
    if varied in held:
        raise InputError(f"{varied} is the axis of the curve: omit its value, or give another axis")
    chosen = model_for(answering, (*group.numbers, varied, *held), group.kind)
    comparisons = {} if compared is None else compared(varied)
    picture = plot_curve(
        chosen, group.numbers, drawing.get("out", out), over=varied, fixed=held,
        level=answering.get("level", LEVEL), compared=comparisons, sites=answering.get("sites"),
    )  # fmt: skip
    return replace(picture, warnings=(*blocks.remarks, *unused_measures(chosen, held)))


def critical(
    out: Out = None, *, suite: str | None = None, db: str | PathLike[str] | None = None
) -> Picture:
    """Draw critical k_r/PGA against the frequency ratio ω_m/p, with the lines of single pulses.

    Args:
        out: as for :func:`fit`.
        suite: motions of this suite only.
        db: as for :func:`fit`.
    """
    from rbfrag.plots.critical_strength import plot_critical

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        table = combination_table(connection, suite=suite)
    data = "without vertical motion" + (f", suite {suite}" if suite else "")
    return plot_critical(table, out, data=data)


def sensitivity(out: Out = None, /, **question: Any) -> Picture:
    """Draw P of a block at usual errors of measurement, and its distribution over the draws.

    Args:
        out: as for :func:`fit`.
        question: the keywords of :func:`rbfrag.predict` for a block given by its geometry; the
            distribution is drawn with standard deviations of measured fields.
    """
    from rbfrag.plots.sensitivity import plot_sensitivity
    from rbfrag.question.nominal import MEASURED
    from rbfrag.question.question import predict

    nominal = {name: value for name, value in question.items() if name not in MEASURED}
    answer = (
        predict(**nominal, gmm_sigma=0.0, sensitivity=True)
        if "rjb_km" in nominal
        else predict(**nominal, sensitivity=True)
    )
    if not isinstance(answer, Prediction):
        raise InputError("the sensitivity is that of a single block: give single numbers")
    measured = predict(**question) if MEASURED.intersection(question) else None
    assert measured is None or isinstance(measured, Prediction)
    picture = plot_sensitivity(answer, measured, out)
    return replace(picture, warnings=diagnostics((measured or answer).warnings))


def vertical(
    out: Out = None, *, suite: str | None = None, db: str | PathLike[str] | None = None
) -> Picture:
    """Draw critical strengths with vertical motion against those without it.

    Args:
        out: as for :func:`fit`.
        suite: motions of this suite only.
        db: as for :func:`fit`.
    """
    from rbfrag.plots.critical_strength import plot_vertical, vertical_pairs

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        without = combination_table(connection, suite=suite)
        version = next(iter(without.numerics_version), None)
        with_it = combination_table(
            connection, suite=suite, vertical="with", numerics_version=version
        )
    return plot_vertical(vertical_pairs(without, with_it), out)


def calibration(
    out: Out = None,
    *,
    models: Sequence[str] = (),
    seed: int = 0,
    db: str | PathLike[str] | None = None,
) -> Picture:
    """Draw predicted probabilities against observed fractions, with earthquakes held out.

    Args:
        out: as for :func:`fit`.
        models: names of up to four stored models, each fitted again without each earthquake; none
            for the default.
        seed: seed of the draws of earthquakes.
        db: as for :func:`fit`.
    """
    from rbfrag.fragility.fit.stored import held_out_of
    from rbfrag.plots.fit import plot_calibration

    plot_path(out)
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        names: Sequence[str | None] = models or [None]
        answers = [held_out_of(connection, name, seed=seed) for name in names]
    bins = {answer.name: answer.bins for answer in answers}
    scores = {answer.name: answer.scores for answer in answers}
    return plot_calibration(bins, out, scores=scores, data=answers[0].outcomes)


def response(
    motion: MotionLike,
    out: Out = None,
    *,
    p2: float,
    kr: float,
    vertical: MotionLike | None = None,
    polarity: Polarity = "forward",
) -> Picture:
    """Draw acceleration against k_r(θ), and the ratio of θ to the critical angle, over time.

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

    plot_path(out)
    ground = as_motion(motion)
    upward = None if vertical is None else as_motion(vertical, "vertical")
    shaken = respond(ground, p2=p2, kr=kr, vertical=upward, polarity=polarity, history=True)
    reverse = polarity == "reverse"
    return plot_response(shaken, out, p2=p2, kr=kr, reverse=reverse, title=ground.label)


# A rock mass and a map are answers of packages that this one does not import.
def rockmass(answer: Any, out: Out = None) -> Picture:
    """Draw the cumulative counts of blocks against PGA by mode; with a motion those that fail.

    Args:
        answer: of :func:`rbfrag.rockmass`.
        out: as for :func:`fit`.
    """
    from rbfrag.plots.rockmass import plot_failures, plot_rockmass

    if answer.outcomes is None:
        return plot_rockmass(answer.blocks, out)
    return plot_failures(answer.outcomes, out, level=answer.level)


def shakemap(answer: Any, out: Out = None) -> Picture:
    """Draw the map of probabilities.

    Args:
        answer: of :func:`rbfrag.shakemap`.
        out: as for :func:`fit`.
    """
    from rbfrag.plots.shakemap import plot_shakemap

    lon, lat, probability = (answer.columns[name] for name in ("lon", "lat", "probability"))
    return plot_shakemap(
        lon, lat, probability, out, title=answer.title, epicentre=answer.epicentre,
        shape=answer.shape,
    )  # fmt: skip
