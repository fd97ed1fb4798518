"""How often per year an earthquake fails any of several blocks of one site."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rbfrag.hazards.annual_rate import probability_in
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.standing_blocks import (
    COARSE_STEP,
    COPULA,
    DEPENDENT,
    INDEPENDENT,
    ModelBlocks,
    StandingBlocks,
)

NO_LAW = "bounds"
"""Joint law where only bounds are known."""


MOST_JOINT = 100
"""Most blocks that the dependence is taken for; its cost grows as the square (100 take 10 s)."""

_AT_ONCE = 512


@dataclass(frozen=True, eq=False)
class JointRate:
    """Earthquakes with at least one failure among several blocks of one site.

    Args:
        annual_rate_any: annual rate of such earthquakes [1/a]; None where only its bounds
            are known.
        annual_rate_any_ci: both ends of its interval from the parameters of the fragility.
        probability_any: probability of at least one such earthquake in the period.
        joint_law: how the blocks of one earthquake fail together.
        bounds: the rate and the probability under full dependence, where the block of the greatest
            P fails first, and if blocks fail independently at each level of the shaking.
        warnings: what these numbers take for granted.
    """

    annual_rate_any: float | None
    annual_rate_any_ci: tuple[float, float] | None
    probability_any: float | None
    joint_law: str
    bounds: Mapping[str, Mapping[str, float]]
    warnings: tuple[str, ...]

    @classmethod
    def of(cls, blocks: ModelBlocks, curve: HazardCurve, years: float) -> JointRate:
        """Return the integral of P(any fails | x) over -dλ, by the model's stored dependence.

        Earthquakes are the Poisson process, not failures: the probability in T years is
        1 - exp(-λ_any T).

        Args:
            blocks: two or more blocks whose parameters are known.
            curve: hazard curve of their site.
            years: period T [a].
        """
        count = blocks.p2.shape[1]
        standing = (
            StandingBlocks.of_blocks(blocks, [curve], COARSE_STEP)
            if count <= MOST_JOINT
            else StandingBlocks.of_parts(blocks.parts(_AT_ONCE), [curve])
        )
        any_rate = standing.rate(curve)
        rates = dict(zip(standing.laws, any_rate.annual_rate[:, 0], strict=True))
        bounds = {
            name.replace(" ", "_"): {
                "annual_rate_any": float(rates[name][0]),
                "probability_any": float(probability_in(years, rates[name][0])),
            }
            for name in (DEPENDENT, INDEPENDENT)
        }
        ends = [f"annual_rate_any: {text}" for text in any_rate.warnings]
        here = f"all {count} blocks are taken as those of one site"
        if COPULA not in rates:
            why = (
                "what the blocks share in one earthquake is not known to this model"
                if blocks.model.dependence is None
                else f"what more than {MOST_JOINT} blocks share in one earthquake is not computed"
            )
            text = f"{here}; {why}: bounds has annual_rate_any under full dependence and if they "
            warnings = (f"{text}fail independently", *ends)
            return cls(None, None, None, NO_LAW, bounds, warnings)
        rate, low, high = rates[COPULA]
        return cls(
            annual_rate_any=float(rate),
            annual_rate_any_ci=(float(low), float(high)),
            probability_any=float(probability_in(years, rate)),
            joint_law=COPULA,
            bounds=bounds,
            warnings=(f"annual_rate_any: {here}, of unknown azimuth", *ends),
        )

    def as_dict(self) -> dict[str, object]:
        """Return the numbers under the keys of the JSON contract."""
        ends = self.annual_rate_any_ci
        return {
            "annual_rate_any": self.annual_rate_any,
            "annual_rate_any_ci": None if ends is None else list(ends),
            "probability_any": self.probability_any,
            "joint_law": self.joint_law,
            "bounds": {name: dict(values) for name, values in self.bounds.items()},
        }
