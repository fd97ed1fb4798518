"""Analytic pulses as ground motions, exact where the pulse is made of straight lines."""

from __future__ import annotations

import numpy as np

from rbfrag.motions.ground_motion import GroundMotion


def rectangle(duration_s: float, amplitude_g: float) -> GroundMotion:
    return GroundMotion.from_nodes(
        [0.0, 0.0, duration_s, duration_s], [0.0, amplitude_g, amplitude_g, 0.0]
    )


def triangle(duration_s: float, amplitude_g: float) -> GroundMotion:
    return GroundMotion.from_nodes([0.0, 0.5 * duration_s, duration_s], [0.0, amplitude_g, 0.0])


def rectangular_cycle(duration_s: float, amplitude_g: float) -> GroundMotion:
    """Two rectangular lobes of `duration_s` each, the first positive."""
    times = [0.0, 0.0, duration_s, duration_s, 2.0 * duration_s, 2.0 * duration_s]
    a = amplitude_g
    return GroundMotion.from_nodes(times, [0.0, a, a, -a, -a, 0.0])


def sine_lobes(
    duration_s: float, amplitudes_g: tuple[float, ...], samples_per_lobe: int
) -> GroundMotion:
    """Half-sines of `duration_s` each, equally sampled."""
    phase = np.linspace(0.0, np.pi, samples_per_lobe, endpoint=False)
    lobes = [amplitude * np.sin(phase) for amplitude in amplitudes_g]
    return GroundMotion(np.append(np.concatenate(lobes), 0.0), duration_s / samples_per_lobe)


def half_sines(
    pulses: tuple[tuple[float, float], ...], *, start_s: float = 0.1, rest_s: float = 1.0
) -> GroundMotion:
    """Half-sines of a peak [g] and a length [s], one after the other, sampled every 5 ms."""
    dt_s = 0.005
    until_s = start_s + sum(length_s for _, length_s in pulses) + rest_s
    time_s = np.arange(round(until_s / dt_s) + 1) * dt_s
    samples = np.zeros(time_s.size)
    for peak_g, length_s in pulses:
        inside = (time_s >= start_s - 1e-12) & (time_s <= start_s + length_s + 1e-12)
        samples[inside] += peak_g * np.sin(np.pi * (time_s[inside] - start_s) / length_s)
        start_s += length_s
    return GroundMotion(samples, dt_s)


def smooth_noise(seed: int, peak_g: float = 0.9) -> GroundMotion:
    """Three seconds of smooth noise in an envelope, sampled every 10 ms."""
    rng = np.random.default_rng(seed)
    noise = np.convolve(rng.standard_normal(300), np.hanning(int(rng.integers(8, 40))), "same")
    samples = noise * np.hanning(300)
    return GroundMotion(peak_g * samples / np.abs(samples).max(), 0.01)
