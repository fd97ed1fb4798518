"""The bearer token of a service: where it comes from, and when there must be one."""

from __future__ import annotations

import ipaddress
import os
import re
from pathlib import Path

from rbfrag.errors import InputError

VARIABLE = "RBFRAG_TOKEN"
"""Environment variable with the token."""

_TOKEN = re.compile(r"[A-Za-z0-9._~+/=-]{16,512}")


def read_token(file: str | None) -> str | None:
    """Return the token of a service, or None where none is stated.

    Args:
        file: a file with nothing but the token; None for the environment variable.

    Raises:
        InputError: the file cannot be read, or the token is none to rely on.
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
    """Refuse to answer whoever can reach this computer.

    Raises:
        InputError: the address is not loopback, and there is no token.
    """
    if token is None and not is_loopback(host):
        raise InputError(
            f"--host {host}: other computers can ask there, so the service needs a token: put one "
            f"into the environment variable {VARIABLE}, or into a file named by --token-file"
        )
