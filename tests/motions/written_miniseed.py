"""Made-up miniSEED records."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pymseed import DataEncoding, MS3TraceList

from tests.synthetic import shaking

COUNTS: NDArray[np.int32] = np.rint(2e5 * shaking(7, 1500, dt_s=0.01) - 11469.0).astype(np.int32)

TYPES = {"FLOAT32": ("f", np.float32), "FLOAT64": ("d", np.float64)}


def miniseed(
    counts: NDArray[np.int32],
    *,
    channel: str = "HNE",
    station: str = "79435",
    start: str = "2021-12-20T20:13:10.75Z",
    rate_hz: float = 100.0,
    version: int = 2,
    encoding: str = "STEIM2",
    record_bytes: int = 4096,
) -> bytes:
    letter, kind = TYPES.get(encoding, ("i", np.int32))
    traces = MS3TraceList()
    traces.add_data(
        sourceid=f"FDSN:CE_{station}_10_{'_'.join(channel)}",
        data_samples=counts.astype(kind),
        sample_type=letter,
        sample_rate=rate_hz,
        starttime_str=start,
    )
    return b"".join(
        bytes(record)
        for record in traces.generate(
            format_version=version,
            max_record_length=record_bytes,
            encoding=getattr(DataEncoding, encoding),
        )
    )
