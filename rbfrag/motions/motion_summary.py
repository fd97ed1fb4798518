"""A motion and its intensity measures as an answer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.quality import motion_warnings, quality_flags
from rbfrag.results.numbers import rounded
from rbfrag.results.result import Result, TextLine, TextTable

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
        warnings: remarks of the file and the meaning of the quality flags.
    """

    motion: GroundMotion
    stored: Mapping[str, Any] = field(default_factory=dict)
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
        symbols = {"PGD": ("pgd_m", "m"), "Tm": ("tm_s", "s"), "SA(1.0)": ("sa10_g", "g")}
        measures = (
            f"{symbol} {rounded(values[name])} {unit}"
            for symbol, (name, unit) in symbols.items()
            if values.get(name) is not None
        )
        yield TextLine("Measures", ", ".join(measures))
        yield TextLine("Flags", ", ".join(values["flags"]) or "none")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield every value, if verbose."""
        if verbose:
            values = self.as_dict()
            del values["remarks"]
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
            **motion.spectral_accelerations,
            "processing_applied": motion.processing_applied,
            "sha256": motion.sha256,
            "source_sha256": motion.source_sha256 or motion.sha256,
            "flags": [flag.code for flag in quality_flags(motion)],
            "remarks": list(motion.remarks),
            **self.stored,
        }
