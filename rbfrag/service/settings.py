"""Settings of a service, and its bearer token."""

from __future__ import annotations

import ipaddress
import os
import re
from dataclasses import dataclass, field, replace
from pathlib import Path

from rbfrag.errors import InputError


@dataclass(frozen=True)
class ServiceSettings:
    """Database, access and limits of a service.

    Its fields are the options of `rbfrag serve`, which say what each means, and:

    Args:
        bodies_at_once: most requests with a body that a process works on; others wait.
        early: start the processes for long work with the service, not when first needed.
        token: the bearer token that a request must bring; None where none is asked for.
    """

    db: str | None = None
    host: str = "127.0.0.1"
    port: int = 8000
    workers: int = 1
    token_file: str | None = None
    allow_origin: tuple[str, ...] = ()
    allow_host: tuple[str, ...] = ()
    body_limit_mb: float = 16.0
    body_time: float = 30.0
    row_limit: int = 100_000
    time_limit: float = 60.0
    jobs: int = 2
    bodies_at_once: int = 16
    early: bool = False
    token: str | None = field(default=None, repr=False)

    @property
    def body_limit_bytes(self) -> int:
        """Maximum length of a request body."""
        return int(1e6 * self.body_limit_mb)

    def checked(self) -> ServiceSettings:
        """Return the settings of a service to start, with its token and host names.

        Raises:
            InputError: an option that cannot be, or other computers could ask without a token.
        """
        token = read_token(self.token_file)
        if token is None and not is_loopback(self.host):
            raise InputError(
                f"host {self.host}: a token is required for addresses other than loopback: set "
                f"the environment variable {VARIABLE}, or use token_file",
                fields=("host", "token_file"),
            )
        if self.workers < 1:
            raise _rejected("workers", self.workers, "it must be 1 or more")
        if not 0 <= self.port <= 65535:
            raise _rejected("port", self.port, "give a number from 0 to 65535")
        for name in ("body_limit_mb", "body_time", "row_limit", "time_limit", "jobs"):
            value = getattr(self, name)
            if not 0.0 < value < float("inf"):
                raise _rejected(name, f"{value:g}", "give a number above zero")
        hosts = tuple(self.allow_host)
        if token is None:
            # else a web page could ask by a name of its own that leads to this computer
            hosts = ("localhost", "127.0.0.1", "[::1]", self.host, *hosts)
        return replace(self, token=token, allow_host=hosts, early=True)


def _rejected(field: str, value: object, why: str) -> InputError:
    return InputError(f"{field} {value}: {why}", fields=(field,))


VARIABLE = "RBFRAG_TOKEN"
"""Environment variable with the token."""

_LONGEST_TOKEN_FILE = 1024
"""Characters of it that are read."""

_TOKEN = re.compile(r"[A-Za-z0-9._~+/=-]{16,512}")


def read_token(file: str | None) -> str | None:
    """Return the token of a service, or None if none is set.

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
            with Path(file).open(encoding="ascii") as stream:
                token = stream.read(_LONGEST_TOKEN_FILE).strip()
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is not ASCII text"
            raise _rejected("token_file", file, f"cannot be read: {reason}") from None
    if not _TOKEN.fullmatch(token):
        raise InputError(
            f"the token in {source} must have 16 to 512 letters, digits or characters ._~+/=-: "
            "create one with  python -c 'import secrets; print(secrets.token_urlsafe(32))'"
        )
    return token


def is_loopback(host: str) -> bool:
    """Return whether an address is reachable from this computer only."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
