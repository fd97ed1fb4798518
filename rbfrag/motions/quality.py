"""Quality flags of a motion, each with an explanation, and the summary of a motion."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.intensity import TM_BAND_HZ
from rbfrag.motions.response_spectrum import DirectionalPeaks
from rbfrag.results.diagnostic import Diagnostic, with_prefix
from rbfrag.results.numbers import exact_percent, rounded
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.vocabulary.quantities import QUANTITIES
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S

LONGEST_DT_S = 0.1
"""Strong-motion instruments sample at 0.001 to 0.02 s; above 0.1 s the dt is likely wrong."""

SHORTEST_DT_S = 1e-4

LARGEST_PGA_G = 5.0
"""The largest recorded ground accelerations are near 4 g."""

LARGEST_PGV_M_S = 5.0
"""The largest recorded ground velocities are near 4 m/s."""

END_VELOCITY_RATIO = 0.05
"""A corrected record ends at rest; 5 % of PGV left over means that it was not corrected."""

END_DISPLACEMENT_M = 5.0
"""Permanent displacements are real near a fault, but hardly beyond 5 m at one site."""

EDGE_RATIO = 0.1
"""A record that starts or ends above 10 % of PGA was cut out of a longer one."""

FEW_SAMPLES = 100

STRUCTURE = "structure"
"""Flag of records that a sensor on a structure made."""

DIRECTION_GUESSED = "direction_guessed"
"""Flag of records taken as horizontal though neither file nor metadata say so."""

# a ground floor is within a building, whose base does not move as the ground next to it
_ON_THE_GROUND = re.compile(r"free[\s-]*field|(?:ground|grnd)(?![\s-]*(?:fl|stor))", re.IGNORECASE)


PGD_IN_DOUBT = frozenset({"final_velocity", "final_displacement"})
"""Flags of records whose displacement is that of a drifting baseline."""


@dataclass(frozen=True)
class QualityFlag:
    """Quality flag of a motion: its stored name, and a sentence with value, limit and meaning."""

    code: str
    sentence: Diagnostic


def is_on_structure(motion: GroundMotion) -> bool:
    """Return whether the header's location is not on the ground or in the free field."""
    return bool(motion.location) and not _ON_THE_GROUND.match(motion.location)


def quality_flags(motion: GroundMotion) -> tuple[QualityFlag, ...]:
    """Return all quality flags of a motion; an ordinary corrected record has none.

    Args:
        motion: any ground motion. Motions from nodes are assumed to be analytic: only their
            amplitudes are looked at.
    """
    measures = motion.measures
    flags: list[QualityFlag] = []

    def doubt(code: str, sentence: str) -> None:
        flags.append(QualityFlag(code, Diagnostic(sentence, "record_quality")))

    if measures.pga_g == 0.0:
        doubt("all_zero", "every sample is zero: this is no motion")
        return tuple(flags)
    if measures.pga_g > LARGEST_PGA_G:
        doubt(
            "pga_suspicious",
            f"PGA of {measures.pga_g:.3g} g is above {LARGEST_PGA_G:g} g, more than was ever "
            "recorded: check the unit of acceleration",
        )
    if measures.pgv_m_s > LARGEST_PGV_M_S:
        doubt(
            "pgv_suspicious",
            f"PGV of {measures.pgv_m_s:.3g} m/s is above {LARGEST_PGV_M_S:g} m/s, more than was "
            "ever recorded: check unit, dt and baseline",
        )
    if is_on_structure(motion):
        doubt(
            STRUCTURE,
            f"the sensor stands at {motion.location!r}, neither on the ground nor in the free "
            "field: the record holds the response of a structure",
        )
    if motion.is_partial:
        doubt("partial", "the header states another number of samples than the file holds")
    if motion.dt_s is None:
        return tuple(flags)
    if not SHORTEST_DT_S <= motion.dt_s <= LONGEST_DT_S:
        doubt(
            "dt_suspicious",
            f"dt of {motion.dt_s:g} s is outside {SHORTEST_DT_S:g} to {LONGEST_DT_S:g} s: check "
            "that it is in seconds",
        )
    nyquist_hz = 0.5 / motion.dt_s
    if nyquist_hz < TM_BAND_HZ[1] * (1.0 - 1e-9):
        doubt(
            "coarse_for_tm",
            f"dt of {motion.dt_s:g} s resolves {nyquist_hz:g} Hz, but the mean period needs "
            f"{TM_BAND_HZ[1]:g} Hz: Tm is taken over what there is",
        )
    if motion.npts < FEW_SAMPLES:
        doubt("short_record", f"{motion.npts} samples are few for an accelerogram")
    if abs(measures.final_velocity_m_s) > END_VELOCITY_RATIO * measures.pgv_m_s:
        doubt(
            "final_velocity",
            f"the record ends at {measures.final_velocity_m_s:.3g} m/s, more than "
            f"{exact_percent(END_VELOCITY_RATIO)} of its PGV: its baseline is not corrected, "
            "and PGD means little",
        )
    if abs(measures.final_displacement_m) > END_DISPLACEMENT_M:
        doubt(
            "final_displacement",
            f"the record ends at {measures.final_displacement_m:.3g} m, more than "
            f"{END_DISPLACEMENT_M:g} m: its baseline drifts, and PGD means little",
        )
    edges = np.abs(motion.acceleration_g[[0, -1]])
    for code, where, edge in zip(
        ("first_sample_not_zero", "last_sample_not_zero"),
        ("starts", "ends"),
        edges.tolist(),
        strict=True,
    ):
        if edge > EDGE_RATIO * measures.pga_g:
            doubt(
                code,
                f"the record {where} at {edge:.3g} g, more than {exact_percent(EDGE_RATIO)} of its "
                "PGA: it was cut out of a longer one; the ground is assumed to be at rest outside "
                "it",
            )
    return tuple(flags)


@lru_cache(maxsize=64)  # a motion does not change, and one run takes less time than these
def motion_warnings(
    motion: GroundMotion, vertical: GroundMotion | None = None
) -> tuple[Diagnostic, ...]:
    """Return the remarks on the reading of a motion, and its quality flags.

    Args:
        motion: the horizontal motion.
        vertical: the vertical motion of the same recording, whose flags follow.
    """
    remarks = (Diagnostic(text, "record_remark") for text in motion.remarks)
    flags = (flag.sentence for flag in quality_flags(motion))
    upward = () if vertical is None else quality_flags(vertical)
    return (*remarks, *flags, *(with_prefix("vertical: ", flag.sentence) for flag in upward))


SHOWN = ("pgd_m", "tm_s", "arias_m_s", "cav_m_s", "d5_75_s", "d5_95_s", "housner_m")
"""Measures in the text of a motion, besides PGA, PGV and the response spectrum."""


def _by_period(sa_g: Sequence[float]) -> dict[str, float]:
    return {f"{t:g}": sa for t, sa in zip(SPECTRUM_PERIODS_S, sa_g, strict=True)}


LABELS = (
    "event", "station", "component", "orientation_deg", "is_vertical", "is_corrected", "recording",
    "source_file", "trace_index",
)  # fmt: skip
"""Labels that the file of a motion gives, shown under the same name."""


@dataclass(frozen=True, eq=False, repr=False)
class MotionSummary(Result):
    """A motion with its labels, intensity measures and quality flags.

    Args:
        motion: the motion.
        stored: values of a stored motion, which replace those of its file.
        recording: stored RotD50 and RotD100 of the recording; empty for none.
        warnings: remarks of the file and the meaning of the quality flags.
    """

    motion: GroundMotion
    stored: Mapping[str, Any] = field(default_factory=dict)
    recording: Sequence[DirectionalPeaks] = ()
    warnings: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "warnings", motion_warnings(self.motion))

    def sentences(self) -> Iterator[str]:
        """Yield the peak values and the duration of the motion."""
        motion = self.motion
        yield (
            f"{motion.label}: PGA {rounded(motion.pga_g)} g, PGV {rounded(motion.pgv_m_s)} m/s in "
            f"{motion.duration_s:.4g} s"
        )

    def lines(self) -> Iterator[TextLine]:
        """Yield the record, its measures and its flags."""
        values = self.as_dict()
        names = ("id", "event", "station", "component")
        labels = [f"{name} {values[name]}" for name in names if values.get(name)]
        labels += ["vertical"] if values["is_vertical"] else []
        if labels:
            yield TextLine("Record", ", ".join(labels))
        step = "" if values["dt_s"] is None else f", dt {values['dt_s']:g} s"
        processed = values["processing_applied"] is not None
        treatment = "processed by rbfrag" if processed else "as in its file"
        yield TextLine("Samples", f"{values['npts']:,}{step}; {treatment}")
        measures = (
            f"{QUANTITIES[name].symbol} {rounded(values[name])} {QUANTITIES[name].unit}"
            for name in SHOWN
            if values[name] is not None
        )
        yield TextLine("Measures", ", ".join(measures))
        yield TextLine("Flags", ", ".join(values["flags"]) or "none")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield PGA, PGV and the response spectrum, also of the recording; all if verbose."""
        motion = self.motion
        names = ["PGA [g]", "PGV [m/s]", *(f"SA({t:g} s) [g]" for t in SPECTRUM_PERIODS_S)]
        columns = [(motion.pga_g, motion.pgv_m_s, *motion.spectrum_g)]
        columns += [(peaks.pga_g, peaks.pgv_m_s, *peaks.sa_g) for peaks in self.recording]
        headers = ("", "component", *(f"RotD{peaks.percentile}" for peaks in self.recording))
        rows = zip(names, *(map(rounded, column) for column in columns), strict=True)
        yield TextTable(headers, [*rows])
        if verbose:
            values = self.as_dict()
            for name in ("remarks", "sa_g", "rotd50", "rotd100"):
                values.pop(name, None)
            yield TextTable(
                (), [(name, value) for name, value in values.items() if value is not None]
            )

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        motion = self.motion
        return {
            "name": motion.label,
            **{name: getattr(motion, name) for name in LABELS},
            "format": motion.file_format,
            "start_time": None if motion.start_time is None else motion.start_time.isoformat(),
            **{name: getattr(motion, name) for name in ("dt_s", "npts", "duration_s")},
            **asdict(motion.measures),
            "housner_m": motion.housner_m,
            "sa_g": _by_period(motion.spectrum_g),
            **{
                f"rotd{peaks.percentile}": {**peaks._asdict(), "sa_g": _by_period(peaks.sa_g)}
                for peaks in self.recording
            },
            "processing_applied": motion.processing_applied,
            "sha256": motion.sha256,
            "source_sha256": motion.source_sha256 or motion.sha256,
            "flags": [flag.code for flag in quality_flags(motion)],
            "remarks": list(motion.remarks),
            **self.stored,
        }
