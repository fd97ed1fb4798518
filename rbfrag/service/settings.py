"""What a service is told when it is started."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Settings:
    """Where a service reads, whom it answers and how much it takes on.

    Args:
        db: database of the models: a path or an SQLAlchemy URL; None as for
            :func:`rbfrag.predict`. It is only read.
        token: the bearer token that a request must bring; None where none is asked for.
        allowed_origins: origins of web pages elsewhere whose scripts may read answers.
        body_limit_bytes: longest body of a request that is taken.
        row_limit: most blocks of one request.
        time_limit_s: longest time [s] that work on one request may take.
    """

    db: str | None = None
    token: str | None = field(default=None, repr=False)
    allowed_origins: tuple[str, ...] = ()
    body_limit_bytes: int = 16 * 1024**2
    row_limit: int = 100_000
    time_limit_s: float = 60.0
