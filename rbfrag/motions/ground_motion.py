"""Accelerogram: the input of all other computations."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from rbfrag.errors import InputError
from rbfrag.motions import intensity, response_spectrum
from rbfrag.motions.polarity import FloatArray
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S

LONGEST_S = 1e100
"""Beyond this nothing can be integrated."""

LOCATION = "the sensor's location by the header: "
"""Begin of the remark that states where a sensor stands; remarks go with a motion everywhere."""


@dataclass(frozen=True, eq=False, repr=False)
class GroundMotion:
    """A recorded or analytic ground acceleration, piecewise linear between its samples.

    Args:
        acceleration_g: samples [g], shape (npts,), npts >= 1. Copied and made read-only.
        dt_s: sampling interval [s], > 0; None only for a motion made by :meth:`from_nodes`.
        station: station code or name, as the file has it.
        event: the earthquake as the file names it (a guess: files spell one event many ways).
        component: component as the file names it (``360``, ``N10E``, ``UP``).
        orientation_deg: azimuth of the component [deg] clockwise from north, if known.
        is_vertical: True for a vertical component, None when the file does not say.
        recording: an id that all components of one recording share.
        source_file: name of the file it was read from.
        trace_index: position of the trace in its file, from 0.
        file_format: name of the reader's format.
        remarks: sentences about the reading that a user should see.
        node_time_s: node times [s] of a general motion, shape (npts,), non-decreasing.
            A time given twice is a jump. None when the samples are equally spaced.
        is_corrected: whether the baseline was corrected, as file or format say; None when
            they do not.
        is_partial: True when the file holds another number of samples than its header says.
        start_time: time of the first sample by the clock and zone of the file, if it says.
        processing_applied: every parameter of what rbfrag did to the samples; None where they
            are those of the file.
        source_sha256: hash of the samples as the file has them; empty where these are they.
        stated_unit: unit of acceleration as the file spells it; empty where it states none.

    Raises:
        InputError: no samples, a sample that is not finite, dt_s not positive, times that fall.
    """

    acceleration_g: FloatArray
    dt_s: float | None
    station: str = ""
    event: str = ""
    component: str = ""
    orientation_deg: float | None = None
    is_vertical: bool | None = None
    recording: str = ""
    source_file: str = ""
    trace_index: int = 0
    file_format: str = ""
    remarks: tuple[str, ...] = ()
    node_time_s: FloatArray | None = None
    is_corrected: bool | None = None
    is_partial: bool = False
    start_time: datetime | None = None
    processing_applied: Mapping[str, object] | None = None
    source_sha256: str = ""
    stated_unit: str = ""

    def __post_init__(self) -> None:
        samples = _finite_vector(self.acceleration_g, "acceleration sample", "g")
        object.__setattr__(self, "acceleration_g", samples)
        if self.node_time_s is None:
            if self.dt_s is None or not np.isfinite(self.dt_s) or self.dt_s <= 0.0:
                raise InputError(
                    f"the sampling interval dt must be a positive number of seconds: {self.dt_s}"
                )
            object.__setattr__(self, "dt_s", float(self.dt_s))
            if not samples.size * float(self.dt_s) < LONGEST_S:
                raise InputError(
                    f"{samples.size} samples at dt = {self.dt_s:g} s last longer than "
                    f"{LONGEST_S:g} s: check dt"
                )
            return
        if self.dt_s is not None:
            raise InputError("give either dt_s or node_time_s, not both")
        times = _finite_vector(self.node_time_s, "node time", "s")
        if times.shape != samples.shape:
            raise InputError(
                f"{times.size} node times but {samples.size} accelerations: give one time per value"
            )
        falls = np.flatnonzero(np.diff(times) < 0.0)
        if falls.size:
            i = int(falls[0])
            raise InputError(
                f"node times must not decrease: node {i + 1} at {times[i + 1]:g} s follows "
                f"{times[i]:g} s"
            )
        object.__setattr__(self, "node_time_s", times)

    @classmethod
    def from_nodes(
        cls,
        time_s: ArrayLike | Sequence[float],
        acceleration_g: ArrayLike | Sequence[float],
        *,
        station: str = "",
        event: str = "",
        component: str = "",
    ) -> Self:
        """Return a motion from nodes (time, acceleration), linear between them.

        Args:
            time_s: node times [s], non-decreasing; a time given twice is a jump, so a
                rectangular pulse is exact.
            acceleration_g: acceleration at the nodes [g], same length.
            station: label.
            event: label.
            component: label.
        """
        return cls(
            np.asarray(acceleration_g, dtype=np.float64),
            None,
            station=station,
            event=event,
            component=component,
            node_time_s=np.asarray(time_s, dtype=np.float64),
        )

    @property
    def npts(self) -> int:
        """Number of samples (nodes)."""
        return int(self.acceleration_g.size)

    @cached_property
    def interval_s(self) -> FloatArray:
        """Length of each interval between samples [s], shape (npts - 1,)."""
        if self.node_time_s is not None:
            steps: FloatArray = np.diff(self.node_time_s)
        else:
            # not diff(time): i*dt rounds, and the steps of an equally spaced record are equal
            steps = np.full(self.npts - 1, self.dt_s, dtype=np.float64)
        steps.flags.writeable = False
        return steps

    @cached_property
    def time_s(self) -> FloatArray:
        """Time of each sample [s], shape (npts,); starts at 0 for equally spaced samples."""
        if self.node_time_s is not None:
            return self.node_time_s
        assert self.dt_s is not None
        times: FloatArray = np.arange(self.npts, dtype=np.float64) * self.dt_s
        times.flags.writeable = False
        return times

    @property
    def duration_s(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time_s[-1] - self.time_s[0])

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the samples in g as little-endian float64 (of times and samples for nodes)."""
        digest = hashlib.sha256()
        if self.node_time_s is not None:
            digest.update(self.node_time_s.astype("<f8").tobytes())
        digest.update(self.acceleration_g.astype("<f8").tobytes())
        return digest.hexdigest()

    @cached_property
    def measures(self) -> intensity.IntensityMeasures:
        """All intensity measures of the motion, as supplied (no detrending)."""
        return intensity.intensity_measures(self.acceleration_g, self.interval_s, self.dt_s)

    @cached_property
    def _ordinates(self) -> dict[float, float]:
        return {}

    def spectral_acceleration(self, period_s: float) -> float:
        """Return the spectral acceleration at 5 % damping [g], computed once for each period."""
        return self._spectrum((period_s,))[0]

    def _spectrum(self, periods_s: Iterable[float]) -> tuple[float, ...]:
        periods_s = tuple(periods_s)
        if missing := [period_s for period_s in periods_s if period_s not in self._ordinates]:
            ordinates = response_spectrum.spectral_accelerations(
                self.acceleration_g, self.interval_s, missing
            )
            self._ordinates.update(zip(missing, ordinates, strict=True))
        return tuple(self._ordinates[period_s] for period_s in periods_s)

    @property
    def spectral_accelerations(self) -> Mapping[str, float]:
        """Spectral accelerations at 5 % damping [g] by name, ``sa03_g`` for that at 0.3 s."""
        periods = response_spectrum.PERIODS_S
        return dict(zip(periods, self._spectrum(periods.values()), strict=True))

    @property
    def spectrum_g(self) -> tuple[float, ...]:
        """Response spectrum at 5 % damping [g], at the periods `SPECTRUM_PERIODS_S`."""
        return self._spectrum(SPECTRUM_PERIODS_S)

    @cached_property
    def housner_m(self) -> float:
        """Housner intensity, the integral of PSV from 0.1 to 2.5 s at 5 % damping [m]."""
        ordinates_g = self._spectrum(response_spectrum.HOUSNER_PERIODS_S)
        return response_spectrum.housner_intensity(ordinates_g)

    @property
    def pga_g(self) -> float:
        """Peak ground acceleration, max|a| over both signs [g]."""
        return self.measures.pga_g

    @property
    def pgv_m_s(self) -> float:
        """Peak ground velocity, the extreme of the exact integral of the record [m/s]."""
        return self.measures.pgv_m_s

    @property
    def pgd_m(self) -> float:
        """Peak ground displacement, the extreme of the exact double integral [m]."""
        return self.measures.pgd_m

    @property
    def tm_s(self) -> float | None:
        """Mean period of Rathje, Abrahamson & Bray (1998) [s]; None where it is not defined."""
        return self.measures.tm_s

    @property
    def location(self) -> str:
        """Location of the sensor by the file's header; empty if unknown."""
        remarks = (remark for remark in self.remarks if remark.startswith(LOCATION))
        return next(remarks, "").removeprefix(LOCATION)

    def scaled(self, factor: float) -> GroundMotion:
        """Return the motion with every sample multiplied by `factor`."""
        return replace(self, acceleration_g=self.acceleration_g * factor)

    @property
    def label(self) -> str:
        """A short name for tables and plots."""
        parts = [p for p in (self.event, self.station, self.component) if p]
        return " ".join(parts) or self.source_file or "motion"

    def __repr__(self) -> str:
        """Return a one-line description."""
        step = "nodes" if self.dt_s is None else f"samples of {self.dt_s:g} s"
        return f"GroundMotion({self.label!r}, {self.npts} {step}, PGA {self.pga_g:.3g} g)"


def _finite_vector(values: ArrayLike, description: str, unit: str) -> FloatArray:
    try:
        vector = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"the {description}s must be numbers: {error}") from None
    if vector.ndim != 1:
        raise InputError(f"{description}s must be one-dimensional, not of shape {vector.shape}")
    if vector.size == 0:
        raise InputError(f"no {description}: at least one is required")
    bad = np.flatnonzero(~np.isfinite(vector))
    if bad.size:
        i = int(bad[0])
        raise InputError(f"{description} {i} is {vector[i]} ({unit}): every value must be finite")
    vector.flags.writeable = False
    return vector
