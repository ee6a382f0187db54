"""Live shaping of three axes, one sample at a time, against numpy with the same taps.

numpy answers one sample by dot products of each axis's last ones with its taps. ``np.convolve`` is told
beside it: it has all samples from the start and answers none of them before the last has come.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import Kind, Row, best_of, report
from cnc_shape.arrays import FloatArray
from cnc_shape.modes import Mode
from cnc_shape.shapers import cascade
from cnc_shape.shapers.discretisation import Interpolation
from cnc_shape.shapers.live import Filters, LiveShaper, filters, shape_samples

SAMPLES = 50_000
ROUNDS = 5
SAMPLE_TIME = 1e-3  # s
MODES = (Mode(30.0, 0.02), Mode(100.0, 0.01))
AXES = ("x", "y", "z")


def one_by_one(samples: FloatArray, wanted: Filters) -> FloatArray:
    """Push every sample on its own."""
    live = LiveShaper(wanted)
    return np.array([live.push(sample) for sample in samples])


def dots(samples: FloatArray, wanted: Filters) -> FloatArray:
    """Dot products of each axis's last samples with its taps, sample by sample, in a buffer twice as long."""
    length = wanted.taps[0].weights.size
    reverse = [taps.weights[::-1].copy() for taps in wanted.taps]
    buffer = np.repeat(samples[0][:, np.newaxis], 2 * length, axis=1)
    shaped = np.empty_like(samples)
    at = 0
    for n, sample in enumerate(samples):
        buffer[:, at] = buffer[:, at + length] = sample
        at = at + 1 if at + 1 < length else 0
        for axis, weights in enumerate(reverse):
            shaped[n, axis] = np.dot(buffer[axis, at : at + length], weights)
    return shaped


def convolve(samples: FloatArray, wanted: Filters) -> FloatArray:
    """Convolve all of it."""
    length = wanted.taps[0].weights.size
    padded = np.pad(samples, ((length - 1, length - 1), (0, 0)), mode="edge")
    columns = zip(padded.T, wanted.taps, strict=True)
    return np.stack([np.convolve(column, taps.weights, "valid") for column, taps in columns], axis=1)


def rows() -> Iterator[Row]:
    """Measure."""
    shapers, modes = dict.fromkeys(AXES, cascade(MODES)), dict.fromkeys(AXES, MODES)
    wanted = filters(shapers, AXES, SAMPLE_TIME, Interpolation.EXACT, modes)
    samples = np.cumsum(np.random.default_rng(9).normal(size=(SAMPLES, len(AXES))), axis=0)
    shaped = shape_samples(samples, wanted)
    assert np.array_equal(one_by_one(samples, wanted), shaped[:SAMPLES])
    assert np.allclose(dots(samples, wanted), shaped[:SAMPLES], atol=1e-9)
    assert np.allclose(convolve(samples, wanted), shaped, atol=1e-9)
    stage, unit, scale = "live shaping", "ns/sample", 1e9 / SAMPLES
    ours = best_of(ROUNDS, partial(one_by_one, samples, wanted)) * scale
    peer = best_of(ROUNDS, partial(dots, samples, wanted)) * scale
    yield Row(f"{stage}, one by one", Kind.SHARE, None, "numpy dot", unit, ours, peer)
    ours = best_of(ROUNDS, partial(shape_samples, samples, wanted)) * scale
    peer = best_of(ROUNDS, partial(convolve, samples, wanted)) * scale
    yield Row(f"{stage}, all at once", Kind.SHARE, None, "numpy convolve", unit, ours, peer)


if __name__ == "__main__":
    report(rows())
