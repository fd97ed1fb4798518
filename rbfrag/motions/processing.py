"""Baseline correction and high-pass filter of uncorrected records: a named step, never silent.

An instrument's offset and its slow drift are accelerations of micro-g that integrate to metres.
The default procedure removes the mean, puts 20 s of zeros on each side, and runs a Butterworth
high-pass of order 2 at 0.1 Hz forward and backward, which shifts no phase. The padding stays in
the record: without it the filter's transients are cut off, and velocity and displacement do not
return to zero (Boore 2005, Bull. Seismol. Soc. Am. 95(2), 745-750).
"""

from __future__ import annotations

import math
import re
from dataclasses import asdict, dataclass, replace
from datetime import timedelta

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion

LARGEST_ORDER = 8

MOST_SAMPLES = 20_000_000
"""A record lengthened by zeros beyond this has a wrong dt."""

LARGEST_PGA_G = 1e100

PROCESSING_WORDS = {
    "corrected": True,
    "baseline corrected": True,
    "v2 corrected": True,
    "uncorrected": False,
    "unfiltered": False,
    "unprocessed": False,
    "offset removed": False,
    "raw": False,
    "v1 uncorrected": False,
}
"""What is said of the processing of a record in words, and whether it is corrected then. An offset
alone removed leaves the drift."""

_SPECTRA = "v3"

_REMARK = re.compile(r"\([^()]*\)|\[[^\[\]]*\]")


@dataclass(frozen=True)
class HighPass:
    """Processing of an uncorrected record, in this order.

    Args:
        taper_s: length of a cosine taper at each end [s], after the mean was removed.
        padding_s: zeros put on each side [s]; they stay in the record.
        corner_hz: corner of the Butterworth high-pass [Hz].
        order: its order; run forward and backward, it falls off twice as steeply.

    Raises:
        InputError: a value that is negative, not finite or beyond use.
    """

    taper_s: float = 0.0
    padding_s: float = 20.0
    corner_hz: float = 0.1
    order: int = 2

    def __post_init__(self) -> None:
        for name in ("taper_s", "padding_s"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise InputError(f"{name} must be 0 s or more, not {getattr(self, name)}")
        if not 0.0 < self.corner_hz < math.inf:
            raise InputError(f"corner_hz must be positive, not {self.corner_hz}")
        if not 1 <= self.order <= LARGEST_ORDER:
            raise InputError(f"order must be 1 to {LARGEST_ORDER}, not {self.order}")


DEFAULT_HIGH_PASS = HighPass()
"""The procedure that `rbfrag motions add` applies to uncorrected records."""


def says_corrected(words: str) -> bool | None:
    """Return whether a description of processing means a corrected record; None for no description.

    The leading word or phrase of :data:`PROCESSING_WORDS` decides; case, hyphens and text in
    brackets do not matter, and further text is a remark.

    Raises:
        InputError: it begins with another word.
    """
    leading = " ".join(_REMARK.sub(" ", words).lower().replace("-", " ").split())
    if not leading:
        return None
    if leading.partition(" ")[0] == _SPECTRA:
        raise InputError(
            f"processing {words[:60]!r}: volume 3 has spectra: use the record of volume 2"
        )
    for phrase, corrected in PROCESSING_WORDS.items():
        if leading.startswith(phrase) and not leading[len(phrase) :][:1].isalnum():
            return corrected
    raise InputError(
        f"processing {words[:60]!r} must begin with one of {', '.join(PROCESSING_WORDS)}; "
        "further text is a comment"
    )


def counts_as_uncorrected(motion: GroundMotion, by_metadata: str = "", confirmed: str = "") -> bool:
    """Return whether a record is to be processed before it is integrated.

    Where nothing is stated, the file decides: its header, or its format where that holds
    uncorrected records only (volume 1, K-NET, KiK-net, CWB, UNAM, NSMN). A file that does not say
    is taken as corrected.

    Args:
        motion: as its file has it.
        by_metadata: processing by a metadata table, as :func:`says_corrected` reads it.
        confirmed: what the caller says of it, who may say otherwise than the file.

    Raises:
        InputError: what is stated is none of the words, or contradicts the file or the caller.
    """
    by_table, by_caller = says_corrected(by_metadata), says_corrected(confirmed)
    if by_table is not None and by_caller is not None and by_table != by_caller:
        raise InputError(
            f"the metadata have processing {by_metadata[:60]!r}, but processing = "
            f"{confirmed[:60]!r} is given: correct one of them",
            fields=("processing",),
        )
    corrected = by_caller if by_table is None else by_table
    if corrected is None:
        return motion.is_corrected is False
    if by_caller is None and motion.is_corrected not in (None, corrected):
        format_says = "corrected" if motion.is_corrected else "uncorrected"
        raise InputError(
            f"by its header or format the record is {format_says}, but the metadata have "
            f"{by_metadata[:60]!r}: correct the metadata, or confirm it with processing",
            fields=("processing",),
        )
    return not corrected


def processed(motion: GroundMotion, high_pass: HighPass = DEFAULT_HIGH_PASS) -> GroundMotion:
    """Return a record with its mean removed, zeros added at both ends and high-pass filtered.

    Args:
        motion: equally spaced samples, as the file has them.
        high_pass: corner, order, padding and taper.

    Returns:
        A longer motion (by twice the padding); `processing_applied` holds every parameter,
        `source_sha256` the hash of the samples before.

    Raises:
        InputError: a motion from nodes or one that was processed before; a corner above the
            Nyquist frequency; a taper longer than half the record; a record too long to pad.
    """
    # heavy, and most commands never process anything
    from scipy.signal import butter, sosfiltfilt

    if motion.dt_s is None:
        raise InputError(f"{motion.label}: only equally spaced samples can be filtered")
    if motion.processing_applied:
        raise InputError(f"{motion.label}: the record is already processed: use the original file")
    nyquist_hz = 0.5 / motion.dt_s
    if high_pass.corner_hz >= nyquist_hz:
        raise InputError(
            f"{motion.label}: a corner of {high_pass.corner_hz:g} Hz is not below the "
            f"{nyquist_hz:g} Hz that dt = {motion.dt_s:g} s resolves: check dt, or add the record "
            "as it is (raw)",
            fields=("raw",),
        )
    zeros = high_pass.padding_s / motion.dt_s
    if not motion.npts + 2.0 * zeros <= MOST_SAMPLES:
        raise InputError(
            f"{motion.label}: {high_pass.padding_s:g} s of zeros are {zeros:.0f} samples at dt = "
            f"{motion.dt_s:g} s: check dt, or add the record as it is (raw)",
            fields=("raw",),
        )
    padding = math.ceil(zeros)
    if not motion.pga_g < LARGEST_PGA_G:
        raise InputError(
            f"{motion.label}: a PGA of {motion.pga_g:g} g cannot be filtered: check the unit"
        )
    count = round(high_pass.taper_s / motion.dt_s)
    if 2 * count > motion.npts:
        raise InputError(
            f"{motion.label}: a taper of {high_pass.taper_s:g} s at each end is longer than the "
            f"record of {motion.duration_s:g} s"
        )
    weights = np.ones(motion.npts)
    if count:
        rise = 0.5 * (1.0 - np.cos(np.pi * np.arange(count) / count))
        weights[:count], weights[-count:] = rise, rise[::-1]
    samples = motion.acceleration_g - motion.acceleration_g.mean()
    samples = np.pad(samples * weights, padding)
    sections = butter(high_pass.order, high_pass.corner_hz, "highpass", fs=1.0 / motion.dt_s,
                      output="sos")  # fmt: skip
    try:
        filtered = sosfiltfilt(sections, samples)
    except ValueError:
        raise InputError(
            f"{motion.label}: {samples.size} samples are too few to filter: add the record as it "
            "is (raw)",
            fields=("raw",),
        ) from None
    start = motion.start_time
    return replace(
        motion,
        acceleration_g=filtered,
        is_corrected=True,
        start_time=None if start is None else start - timedelta(seconds=padding * motion.dt_s),
        source_sha256=motion.source_sha256 or motion.sha256,
        processing_applied={
            "mean_removed": True,
            "filter": "butterworth high-pass",
            "passes": "forward and backward",
            **asdict(high_pass),
            "padding_samples": padding,
        },
    )
