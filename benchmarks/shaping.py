"""Shaping by ten impulses between samples, against numpy with the same taps and against FFT convolution.

All of them shape position, velocity and acceleration of three axes. Between samples the command is the
cubic through position and velocity, so each impulse puts two taps of each on position and on velocity, and
two on acceleration.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from scipy.signal import oaconvolve

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import Kind, Row, best_of, report
from benchmarks.motions import command
from cnc_shape.arrays import FloatArray
from cnc_shape.shapers import Shaper, make_shaper
from cnc_shape.shapers.shaping import shape
from cnc_shape.trajectory import Trajectory

BLOCKS = 50_000
ROUNDS = 5
IMPULSES = 10
SPACING = 3.37e-3  # s, so that no impulse but the first falls on a sample
SLICE = 1024  # samples that numpy adds at once: what fits the cache
Taps = list[tuple[int, int, int, float]]  # from signal, to signal (0, 1, 2), samples late, weight


def taps_of(shaper: Shaper, sample_time: float) -> Taps:
    """Taps of the impulses on (position, velocity, acceleration)."""
    taps: Taps = []
    for time, weight in zip(shaper.times.tolist(), shaper.amplitudes.tolist(), strict=True):
        late = int(time / sample_time)
        back = time / sample_time - late
        x, right, left = 1.0 - back, late, late + 1
        start, end = (1.0 + 2.0 * x) * back**2, x**2 * (3.0 - 2.0 * x)
        slope = 6.0 * x * back / sample_time
        taps += [
            (0, 0, left, weight * start),
            (0, 0, right, weight * end),
            (1, 0, left, weight * x * back**2 * sample_time),
            (1, 0, right, -weight * x**2 * back * sample_time),
            (0, 1, left, -weight * slope),
            (0, 1, right, weight * slope),
            (1, 1, left, weight * back * (1.0 - 3.0 * x)),
            (1, 1, right, weight * x * (3.0 * x - 2.0)),
            (2, 2, left, weight * back),
            (2, 2, right, weight * x),
        ]
    return [tap for tap in taps if tap[3] != 0.0]


def padded(motion: Trajectory, longest: int) -> list[FloatArray]:
    """Signals with the rest before and after the motion."""
    around = ((longest, longest), (0, 0))
    still = [np.pad(signal, around) for signal in (motion.velocity, motion.acceleration)]
    return [np.pad(motion.position, around, mode="edge"), *still]


def shift_add(signals: list[FloatArray], taps: Taps, first: int) -> list[FloatArray]:
    """Add up the shifted signals, slice by slice."""
    count = len(signals[0]) - first
    shaped = [np.zeros((count, signals[0].shape[1])) for _ in signals]
    product = np.empty((SLICE, signals[0].shape[1]))
    for begin in range(0, count, SLICE):
        rows = min(SLICE, count - begin)
        for source, target, late, weight in taps:
            row = first + begin - late
            np.multiply(signals[source][row : row + rows], weight, out=product[:rows])
            shaped[target][begin : begin + rows] += product[:rows]
    return shaped


def convolve(signals: list[FloatArray], taps: Taps, first: int) -> list[FloatArray]:
    """Convolve by FFT."""
    count = len(signals[0]) - first
    shaped = [np.zeros((count, signals[0].shape[1])) for _ in signals]
    for source, target in sorted({tap[:2] for tap in taps}):
        response = np.zeros((first + 1, 1))
        for begin, end, late, weight in taps:
            if (begin, end) == (source, target):
                response[late] += weight
        shaped[target] += oaconvolve(signals[source], response, axes=0)[first : first + count]
    return shaped


def rows() -> Iterator[Row]:
    """Measure."""
    motion = command("printer", BLOCKS)
    weights = np.arange(1.0, IMPULSES + 1.0)
    shaper = make_shaper(np.arange(IMPULSES) * SPACING, weights / weights.sum())
    shapers = dict.fromkeys(motion.axes, shaper)
    taps = taps_of(shaper, motion.sample_time)
    longest = max(tap[2] for tap in taps)
    signals = padded(motion, longest)
    shaped = shape(motion, shapers)
    for way in (shift_add, convolve):
        theirs = way(signals, taps, longest)
        assert np.allclose(theirs[0][: len(shaped)], shaped.position, atol=1e-9), way
        assert np.allclose(theirs[1][: len(shaped)], shaped.velocity, atol=1e-6), way
        assert np.allclose(theirs[2][: len(shaped)], shaped.acceleration, atol=1e-5), way
    scale = 1e9 / (len(shaped) * len(motion.axes))
    ours = best_of(ROUNDS, partial(shape, motion, shapers)) * scale
    stage, unit = "shaping, 10 impulses between samples", "ns/axis-sample"
    peer = best_of(3, partial(shift_add, signals, taps, longest)) * scale
    yield Row(stage, Kind.SHARE, 0.8, "numpy shift-add, same taps", unit, ours, peer)
    peer = best_of(3, partial(convolve, signals, taps, longest)) * scale
    yield Row(stage, Kind.SHARE, None, "scipy oaconvolve", unit, ours, peer)


if __name__ == "__main__":
    report(rows())
