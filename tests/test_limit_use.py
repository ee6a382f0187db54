"""What the planned motion uses of the limits, along time and path, in memory that is fixed."""

from __future__ import annotations

import json
import re
import tracemalloc
from dataclasses import fields, replace

import naive
import numpy as np
import pytest
from motions import MILL, chunks, lines, wander
from numpy.testing import assert_allclose, assert_array_equal
from paths import dwell, line, toolpath
from runs import make_run
from test_path_limits import circle

from cnc_shape.api import simulate_program
from cnc_shape.arrays import frozen
from cnc_shape.certificate import worst_violation
from cnc_shape.config.bundled import bundled
from cnc_shape.config.machine_file import load_machine
from cnc_shape.feedrate import Profile
from cnc_shape.limit_use import Course, LimitUse, LimitWatch
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, Machine
from cnc_shape.motion import Block
from cnc_shape.planning import plan, planning
from cnc_shape.program import Motion
from cnc_shape.report.folder import write_report
from cnc_shape.report.limit_figures import DRAWN, limits_figure, speed_figure
from cnc_shape.report.limit_table import limits_json
from cnc_shape.report.style import render
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
    assert not use.rapid[-2:].any()
    assert use.speed[use.rapid].max() <= 200.0 + 1e-9


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


MIXED = [*GENTLE[:2], Limits(100.0, 1000.0)]  # no jerk limit in Z
SQUARE = toolpath(
    line(20.0, 0.0, 0.0, feed_rate=50.0), line(20.0, 10.0, 0.0, feed_rate=50.0),
    line(20.0, 10.0, 5.0, feed_rate=30.0),
    {"motion": Motion.RAPID, "target": (0.0, 0.0, 5.0), "feed_rate": np.inf},
)  # fmt: skip


def texts(figure) -> str:
    found = [text.get_text() for ax in figure.axes for text in (ax.title, ax.xaxis.label, ax.yaxis.label)]
    found += [ax.get_title(loc="left") for ax in figure.axes]
    found += [text.get_text() for ax in figure.axes for text in ax.texts]
    found += [text.get_text() for ax in figure.axes if ax.legend_ for text in ax.legend_.get_texts()]
    return "|".join(found)


@pytest.mark.parametrize("along_path", [False, True])
def test_three_panels_show_feed_acceleration_and_jerk_under_their_limits(along_path):
    use = watch([planned(SQUARE, MIXED)], MIXED)
    figure = limits_figure(use, along_path=along_path)
    said = texts(figure)
    for text in ("speed (mm/s)", "share of the limit (-)", "programmed feed", "X|Y|Z|limit", "none for Z"):
        assert text in said
    assert ("path length (mm)" if along_path else "time (s)") in said
    feed, acceleration, jerk = figure.axes
    assert [len(ax.lines) for ax in (acceleration, jerk)] == [4, 3]  # one an axis, and the limit
    for ax, name in ((acceleration, "acceleration"), (jerk, "jerk")):
        for drawn, axis in zip(ax.lines[:-1], use.axes, strict=False):
            assert max(drawn.get_ydata()) == pytest.approx(getattr(axis, name).share, rel=1e-6)
            assert len(drawn.get_ydata()) <= DRAWN
    programmed = next(shown for shown in feed.lines if shown.get_label() == "programmed feed")
    assert set(programmed.get_ydata()[np.isfinite(programmed.get_ydata())]) == {50.0, 30.0}
    svg = render(figure, "svg")
    assert len(svg) < 400_000
    assert render(limits_figure(use, along_path=along_path), "svg") == svg


def test_without_jerk_limits_the_panel_says_so():
    figure = limits_figure(watch([planned(SQUARE, MILL)], MILL))
    assert "no jerk limit" in texts(figure)
    assert len(figure.axes[2].lines) == 1


def test_the_path_is_coloured_by_its_speed_and_rapids_are_grey():
    use = watch([planned(SQUARE, MILL)], MILL)
    figure = speed_figure(use)
    rapids, cut_moves = figure.axes[0].collections
    assert len(rapids.get_segments()) == use.rapid.sum() > 0
    assert max(cut_moves.get_array()) == pytest.approx(50.0)
    assert cut_moves.norm.vmax == pytest.approx(50.0)
    assert "speed of the tool (mm/s)" in texts(figure)
    assert "X (mm)" in texts(figure)
    assert "rapids are grey" in texts(figure)


def test_a_long_path_becomes_a_picture_in_the_figure():
    path = wander(np.random.default_rng(11), 3000)
    svg = render(speed_figure(watch([planned(path, MILL)], MILL)), "svg")
    assert len(svg) < 600_000
    assert not re.search(rb'href="(?!#|data:image/png;base64,)', svg)


def test_mean_speeds_between_drawn_points_take_the_time_of_the_motion():
    profile = planned(wander(np.random.default_rng(13), 500), MILL)
    use = watch([profile], MILL, drawn=64)
    steps = np.linalg.norm(np.diff(use.path, axis=0), axis=1)
    moving = use.speed > 0.0
    time = (steps[moving] / use.speed[moving]).sum()
    assert time <= profile.end_time * (1.0 + 1e-6)
    course = use.over_time
    assert course.reached[-1] == pytest.approx(profile.path.arc_length[-1])
    assert use.along_path.reached[-1] == pytest.approx(profile.end_time)


def test_the_report_of_a_program_has_table_figures_and_numbers(tmp_path):
    setup = load_machine(bundled("xy_stage.yaml"))
    program = tmp_path / "part.nc"
    program.write_text("G21 G90\nG1 X10 F6000\nY5\nX0 F3000\n")
    run = simulate_program(program, setup, ["unshaped"])
    use = run.limit_use
    page = write_report(run, tmp_path / "run").read_text(encoding="utf-8")
    told = json.loads((tmp_path / "run" / "results.json").read_text())["planned"]
    assert told == limits_json(use)
    assert list(told) == ["x", "y", "feed_share", "feed_line"]
    assert told["x"]["acceleration_share"] == pytest.approx(1.0)
    assert told["x"]["velocity_share"] == pytest.approx(0.2)
    assert told["x"]["jerk_share"] is None
    assert told["x"]["lines"] == {"velocity": 2, "acceleration": 2, "jerk": None}
    assert told["feed_line"] == 2
    assert "against their limits" in page
    assert "The programmed feed is used up to 100.0 %, on line 2." in page
    assert page.count("Along the path instead of time") == 1
    names = {path.name for path in (tmp_path / "run" / "figures").iterdir()}
    assert {"limits.svg", "limits_along_path.svg", "speed.svg"} <= names


def test_a_time_trajectory_has_nothing_to_show_and_the_page_says_so(tmp_path):
    run = simulate_program(bundled("circle_time.csv"), load_machine(bundled("xy_stage.yaml")), ["unshaped"])
    assert run.limit_use is None
    page = write_report(run, tmp_path / "run").read_text(encoding="utf-8")
    assert "tells its own times: nothing was planned" in page
    assert "planned" not in json.loads((tmp_path / "run" / "results.json").read_text())
    assert not list((tmp_path / "run" / "figures").glob("limits*"))


def test_nothing_is_kept_where_nothing_is_recorded():
    assert make_run(60).limit_use is None
    setup = load_machine(bundled("xy_stage.yaml"))
    assert simulate_program(bundled("corner.nc"), setup, ["unshaped"], record=False).limit_use is None
