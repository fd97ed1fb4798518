"""Excitation of a block: horizontal and vertical ground acceleration at common nodes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import Polarity, driving_acceleration_g
from rbfrag.motions.quality import motion_warnings
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.results import FloatArray

PGA_MOST_G = 1000.0
"""PGA above which the unit of the samples must be wrong [g]."""

BLOCK = 16
"""Nodes per block of the table of maxima that rest is skipped by."""


class Nodes(NamedTuple):
    """Excitation as used by the kernels; the names are those of :class:`Excitation`.

    Args:
        time_s: node times [s], shape (n,).
        interval_s: interval lengths [s], shape (n - 1,).
        k_h: driving acceleration at the nodes [g], shape (n,).
        w: 1 + k_v at the nodes, shape (n,).
        tail_min_q: least k_h/(1 + k_v) from each node on, rest after the record included.
        block_max_q: greatest k_h/(1 + k_v) of each block of `BLOCK` nodes.
        block_min_q: least of it.
        last: last node with 1 + k_v > 0: the models hold up to it, and after the record if it is
            the last of all.
    """

    time_s: FloatArray
    interval_s: FloatArray
    k_h: FloatArray
    w: FloatArray
    tail_min_q: FloatArray
    block_max_q: FloatArray
    block_min_q: FloatArray
    last: int


@dataclass(frozen=True, eq=False)
class Excitation:
    """Driving accelerations in g at the nodes, polarity applied; linear between nodes.

    Args:
        time_s: node times [s], shape (n,).
        interval_s: interval lengths [s], shape (n - 1,); zero for a jump.
        k_h: driving horizontal acceleration [g], positive drives forward rotation, shape (n,).
        w: effective gravity 1 + k_v [-], shape (n,).
        pga_g: PGA of the horizontal motion, over both signs [g].
        warnings: sentences about how the two components were brought together.
        span_tables: tables of spans (`rbfrag.solver.integrator.block_excitation`) by length, kept
            for the next search.
    """

    time_s: FloatArray
    interval_s: FloatArray
    k_h: FloatArray
    w: FloatArray
    pga_g: float
    warnings: tuple[str, ...] = ()
    span_tables: dict[int, FloatArray] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def jump_node(self) -> int:
        """First node at which 1 + k_v <= 0 (the ground falls away); n where there is none."""
        unloaded = np.flatnonzero(self.w <= 0.0)
        return int(unloaded[0]) if unloaded.size else int(self.w.size)

    @cached_property
    def q(self) -> FloatArray:
        """k_h/(1 + k_v): a block lifts when it exceeds k_r. Zero from a jump on."""
        q = np.zeros_like(self.k_h)
        before_jump = slice(0, self.jump_node)
        q[before_jump] = self.k_h[before_jump] / self.w[before_jump]
        return q

    @cached_property
    def tail_min_q(self) -> FloatArray:
        """Minimum q from each node to the end, rest after the record included (so <= 0).

        q is a ratio of two straight lines between nodes, hence monotone there, and its
        least value is at a node. Minus infinity where a jump is still to come: nothing is
        decided before it.
        """
        # the last entry is the rest after the record, where q = 0
        filled = np.append(self.q, 0.0)
        filled[self.jump_node : self.w.size] = -np.inf
        return np.ascontiguousarray(np.minimum.accumulate(filled[::-1])[::-1][:-1])

    @cached_property
    def tail_max_q(self) -> FloatArray:
        """Maximum q from each node to the end, rest included; infinite before a jump."""
        filled = np.append(self.q, 0.0)
        filled[self.jump_node : self.w.size] = np.inf
        return np.ascontiguousarray(np.maximum.accumulate(filled[::-1])[::-1][:-1])

    @cached_property
    def block_max_q(self) -> FloatArray:
        """Maximum q of each block of `BLOCK` nodes."""
        return np.maximum.reduceat(self.q, np.arange(0, self.q.size, BLOCK))

    @cached_property
    def block_min_q(self) -> FloatArray:
        """Minimum q of each block of `BLOCK` nodes."""
        return np.minimum.reduceat(self.q, np.arange(0, self.q.size, BLOCK))

    @cached_property
    def nodes(self) -> Nodes:
        """Arrays of the excitation that a kernel needs."""
        return Nodes(
            self.time_s, self.interval_s, self.k_h, self.w, self.tail_min_q,
            self.block_max_q, self.block_min_q,
            # nothing is integrated through a jump: the models end at the last node in contact
            min(self.k_h.size, self.jump_node) - 1,
        )  # fmt: skip

    @cached_property
    def duration_s(self) -> float:
        """Time from the first to the last node [s]."""
        return float(self.time_s[-1] - self.time_s[0])

    @cached_property
    def samples_total(self) -> int:
        """Number of sample intervals, jumps left out."""
        return int(np.count_nonzero(self.interval_s))

    @cached_property
    def min_q(self) -> float:
        """Minimum q over the record."""
        return float(self.q.min())

    @cached_property
    def max_q(self) -> float:
        """Maximum q over the record: no block with k_r at or above it uplifts."""
        return float(self.q.max())

    def scaled(self, factor: float) -> Excitation:
        """Return the same shaking, both components times a factor.

        Args:
            factor: what all accelerations are multiplied by, > 0; 1 gives the same numbers.
        """
        if factor == 1.0:
            return self
        k_h, w, pga_g = factor * self.k_h, 1.0 + factor * (self.w - 1.0), factor * self.pga_g
        return replace(self, k_h=k_h, w=w, pga_g=pga_g)

    def with_rest_after(self, duration_s: float, intervals: int) -> Excitation:
        """Return the same shaking followed by a stretch of rest, to which the last sample jumps.

        Args:
            duration_s: length of the rest [s].
        """
        end = self.time_s[-1]
        tail_s = end + duration_s * np.arange(1, intervals + 1) / intervals
        return Excitation(
            time_s=np.concatenate([self.time_s, [end], tail_s]),
            interval_s=np.concatenate([self.interval_s, [0.0], np.diff(tail_s, prepend=end)]),
            k_h=np.concatenate([self.k_h, np.zeros(intervals + 1)]),
            w=np.concatenate([self.w, np.ones(intervals + 1)]),
            pga_g=self.pga_g,
        )


def excitation(
    motion: GroundMotion, vertical: GroundMotion | None = None, polarity: Polarity = "forward"
) -> Excitation:
    """Resample a horizontal motion and its optional vertical at common nodes.

    Args:
        motion: horizontal motion; its positive samples drive forward rotation under
            polarity ``forward``, its negative ones under ``reverse``.
        vertical: vertical motion (upward positive) of the same recording. It must have the
            same sampling interval (or, for node motions, the same node times). Where one
            component is shorter, it is taken as zero after its last sample, with a warning.
        polarity: ``forward`` or ``reverse``; the vertical is never reversed.

    Raises:
        InputError: components that cannot be brought together; a PGA above `PGA_MOST_G`.
    """
    for component in (motion, vertical):
        if component is not None and component.pga_g > PGA_MOST_G:
            raise InputError(f"PGA is {component.pga_g:.3g} g: check the unit of the samples")
    k_h = driving_acceleration_g(motion.acceleration_g, polarity)
    time_s, interval_s = motion.time_s, motion.interval_s
    warnings: list[str] = []
    if vertical is None:
        w = np.ones_like(k_h)
    else:
        if motion.node_time_s is None and vertical.node_time_s is None:
            if motion.dt_s != vertical.dt_s:
                raise InputError(
                    f"the vertical component has dt = {vertical.dt_s:g} s, the horizontal "
                    f"{motion.dt_s:g} s: bring both to one sampling interval first"
                )
        elif not np.array_equal(motion.time_s, vertical.time_s):
            raise InputError(
                "the vertical component must have the same node times as the horizontal"
            )
        k_v = vertical.acceleration_g
        if k_v.size != k_h.size:
            longer = motion if k_h.size > k_v.size else vertical
            short = "vertical" if longer is motion else "horizontal"
            warnings.append(
                Diagnostic(
                    f"the {short} component has {min(k_h.size, k_v.size)} samples, the other "
                    f"{longer.npts}: it is taken as zero after its end",
                    "components_differ",
                )
            )
            # the shorter one drops to zero at its last sample: a jump, two nodes at one time
            n = min(k_h.size, k_v.size)
            time_s = _twice(longer.time_s, n)
            interval_s = np.insert(longer.interval_s, n - 1, 0.0)
            k_h, k_v = (
                np.pad(values, (0, longer.npts + 1 - n)) if values.size == n else _twice(values, n)
                for values in (k_h, k_v)
            )
        w = 1.0 + k_v
    return Excitation(
        time_s=np.array(time_s),
        interval_s=np.array(interval_s),
        k_h=k_h,
        w=w,
        pga_g=float(np.abs(motion.acceleration_g).max()),
        warnings=tuple(warnings),
    )


@lru_cache(maxsize=32)
def kept_excitation(
    motion: GroundMotion, vertical: GroundMotion | None, polarity: Polarity
) -> Excitation:
    """Return :func:`excitation`, the same object for the last few motions.

    What a search or a run works out about a record serves the next block too.
    """
    return excitation(motion, vertical, polarity)


def _twice(values: FloatArray, n: int) -> FloatArray:
    """Repeat the value of sample n - 1."""
    return np.concatenate([values[:n], values[n - 1 :]])


def motion_remarks(
    motion: GroundMotion, vertical: GroundMotion | None, excited: Excitation
) -> tuple[str, ...]:
    """Return the warnings about suspicious motions that an answer includes."""
    return (*motion_warnings(motion, vertical), *excited.warnings)
