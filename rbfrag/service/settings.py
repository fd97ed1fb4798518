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
        allowed_hosts: names the service may be asked by; none for any.
        body_limit_bytes: longest body of a request that is taken.
        body_time_s: longest time [s] that a body may take to come.
        row_limit: most blocks of one request.
        time_limit_s: longest time [s] that an answer may take once its body is there.
        bodies_at_once: most requests with a body that a process works on; others wait.
        jobs: number of processes that do long work beside each that answers.
        early: start them with the service, and not when they are first needed.
    """

    db: str | None = None
    token: str | None = field(default=None, repr=False)
    allowed_origins: tuple[str, ...] = ()
    allowed_hosts: tuple[str, ...] = ()
    body_limit_bytes: int = 16 * 1024**2
    body_time_s: float = 30.0
    row_limit: int = 100_000
    time_limit_s: float = 60.0
    bodies_at_once: int = 16
    jobs: int = 1
    early: bool = False
