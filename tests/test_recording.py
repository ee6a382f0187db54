"""Recording: what a report keeps of a case does not depend on chunks, and holds the worst place."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from cnc_shape.arrays import frozen, frozen_integers
from cnc_shape.contour import ContourError
from cnc_shape.recording import Recorder, Signals
from cnc_shape.simulation import Response
from cnc_shape.trajectory import Trajectory

SAMPLE_TIME = 1e-3


def record(errors, chunk: int, kept: int) -> Signals:
    recorder = Recorder("shaped", ("x", "y", "z"), SAMPLE_TIME, kept)
    n = errors.size
    ramp = np.arange(n)[:, None] * np.array([1.0, 2.0, 3.0])
    for low in range(0, n, chunk):
        rows = slice(low, min(low + chunk, n))
        block = frozen(ramp[rows])
        command = Trajectory(("x", "y", "z"), SAMPLE_TIME, frozen(ramp[rows, 0]), block, block, block)
        error = ContourError(
            frozen(errors[rows]), block, frozen(ramp[rows, 0]), frozen_integers(np.arange(n)[rows])
        )
        recorder.add(Response(command, block, block, block, block), (error, error, error))
    return recorder.signals(np.ones((3, 3)))


def test_a_short_motion_is_kept_whole():
    errors = np.random.default_rng(0).uniform(size=500)
    signals = record(errors, 64, kept=1000)
    assert signals.factor == 1
    assert_array_equal(signals.tool_error, errors)
    assert_array_equal(signals.command[:, 1], 2.0 * np.arange(500))
    assert_array_equal(signals.time, np.arange(500) * SAMPLE_TIME)


@pytest.mark.parametrize("chunk", [1, 7, 1000, 12_345])
def test_a_long_motion_is_thinned_alike_for_any_chunks(chunk):
    errors = np.round(np.random.default_rng(1).uniform(size=12_345), 2)  # with equals
    whole, parts = record(errors, 12_345, kept=2000), record(errors, chunk, kept=2000)
    for name in Signals.__slots__:
        assert_array_equal(getattr(parts, name), getattr(whole, name))
    assert whole.factor > 1
    assert whole.time.size <= 200
    assert whole.tool_error.max() == errors.max()
    worst = whole.tool_error.argmax()
    assert whole.line[worst] == errors.argmax()
