"""`rbfrag predict --kind`: the probability that a block slumps, or slides a stated distance."""

from __future__ import annotations

from typing import Any

from rbfrag.cli.output import print_json, print_pairs, print_warnings
from rbfrag.errors import InputError

OPTIONS_OF = {
    "toppling": {
        "--p2", "--kr", "--block", "--tm", "--pgd", "--motion", "--polarity", "--batch", "--out",
    },
    "sliding": {"--ky", "--beta", "--block", "--displacement"},
    "slumping": {"--ks", "--ps2", "--block", "--rotation"},
}  # fmt: skip
"""Which options go with which kind; those not named here go with every kind."""


def refuse_options_of_other_kinds(kind: str, given: dict[str, bool]) -> None:
    """Refuse an unknown kind, and options that do not go with a known one.

    Args:
        kind: the option --kind.
        given: whether each option was given, by its name.
    """
    if kind not in OPTIONS_OF:
        raise InputError(f"--kind {kind}: there are models of {', '.join(OPTIONS_OF)}")
    for option, is_given in given.items():
        if is_given and option not in OPTIONS_OF[kind]:
            kinds = " and ".join(name for name, its in OPTIONS_OF.items() if option in its)
            raise InputError(f"{option} goes with --kind {kinds}, not with {kind}")


def predict_kind(
    kind: str,
    *,
    block: str | None,
    ky: float | None,
    beta_deg: float | None,
    displacement_m: float | None,
    ks: float | None,
    ps2: float | None,
    rotation_deg: float | None,
    pgv_m_s: float | None,
    pga_g: float | None,
    model: str | None,
    level: float,
    db: str | None,
    json: bool,
) -> None:
    """Print the answer of a sliding or slumping model."""
    from rbfrag.fragility.kind_prediction import predict_sliding, predict_slumping

    if pgv_m_s is None:
        raise InputError(
            f"--pgv is missing: models of {kind} read PGV, better with --pga beside it"
        )
    motion: dict[str, Any] = {"pgv_m_s": pgv_m_s, "pga_g": pga_g}
    common: dict[str, Any] = {"model": model, "level": level, "db": db}
    remarks: tuple[str, ...] = ()
    if kind == "sliding":
        if displacement_m is None:
            raise InputError("--displacement is missing: how far is too far for the block [m]?")
        if block is not None:
            _alone("--block", {"--ky": ky, "--beta": beta_deg})
            ky, beta_deg, remarks = _sliding_block(block)
        if ky is None:
            raise InputError("--ky is missing: a block that slides is given by --ky, or --block")
        answer = predict_sliding(ky, displacement_m, beta_deg=beta_deg or 0.0, **motion, **common)
    else:
        leaves_g = None
        if block is not None:
            _alone("--block", {"--ks": ks, "--ps2": ps2})
            ks, ps2, leaves_g, remarks = _slumping_block(block)
        if ks is None or ps2 is None:
            missing = "--ks" if ks is None else "--ps2"
            raise InputError(
                f"{missing} is missing: a block that slumps is given by --ks and --ps2, or by "
                "--block FILE"
            )
        answer = predict_slumping(
            ks, ps2, rotation_deg=rotation_deg, leaves_g=leaves_g, **motion, **common
        )
    document = answer.as_dict()
    document["warnings"] = warnings = [*remarks, *answer.warnings]
    if json:
        print_json(document)
        return
    document.pop("warnings")
    print_pairs({name: value for name, value in document.items() if value is not None})
    print_warnings(warnings)


def _alone(option: str, others: dict[str, float | None]) -> None:
    for other, value in others.items():
        if value is not None:
            raise InputError(f"{other} does not go with {option}: the file describes the block")


def _read(path: str) -> tuple[Any, dict[str, Any]]:
    from rbfrag.solver.block.file import read_block

    file = read_block(path)
    conditions = dict(file.conditions)
    for name in ("beta_deg", "phi_deg"):
        if name not in conditions:
            raise InputError(f"{path}: {name} is missing: the mode of a block depends on it")
    if conditions.pop("kv", 0.0) != 0.0:
        raise InputError(
            f"{path}: kv does not belong in a block that is to be shaken: the vertical "
            "acceleration comes with the motion; leave the line out"
        )
    return file.block, conditions


def _sliding_block(path: str) -> tuple[float, float, tuple[str, ...]]:
    from rbfrag.solver.stability.single import stability

    block, conditions = _read(path)
    if conditions.get("cohesion_pa"):
        raise InputError(f"{path}: cohesion_pa does not go with sliding: the first slip breaks it")
    found = stability(block, **conditions)
    k = found.yield_acceleration
    if found.mode != "slide":
        raise InputError(f"{path}: the block does not slide, its mode is {_words(found.mode)}")
    if found.state != "stable" or k <= 0.0:
        raise InputError(
            f"{path}: the block is {found.state} in sliding (k_y = {k:.4g} g): no earthquake "
            "decides about it"
        )
    return k, found.beta_deg, found.warnings


def _slumping_block(path: str) -> tuple[float, float, float, tuple[str, ...]]:
    from rbfrag.solver.mechanism import shaken_mechanism

    block, conditions = _read(path)
    for name, nothing in (("cohesion_pa", 0.0), ("back_fracture", True)):
        if conditions.pop(name, nothing) != nothing:
            raise InputError(f"{path}: {name} does not go with slumping: leave it out")
    conditions.pop("density_kg_m3", None)
    try:
        found = shaken_mechanism(block, kind="slumping", **conditions)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return found.yield_g, found.p2, found.leaves_g, found.remarks


def _words(mode: str) -> str:
    return mode.replace("_", " ")
