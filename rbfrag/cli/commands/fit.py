"""`rbfrag fit`: fit a fragility model to the stored simulations."""

from __future__ import annotations

from rbfrag.cli import options
from rbfrag.cli.command import option
from rbfrag.cli.output import print_result
from rbfrag.fragility.measures import TERMS
from rbfrag.vocabulary.quantities import word_of

EXAMPLE = "Example:  rbfrag fit --term pgv"


TERM_LIST = "; ".join(
    f"{term.name} ({', '.join(map(word_of, term.inputs or ('sa_g',)))})" for term in TERMS.values()
)
"""The terms with the measures that each uses."""


def fit(
    *,
    term: str = option(
        f"Set of intensity measures: {TERM_LIST}",
        ...,
        show_default=False,
    ),
    suite: options.Suite = None,
    where: options.Where = None,
    include_structures: options.IncludeStructures = False,
    vertical: str = option(
        "Combinations without or with vertical motion, or both: without, with, both", "without"
    ),
    doubtful_pgd: bool = option(
        "For pgd_tm, use records flagged final_velocity or final_displacement, which are "
        "excluded by default",
        False,
    ),
    kind: str = option(
        "Kind of failure: toppling; slumping and confined_toppling, with pgv_pga and "
        "pgv_pga_m; sliding, with these, pgv and pgv_pga_ia; rocking (free-standing), with "
        "pga, sa and pgv; or another kind of a stored campaign",
        "toppling",
    ),
    rotation: float | None = option(
        "Rotation limit of slumping [deg] [default: failure past recovery]",
        show_default=False,
    ),
    method: str | None = option(
        "Method for blocks with p2 and kr; of critical values: wls (weighted least squares, "
        "as in the dissertation), lognormal (with censored motions); of outcomes: toppling, "
        "logistic; with xp: record [default: toppling or record where they use the measures, "
        "else logistic]",
        show_default=False,
    ),
    free_m: bool = option(
        "Estimate the exponent M of y = k_r g/p^M instead of M = 1 (lognormal, logistic)", False
    ),
    name: str | None = option("Name of the model [default: METHOD-TERM]"),
    bootstrap: bool = option(
        "Standard errors by a bootstrap of whole earthquakes, too [default: only with fewer than "
        "10 earthquakes]",
        False,
    ),
    dependence: bool = option(
        "Dependence model of the blocks of one earthquake [default: estimated and stored by the "
        "first joint question of the model]",
        False,
    ),
    seed: int = option("Seed of the bootstrap and of the dependence model", 0),
    replace: bool = option("Replace a stored model of the same name", False),
    db: options.Db = None,
    verbose: options.Verbose = False,
    json: options.Json = False,
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
        suite=suite,
        where=where,
        include_structures=include_structures,
        vertical=vertical,  # type: ignore[arg-type]
        name=name,
        seed=seed,
        bootstrap=bootstrap,
        dependence=dependence,
        estimate_m=free_m,
        doubtful_pgd=doubtful_pgd,
        rotation_deg=rotation,
        replace=replace,
    )
    print_result(report, json=json, verbose=verbose, fields=())
