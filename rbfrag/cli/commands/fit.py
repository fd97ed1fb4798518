"""`rbfrag fit`: a fragility model from the stored critical values."""

from __future__ import annotations

from dataclasses import dataclass

from rbfrag.cli.output import print_result
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.stack import option, stacked

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
    print_result(report, json=printing.json, verbose=printing.verbose, fields=())
