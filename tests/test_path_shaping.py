"""Path shaping: the time law is shaped, and the axes never leave the path."""

from __future__ import annotations

import naive
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from paths import arc, dwell, line, program
from test_pipeline import cut

from cnc_shape.arrays import frozen
from cnc_shape.kernels.progress import along_path
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, Machine
from cnc_shape.modes import Mode
from cnc_shape.motion import moving
from cnc_shape.planning import plan
from cnc_shape.program import PathMode
from cnc_shape.shapers import make_shaper, zv, zvd
from cnc_shape.shapers.path_shaping import common_shaper, path_sampling
from cnc_shape.shapers.shaper import NONE
from cnc_shape.smoothing import Smoothing, smooth
from cnc_shape.timing import Timing
from cnc_shape.toolpath import build_toolpath
from cnc_shape.trajectory import join_trajectories, sample

T = 1e-3
LIMITS = [Limits(200.0, 2000.0)] * 3
MACHINE = Machine("test", tuple(Axis(a, limits) for a, limits in zip("xyz", LIMITS, strict=True)))
UNDERSHOOTING = make_shaper([0.0, 0.004, 0.011], [1.0, -1.0, 1.0])


def winding():
    return program(
        line(20.0, 0.0, 0.0, feed_rate=80.0), line(20.0, 10.0, 0.0, feed_rate=80.0),
        arc((0.0, 10.0, 0.0), (10.0, 10.0, 0.0), np.pi, feed_rate=60.0), dwell(0.05),
        line(0.0, 0.0, 3.0, feed_rate=80.0, mode=PathMode.EXACT_STOP), line(5.0, 0.0, 3.0, feed_rate=80.0),
    )  # fmt: skip


def driven(chunks, timing):
    blocks = list(moving(chunks, MACHINE, 0.01, T, [timing]))
    return join_trajectories([block.command for block in blocks]), blocks[-1].cycle_time


@pytest.mark.parametrize("shaper", [zv(Mode(42.0, 0.05)), UNDERSHOOTING])
def test_the_command_stays_on_the_path_and_ends_where_it_does(shaper):
    whole = winding()
    profile = plan(smooth(build_toolpath(whole), Smoothing(0.01)), LIMITS)
    fine = sample(profile, 2e-5).position
    shaped = join_trajectories([part for _, part in path_sampling(shaper, T)(None, profile, True)])
    for point in shaped.position[::17]:
        assert np.linalg.norm(fine - point, axis=1).min() < 1.2e-3
    assert_allclose(shaped.position[-1], whole.target[-1], atol=1e-9)
    _, end = driven([whole], Timing(path_shaper=shaper))
    assert end == pytest.approx(profile.end_time + shaper.duration, abs=1e-12)


def test_a_shaper_that_does_nothing_changes_nothing():
    plain, end = driven([winding()], Timing())
    shaped, shaped_end = driven([winding()], Timing(path_shaper=NONE))
    assert shaped_end == end
    for name in ("position", "velocity", "acceleration", "arc_length"):
        assert_allclose(getattr(shaped, name), getattr(plain, name), atol=1e-9)


def test_what_it_holds_back_is_a_shaper_long():
    """Cells far behind are let go, however long the path is."""
    profile = plan(smooth(build_toolpath(winding()), Smoothing(0.01)), LIMITS)
    states = [state for state, _ in path_sampling(zv(Mode(42.0, 0.05)), T)(None, profile, True)]
    assert len(states[-1].path) < 0.2 * len(profile.path)


@pytest.mark.parametrize("size", [1, 2, 5])
def test_streamed_equals_whole_bit_for_bit(size):
    timing = Timing(0.01, zvd(Mode(31.0, 0.02)))
    whole, end = driven([winding()], timing)
    streamed, streamed_end = driven(cut(winding(), size), timing)
    assert end == streamed_end
    for name in ("position", "velocity", "acceleration", "arc_length"):
        assert_array_equal(getattr(streamed, name), getattr(whole, name))


def test_stops_on_the_way_rest_at_least_as_long_as_asked():
    """Two inner stops: at the exact one and, with a programmed wait of 50 ms, after the arc."""
    _, plain = driven([winding()], Timing())
    for seconds, longer in ((0.02, 0.02), (0.05, 0.05), (0.08, 0.08 + 0.03)):
        _, rested = driven([winding()], Timing(seconds))
        assert rested == pytest.approx(plain + longer, abs=1e-9)


def test_the_common_shaper_counts_equal_ones_once():
    x, y = zv(Mode(55.0, 0.05)), zv(Mode(42.0, 0.05))
    assert common_shaper({"x": x, "y": y}).times.size == 4
    assert_array_equal(common_shaper({"x": x, "y": zv(Mode(55.0, 0.05))}).times, x.times)


def test_cells_are_found_forwards_and_backwards():
    """Against the definition, also where a shaper runs back or beyond an end."""
    rng = np.random.default_rng(5)
    length = frozen(np.array([1.0, 0.5, 2.0, 0.0]))
    start = frozen(np.array([0.0, 1.0, 1.5, 3.5]))
    rows = frozen(rng.normal(size=(4, 4, 3)))
    u = frozen(rng.uniform(-0.2, 3.8, 200))
    v, a = frozen(rng.normal(size=200)), frozen(rng.normal(size=200))
    place, *got = along_path(u, v, a, start, length, rows, start, frozen(np.ones(4)))
    for mine, theirs in zip(got, naive.along_path(u, v, a, start, length, rows), strict=True):
        assert_allclose(mine, theirs, atol=1e-12)
    assert_allclose(place, np.clip(u, 0.0, 3.5))
