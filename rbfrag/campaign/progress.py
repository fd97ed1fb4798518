"""How far a campaign is."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CampaignProgress:
    """How far a campaign is, in combinations."""

    done: int
    total: int
    resumed: int
    seconds: float

    @property
    def rate_per_s(self) -> float:
        """Combinations finished per second by this run."""
        made = self.done - self.resumed
        return made / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def seconds_left(self) -> float | None:
        """Estimated time left [s]; None before anything is finished."""
        return (self.total - self.done) / self.rate_per_s if self.rate_per_s else None
