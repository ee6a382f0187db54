"""Sampling a time law at the servo period: three axes, position, velocity and acceleration."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import Kind, Row, best_of, report
from benchmarks.motions import SAMPLE_TIME, profile
from cnc_shape.arrays import FloatArray
from cnc_shape.feedrate import Profile
from cnc_shape.trajectory import sample, sampling

BLOCKS = 100_000
ROUNDS = 5
RECORDED = 10.0  # ns a sample, of a compiled prototype
SLICE = 4096  # samples that numpy evaluates at once: what fits the cache


def sample_in_numpy(law: Profile) -> FloatArray:
    """Positions, velocities and accelerations of all samples, (n,3,d)."""
    c = law.path.coefficients
    time = np.arange(0.0, law.end_time, SAMPLE_TIME)
    found = np.empty((time.size, 3, c.shape[2]))
    for first in range(0, time.size, SLICE):
        t = time[first : first + SLICE]
        piece = np.searchsorted(law.time, t, side="right") - 1
        e, a = t - law.time[piece], law.acceleration[piece]
        v = law.velocity[piece] + e * a
        s = (law.u[piece] + e * (law.velocity[piece] + 0.5 * e * a))[:, None]
        c0, c1, c2, c3 = (c[law.cell[piece], k] for k in range(4))
        slope, bend = c1 + s * (2.0 * c2 + 3.0 * s * c3), 2.0 * c2 + 6.0 * s * c3
        out = found[first : first + SLICE]
        out[:, 0] = c0 + s * (c1 + s * (c2 + s * c3))
        out[:, 1] = slope * v[:, None]
        out[:, 2] = slope * a[:, None] + bend * (v * v)[:, None]
    return found


def drain(law: Profile) -> None:
    """Sample as the chain does, block by block."""
    for _ in sampling(SAMPLE_TIME)(None, law, True):
        pass


def rows() -> Iterator[Row]:
    """Measure."""
    law = profile("printer", BLOCKS)
    whole, theirs = sample(law, SAMPLE_TIME), sample_in_numpy(law)
    assert np.allclose(whole.position[: len(theirs)], theirs[:, 0], atol=1e-9)
    assert np.allclose(whole.velocity[: len(theirs)], theirs[:, 1], atol=1e-6)
    ours = best_of(ROUNDS, partial(drain, law)) / len(whole) * 1e9
    peer = best_of(2, partial(sample_in_numpy, law)) / len(whole) * 1e9
    stage, unit = "sampling, 3 axes at 1 kHz", "ns/sample"
    name, note = "compiled prototype (recorded)", "the peer's number is recorded, not measured here"
    yield Row(stage, Kind.SHARE, 3.0, name, unit, ours, RECORDED, note)
    yield Row(stage, Kind.SHARE, None, "numpy", unit, ours, peer)


if __name__ == "__main__":
    report(rows())
