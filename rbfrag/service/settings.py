"""Settings of a service, and its bearer token."""

from __future__ import annotations

import ipaddress
import os
import re
from dataclasses import dataclass, field
from pathlib import Path

from rbfrag.errors import InputError


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


VARIABLE = "RBFRAG_TOKEN"
"""Environment variable with the token."""

_TOKEN = re.compile(r"[A-Za-z0-9._~+/=-]{16,512}")


def read_token(file: str | None) -> str | None:
    """Return the token of a service, or None where none is stated.

    Args:
        file: a file with nothing but the token; None for the environment variable.
    """
    if file is None:
        token, source = os.environ.get(VARIABLE), VARIABLE
        if not token:
            return None
    else:
        source = file
        try:
            token = Path(file).read_text(encoding="ascii").strip()
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is not ASCII text"
            raise InputError(f"--token-file {file}: cannot be read: {reason}") from None
    if not _TOKEN.fullmatch(token):
        raise InputError(
            f"the token in {source} is not 16 to 512 letters, digits or any of ._~+/=-: make one "
            "with  python -c 'import secrets; print(secrets.token_urlsafe(32))'"
        )
    return token


def is_loopback(host: str) -> bool:
    """Return whether only programs of this computer can ask at an address."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def check_reach(host: str, token: str | None) -> None:
    """Refuse to answer whoever can reach this computer."""
    if token is None and not is_loopback(host):
        raise InputError(
            f"--host {host}: other computers can ask there, so the service needs a token: put one "
            f"into the environment variable {VARIABLE}, or into a file named by --token-file"
        )
