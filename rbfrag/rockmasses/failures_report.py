"""Failures of the blocks of a rock mass as scripts read them: a dictionary of plain values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rbfrag.rockmasses.failures import ModeFailures, ScaleFailures, Share
from rbfrag.rockmasses.response import ShakenMass
from rbfrag.solver.stability.modes import MODES


def failures_as_dict(
    shaken: ShakenMass, found: Sequence[ScaleFailures], level: float
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract.

    Args:
        shaken: the fates of the blocks.
        found: their counts.
        level: confidence level of the intervals.
    """
    shaking = shaken.shaking
    return {
        "motion": shaking.motion.label,
        "vertical": None if shaking.vertical is None else shaking.vertical.label,
        "polarity": shaking.polarity,
        "displacement_limit_m": shaken.limits.displacement_m,
        "rotation_limit_deg": shaken.limits.rotation_deg,
        "level": level,
        "runs": shaken.runs,
        "scales": [
            {
                "scale": each.scale,
                "pga_g": each.pga_g,
                "pgv_m_s": each.scale * shaking.motion.pgv_m_s,
                "modes": {mode: _counts(counted) for mode, counted in each.modes.items()},
                "all": _counts(each.total),
            }
            for each in found
        ],
    }


def failure_warnings(shaken: ShakenMass) -> list[str]:
    """Return sentences about the motion, and about blocks with how many they are about.

    Args:
        shaken: the fates of the blocks.
    """
    made = shaken.made
    by_mode = {
        mode: int((made.is_block & (made.stability.mode_code == code)).sum())
        for code, mode in enumerate(MODES)
    }
    return [
        *shaken.warnings,
        *(
            f"{count} of {by_mode[mode]} blocks of mode {mode.replace('_', ' ')}: {text}"
            for (mode, text), count in shaken.about.items()
        ),
    ]


def _counts(counted: ModeFailures) -> dict[str, Any]:
    return {
        "count": counted.count,
        **counted.fates,
        "moved": counted.moved,
        "open": counted.open,
        "fails_of_all": _share(counted.of_all),
        "fails_of_mode": None if counted.of_mode is None else _share(counted.of_mode),
        "open_of_all": counted.open_of_all,
        "displacement_m": None if counted.displacement_m is None else dict(counted.displacement_m),
    }


def _share(share: Share) -> dict[str, float]:
    return {"share": share.value, "ci_low": share.low, "ci_high": share.high}
