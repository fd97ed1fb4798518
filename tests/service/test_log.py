"""Every line of the service's log is JSON, warnings of libraries included."""

from __future__ import annotations

import json
import subprocess
import sys

PROGRAM = """
import warnings
from rbfrag.service.guard import log_as_json

log_as_json()
warnings.warn("overflow encountered", RuntimeWarning)
"""


def test_a_warning_is_a_line_of_json() -> None:
    process = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True)
    (line,) = process.stderr.splitlines()
    assert json.loads(line)["level"] == "warning"
    assert "overflow encountered" in json.loads(line)["message"]
