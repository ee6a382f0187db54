"""A law under a jerk limit does not depend on chunks, and holds back a few stopping distances at most."""

import numpy as np
import pytest
from motions import lines, wander
from test_jerk import MILL_J, assert_keeps

from cnc_shape.jerk import jerk_planning
from cnc_shape.planning import plan
from cnc_shape.smoothing import Smoothing, smooth

COLUMNS = ("time", "duration", "u", "velocity", "acceleration", "jerk")


def in_chunks(path, limits, size):
    """Profiles of a path in chunks of `size` cells; the state before the last one; most cells held back."""
    step, state, profiles, held = jerk_planning(limits), None, [], 0
    for first in range(0, len(path), size):
        last = first + size >= len(path)
        before = state
        state, profile = step(state, path.cut(slice(first, first + size)), last)
        profiles.append(profile)
        held = max(held, sum(len(part) for part in state.parts) if state else 0)
    return profiles, before, held


def spiral(turns, pitch=0.1, segments=120):
    angle = np.linspace(0.0, 2 * np.pi * turns, int(turns * segments))
    return (1.0 + pitch * angle / (2 * np.pi))[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("small", [False, True])
@pytest.mark.parametrize("kind", ["wander", "spiral"])
def test_chunks_do_not_change_a_bit(monkeypatch, kind, small):
    if small:
        monkeypatch.setattr("cnc_shape.jerk.WINDOW", 256)
        monkeypatch.setattr("cnc_shape.jerk.PATIENCE", 1)
    whole = wander(np.random.default_rng(3), 3000) if kind == "wander" else lines(spiral(60), 150.0)
    path = smooth(whole, Smoothing(0.01))
    once = plan(path, MILL_J)
    assert_keeps(once, MILL_J)
    for size in (1, 97, 1000) if not small else (613,):
        parts, _, _ = in_chunks(path, MILL_J, size)
        for name in COLUMNS:
            np.testing.assert_array_equal(
                np.concatenate([getattr(part, name) for part in parts]), getattr(once, name)
            )
