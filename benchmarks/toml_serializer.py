"""How schemathesis sends TOML: as the text that it made up."""

from __future__ import annotations

from typing import Any

import schemathesis


@schemathesis.serializer("application/toml")
def as_text(context: Any, value: Any) -> bytes:  # noqa: ARG001
    """Return the body of a request."""
    return str(value).encode("utf-8", "surrogatepass")
