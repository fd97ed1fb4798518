"""`rbfrag fit`: fit a fragility model to the stored simulations."""

from __future__ import annotations

from dataclasses import dataclass

from rbfrag.cli.output import print_result
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.option_groups import option, stacked
from rbfrag.fragility.measures import TERMS, Term
from rbfrag.vocabulary.quantities import word_of

EXAMPLE = "Example:  rbfrag fit --term pgv"


def _described(term: Term) -> str:
    """Return the name of a term, with its formula where it has one of several measures."""
    return f"{term.name} ({', '.join(map(word_of, term.inputs))})"


@dataclass(frozen=True, kw_only=True)
class Data:
    """Data selection of the fit."""

    suite: options.Suite = None
    include_structures: bool = option(options.INCLUDE_STRUCTURES, False)
    vertical: str = option(
        "Combinations without or with vertical motion, or both: without, with, both", "without"
    )
    doubtful_pgd: bool = option(
        "For pgd_tm, use records flagged final_velocity or final_displacement, which are "
        "excluded by default",
        False,
    )


@dataclass(frozen=True, kw_only=True)
class ModelOptions:
    """Name and default of the stored model, and the seed of its bootstrap."""

    name: str | None = option("Name of the model [default: METHOD-TERM]")
    seed: int = option("Seed of the bootstrap by earthquake", 0)
    replace: bool = option("Replace a stored model of the same name", False)


@stacked
def fit(
    *,
    term: str = option(
        f"Set of intensity measures: {'; '.join(map(_described, TERMS.values()))}",
        ...,
        show_default=False,
    ),
    data: Data,
    kind: str = option(
        "Kind of failure: toppling; slumping and confined_toppling, with pgv_pga and "
        "pgv_pga_m; sliding, with these, pgv and pgv_pga_ia; rocking (free-standing), with "
        "pgv, pgv_pga, sa10, pga_sa10, pga_m, pgv_pga_sa10_sa30 and pga_sa10_sa30; or "
        "another kind of a stored campaign",
        "toppling",
    ),
    rotation: float | None = option(
        "Rotation limit of slumping [deg] [default: failure past recovery]",
        show_default=False,
    ),
    method: str | None = option(
        "Method for blocks with p2 and kr; of critical values: wls (weighted least squares, "
        "as in the dissertation), lognormal (with censored motions); of outcomes: logistic, "
        "bounded; with xp: record [default: best score in leave-one-earthquake-out "
        "cross-validation]",
        show_default=False,
    ),
    free_m: bool = option(
        "Estimate the exponent M of y = k_r g/p^M instead of M = 1 (lognormal, logistic)", False
    ),
    stored: ModelOptions,
    db: options.Db = None,
    printing: options.Printing,
) -> None:
    """Fit a fragility model to stored critical values or outcomes.

    The model is stored in the database. Without a database the built-in data set is fitted and
    nothing is stored. The default model of a kind is that with the best score in
    leave-one-earthquake-out cross-validation, unless it is set by rbfrag models default NAME.
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
    print_result(report, json=printing.json, verbose=printing.verbose, fields=())
