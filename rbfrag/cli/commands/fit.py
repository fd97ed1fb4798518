"""`rbfrag fit`: a fragility model from the stored critical values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rbfrag.cli.output import (
    cell,
    print_json,
    print_pairs,
    print_sentences,
    print_table,
    print_warnings,
)
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.stack import option, stacked
from rbfrag.fragility import describe
from rbfrag.results.numbers import rounded

if TYPE_CHECKING:
    from rbfrag.fragility.fit.report import FitReport

EXAMPLE = "Example:  rbfrag fit --term pgv"


@dataclass(frozen=True, kw_only=True)
class Data:
    """What is fitted."""

    suite: options.Suite = None
    include_structures: bool = option(options.INCLUDE_STRUCTURES, False)
    vertical: str = option("Combinations without vertical motion, with it, or both.", "without")
    doubtful_pgd: bool = option(
        "Let pgd_tm read the PGD of records flagged final_velocity or "
        "final_displacement, which it leaves out otherwise.",
        False,
    )


@dataclass(frozen=True, kw_only=True)
class ModelOptions:
    """How the model is stored, and what its bootstrap draws."""

    name: str | None = option("Name of the model. Default: method-term.")
    seed: int = option("Seed of the bootstrap by earthquake.", 0)
    replace: bool = option("Replace a stored model of the same name.", False)


@stacked
def fit(
    *,
    term: str = option(
        "Intensity term [m/s]: pgv; pga_tm = PGA g Tm/(2 pi); pgd_tm = 2 pi PGD/Tm; "
        "pgv_pga, pgv_pga_tm and pgv_pga_sa10_sa30: PGV with PGA (and Tm, or spectral "
        "accelerations at 1 and 3 s); xp: the toppling spectrum X(p); pgv_kr: PGV with the block's "
        "strength; pga; sa10; pga_sa10, pga_sa10_sa30 and pga_sa03_sa10_sa30: PGA with these; "
        "pga_m, pgv_pga_m and pgv_pga_ia: with magnitude or Arias intensity.",
        ...,
        show_default=False,
    ),
    data: Data,
    kind: str = option(
        "What the blocks do: toppling; slumping and confined_toppling, on pgv_pga and pgv_pga_m "
        "(with magnitude); sliding, on these, pgv and pgv_pga_ia; rocking (free-standing), on pgv, "
        "pgv_pga, sa10, pga_sa10, pga_m and those of sa10_sa30; or another kind that campaigns "
        "store.",
        "toppling",
    ),
    rotation: float | None = option(
        "Slumping: rotation that counts as failure [deg]. Default: failure past recovery.",
        show_default=False,
    ),
    method: str | None = option(
        "Blocks known by p² and kr. Of critical values: wls (weighted least squares, the "
        "dissertation's), lognormal (with censored motions). Of outcomes: logistic, bounded; on "
        "xp: record. Default: the one that predicts earthquakes left out best with this term.",
        show_default=False,
    ),
    free_m: bool = option(
        "Estimate the exponent M of y = k_r g/p^M instead of M = 1 (lognormal, logistic).", False
    ),
    stored: ModelOptions,
    db: options.Db = None,
    printing: options.Printing,
) -> None:
    """Fit a fragility model to stored critical values or outcomes.

    The model is stored in the database; without one the built-in data are fitted and nothing is
    stored. The one of the best score on earthquakes left out is the default of its
    kind, unless  rbfrag models default NAME  has chosen another.
    """
    from rbfrag.fragility.fit.stored import fit as run

    report = run(
        db,
        kind=kind,
        term=term,
        method=method,
        suite=data.suite,
        include_structures=data.include_structures,
        vertical=data.vertical,  # type: ignore[arg-type]
        name=stored.name,
        seed=stored.seed,
        estimate_m=free_m,
        doubtful_pgd=data.doubtful_pgd,
        rotation_deg=rotation,
        replace=stored.replace,
    )
    print_report(report, printing)


def print_report(report: FitReport, printing: options.Printing) -> None:
    """Print the report of a fitted model."""
    if printing.json:
        print_json(report.as_dict())
        return
    print_sentences(fit_in_words(report))
    if printing.verbose:
        _print_all(report)
    else:
        errors = {name: rounded(value) for name, value in report.standard_errors.items()}
        rows = [
            (name, rounded(value), errors.get(name)) for name, value in report.coefficients.items()
        ]
        print_table(("parameter", "value", "standard error"), rows)
    print_warnings(report.warnings)


def fit_in_words(report: FitReport) -> Iterator[str]:
    """Yield what a model says, and how it does on earthquakes that it has not seen."""
    default = f", the default of {report.kind}" if report.model.row.is_default else ""
    yield (
        f"Model {report.name} ({report.method} on {report.term}{default}) says the "
        f"{report.model.meaning}."
    )
    if why := report.details.get("why_method"):
        yield f"No method was named: {why}."
    data = f"It is {describe.fitted_data(report.model.row.diagnostics)}"
    score = report.scores.get("log_loss_held_out")
    around = (dict[str, Any](report.details).get("score_intervals") or {}).get("log_loss_held_out")
    if score is None:
        yield f"{data}."
        return
    ends = f" ({rounded(around[0])} to {rounded(around[1])} by earthquakes)" if around else ""
    real = report.scores.get("log_loss_held_out_kr05")
    of_real = "" if real is None else f", {rounded(real)} of blocks of k_r >= 0.05"
    yield (
        f"{data}; on those left out its log loss is {rounded(score)}{ends}{of_real}, the less the "
        "better."
    )


def _print_all(report: FitReport) -> None:
    details: dict[str, Any] = dict(report.details)
    kinds = details.get("standard_error_kinds") or {}
    bootstrap = (details.get("bootstrap") or {}).get("standard_errors", {})
    naive = details.get("naive_standard_errors") or {}
    print_table(
        ("parameter", "value", "standard error", "by bootstrap", "taken as independent"),
        [
            (name, value, report.standard_errors.get(name), bootstrap.get(name), naive.get(name))
            for name, value in report.coefficients.items()
        ],
    )
    for kind in dict.fromkeys(kinds.values()):
        print(f"standard error: {kind}")
    print()
    counts: dict[str, object] = {
        "combinations": details.get("n_total"),
        "critical value found": report.n,
        "below the search limit": report.n_censored,
        "outside the model": details.get("n_outside_model"),
        "earthquakes": report.events,
    }
    if details.get("rotation_deg") is not None:
        counts["rotation that counts as failure [deg]"] = details["rotation_deg"]
    if "n_outcomes" in details:
        counts["outcomes fitted (toppled)"] = f"{details['n_outcomes']} ({details['n_toppled']})"
        counts["outcomes certain by mechanics"] = details["n_bounded"]
    if "sensitive_share" in details:
        counts["sensitive outcomes, share"] = details["sensitive_share"]
    print_pairs(counts)
    law = details.get("power_law")
    if law:
        print_pairs({f"power law {name}": value for name, value in law.items()})
    correlations = details.get("log_correlations") or {}
    if correlations:
        ranked = ", ".join(f"{name} {cell(value)}" for name, value in correlations.items())
        print(f"correlation of ln y with ln x: {ranked}")
    scatter = details.get("scatter_ln_y")
    if scatter:
        parts = ", ".join(
            f"{name.replace('_', ' ')} {value:.3f}" for name, value in scatter.items()
        )
        print(f"scatter of ln y about the median: {parts}")
    print_dependence(report.model.row.dependence)
    intervals = details.get("score_intervals") or {}
    print(f"scores, judged on {details.get('judged_on', 'critical values')}:")
    for name, value in report.scores.items():
        if not name.endswith(("_in_sample", "_held_out")):
            continue  # another name of one that is printed
        around = intervals.get(name)
        ends = f"  ({cell(around[0])} to {cell(around[1])} by earthquakes)" if around else ""
        print(f"  {name}: {cell(value)}{ends}")


def print_dependence(dependence: Mapping[str, Any] | None) -> None:
    """Print what the blocks of one earthquake share."""
    if dependence is None:
        return
    errors = dependence["errors"]
    print_table(
        ("shared by the blocks of one earthquake", "value", "standard error"),
        [(name, dependence[name], error) for name, error in errors.items()],
    )
    print()
