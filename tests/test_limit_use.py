"""What the planned motion uses of the limits, along time and path, in memory that is fixed."""

from __future__ import annotations

import tracemalloc
from dataclasses import fields, replace

import naive
import numpy as np
import pytest
from motions import MILL, chunks, lines, wander
from numpy.testing import assert_allclose, assert_array_equal
from paths import dwell, line, toolpath
from test_path_limits import circle

from cnc_shape.arrays import frozen
from cnc_shape.certificate import worst_violation
from cnc_shape.feedrate import Profile
from cnc_shape.limit_use import Course, LimitUse, LimitWatch
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, Machine
from cnc_shape.motion import Block
from cnc_shape.planning import plan, planning
from cnc_shape.smoothing import Smoothing, smooth, smoothing
from cnc_shape.timing import PLAIN, Timing
from cnc_shape.trajectory import sample

GENTLE = [Limits(200.0, 2000.0, 1e5)] * 3
FORMER = Timing(stop_dwell=0.1)
COURSE = ("fastest", "slowest", "feed_rate", "velocity", "acceleration", "jerk")


def machine(limits, axes=("x", "y", "z")) -> Machine:
    return Machine("mill", tuple(Axis(name, limits=limit) for name, limit in zip(axes, limits, strict=True)))


def watch(profiles, limits, moved=("x", "y", "z"), **buckets) -> LimitUse:
    """What is found where `profiles` come in turn."""
    watching = LimitWatch(machine(limits, profiles[0].path.axes), **buckets)
    for profile in profiles:
        watching.advance(block(profile, moved))
    found = watching.found()
    assert found is not None
    return found


def block(profile: Profile | None, moved=("x", "y", "z"), timing=PLAIN) -> Block:
    samples = sample(plan(smooth(lines([[0, 0], [1, 0]]), Smoothing(0.01)), MILL), 0.1)
    return Block(None, samples, False, 0.0, moved, timing, profile)


def planned(path, limits) -> Profile:
    return plan(smooth(path, Smoothing(0.01)), limits)


def assert_same(one, other):
    """Every number of two values, courses included, is the same."""
    for field in fields(one):
        a, b = getattr(one, field.name), getattr(other, field.name)
        if isinstance(a, Course):
            assert_same(a, b)
        elif isinstance(a, np.ndarray):
            assert_array_equal(a, b, err_msg=field.name)
        else:
            assert a == b, field.name


def test_a_straight_move_with_jerk_takes_acceleration_and_jerk_to_their_limits():
    use = watch([planned(toolpath(line(40.0, 0.0, 0.0, feed_rate=100.0)), GENTLE)], GENTLE, ("x",))
    (x,) = use.axes
    assert x.axis == "x"
    assert_allclose([x.velocity.share, x.acceleration.share, x.jerk.share], [0.5, 1.0, 1.0], rtol=1e-9)
    assert_allclose(use.feed.share, 1.0, rtol=1e-9)
    # acceleration j t up to a at t = a/j, held until the speed is v - a^2/2j, then let go
    course = use.over_time
    rise, hold = 2000.0 / 1e5, 100.0 / 2000.0
    expected = np.interp(course.at, [0.0, rise, hold, hold + rise, 1.0], [0.0, 1.0, 1.0, 0.0, 0.0])
    early = course.at < 0.2
    assert_allclose(course.acceleration[early, 0], expected[early], atol=course.width / rise)
    # along the path the speed is that of the distance from rest: s = j t^3/6 at first
    along = use.along_path
    begun = along.at < 1e5 * rise**3 / 6.0
    time = np.cbrt(6.0 * (along.at[begun] + 0.5 * along.width) / 1e5)
    assert_allclose(along.fastest[begun], 0.5e5 * time**2, rtol=1e-3)


def test_on_a_circle_an_axis_needs_v2_over_r_and_v3_over_r2():
    limits = [Limits(1e3, 1e4, 1e6)] * 3  # a law that knows no jerk, held against a jerk limit
    path, speed = circle(5.0, laps=2), 60.0
    feed_rate = frozen(np.full(len(path), speed))
    profile = plan(replace(path, feed_rate=feed_rate), [Limits(1e3, 1e4)] * 3)
    course = watch([profile], limits, ("x", "y")).over_time
    middle = slice(course.at.size // 4, -course.at.size // 4)
    assert_allclose(course.fastest[middle], speed, rtol=1e-4)
    assert_allclose(course.slowest[middle], speed, rtol=1e-4)
    assert_allclose(course.acceleration[middle].max(axis=0) * 1e4, speed**2 / 5.0, rtol=1e-3)
    assert_allclose(course.jerk[middle].max(axis=0) * 1e6, speed**3 / 25.0, rtol=0.02)


@pytest.mark.parametrize("limits", [MILL, GENTLE])
def test_the_largest_uses_are_those_of_the_certificate(limits):
    path = wander(np.random.default_rng(3), 300)
    profile = planned(path, limits)
    use, told = watch([profile], limits), worst_violation(profile, limits)
    assert max(axis.velocity.share for axis in use.axes) == told.velocity + 1.0
    assert_allclose(max(axis.acceleration.share for axis in use.axes), told.acceleration + 1.0, rtol=1e-15)
    assert_allclose(use.feed.share, told.feed + 1.0, rtol=1e-15)
    if limits is GENTLE:
        assert_allclose(max(axis.jerk.share for axis in use.axes), told.jerk + 1.0, rtol=1e-15)
    else:
        assert [axis.jerk for axis in use.axes] == [None] * 3


def test_a_peak_names_its_line():
    path = toolpath(
        line(30.0, 0.0, 0.0, feed_rate=100.0), line(30.0, 1.0, 0.0), dwell(0.1),
        line(30.0, 31.0, 0.0, feed_rate=150.0), line(30.0, 31.0, 30.0, feed_rate=60.0),
    )  # fmt: skip
    x, y, z = watch([planned(path, MILL)], MILL).axes
    assert [(axis.velocity.line, round(axis.velocity.share, 6)) for axis in (x, y, z)] == [
        (1, 0.5), (4, 0.75), (5, 0.3),
    ]  # fmt: skip


def test_buckets_hold_what_the_definition_says():
    """Between nine points a piece, the least that is looked at, and very many."""
    profile = planned(wander(np.random.default_rng(5), 120), GENTLE)
    use = watch([profile], GENTLE, buckets=16)
    course = use.over_time
    limits = [[getattr(limit, name) for limit in GENTLE] for name in ("velocity", "acceleration", "jerk")]
    found = np.hstack(
        [np.column_stack([course.fastest, -course.slowest])]
        + [getattr(course, name) * limit for name, limit in zip(COURSE[3:], limits, strict=True)]
    )
    least, most = (naive.limit_use(profile, points, course.width, len(found)) for points in (9, 4001))
    slack = 1e-7 * np.abs(most).max(axis=0)
    assert (least <= found + slack).all()
    assert (found <= most + slack).all()
    assert len(found) > 8


@pytest.mark.parametrize("limits", [MILL, GENTLE])
def test_a_move_that_spans_all_buckets_is_seen_in_each_of_them(limits):
    use = watch([planned(toolpath(line(100.0, 0.0, 0.0)), limits)], limits)
    for course in (use.over_time, use.along_path):
        assert course.at.size > 2000
        assert np.isfinite(course.fastest).all()
        assert course.fastest[course.at.size // 2] == pytest.approx(20.0)


@pytest.mark.parametrize(("limits", "sizes"), [(MILL, (1,)), (MILL, (0, 7, 64)), (GENTLE, (50,))])
def test_streamed_is_whole(limits, sizes):
    parts = chunks(wander(np.random.default_rng(7), 400), [size for size in sizes if size] or [1])
    smooth_step, plan_step = smoothing(Smoothing(0.01)), planning(limits)
    smoothed = law = None
    profiles = []
    for number, part in enumerate(parts, 1):
        smoothed, path = smooth_step(smoothed, part, number == len(parts))
        law, profile = plan_step(law, path, number == len(parts))
        profiles.append(profile)
    one = planned(wander(np.random.default_rng(7), 400), limits)
    assert_same(watch(profiles, limits), watch([one], limits))
    assert_same(watch(profiles, limits), watch(cut(one, 5), limits))


def cut(profile: Profile, size: int) -> list[Profile]:
    """The same law, a few pieces at a time."""
    columns = ("time", "duration", "u", "velocity", "acceleration", "jerk", "cell")
    return [
        Profile(profile.path, *(getattr(profile, name)[low : low + size] for name in columns))
        for low in range(0, len(profile), size)
    ]


def test_only_the_plain_motion_counts():
    slow = planned(toolpath(line(40.0, 0.0, 0.0, feed_rate=10.0)), MILL)
    fast = planned(toolpath(line(40.0, 0.0, 0.0, feed_rate=100.0)), MILL)
    watching = LimitWatch(machine(MILL))
    watching.advance(block(fast, timing=FORMER))
    assert watching.found() is None
    watching.advance(block(slow))
    watching.advance(block(None))
    watching.advance(block(fast, timing=FORMER))
    assert watching.found().axes[0].velocity.share == pytest.approx(0.05)


def test_rapids_have_no_feed_and_rotary_axes_alone_no_speed():
    limits = [*MILL, Limits(3.0, 30.0)]
    path = lines(
        [[0, 0, 0, 0], [20, 0, 0, 0], [20, 0, 0, 1.0], [0, 0, 0, 1.0]], [np.inf, 2.0, 50.0],
        axes=("x", "y", "z", "a"),
    )  # fmt: skip
    use = watch([planned(path, limits)], limits, ("x", "a"))
    assert [axis.axis for axis in use.axes] == ["x", "a"]
    assert use.axes[1].velocity.share == pytest.approx(2.0 / 3.0)
    course = use.over_time
    assert np.isinf(course.feed_rate[:100]).all()
    turning = course.velocity[:, 1] > 0.0
    assert np.nanmax(course.fastest[turning][1:-1]) == pytest.approx(0.0, abs=1e-3)
    assert np.isnan(course.feed_rate[turning][1:-1]).all()
    assert course.feed_rate[-2] == 50.0
    assert use.rapid[0]
    assert not use.rapid[-2]  # the last point is the rest at the end


def test_memory_does_not_grow_with_the_program():
    """The same law over and over, each time later: what is held after a thousand times is what one takes."""
    one = planned(wander(np.random.default_rng(9), 400), MILL)
    watching, held = LimitWatch(machine(MILL), buckets=256, drawn=64), []
    tracemalloc.start()
    for lap in range(1000):
        watching.add(replace(one, time=frozen(one.time + lap * one.end_time)))
        if lap in (0, 999):
            held.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert held[1] - held[0] < 10_000
    watching.advance(block(one))
    assert watching.found().over_time.at.size <= 256
