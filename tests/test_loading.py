"""Loading: load torques over the axes at every tick, along axes and along the moving frame of the path."""

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import MILL, streamed, wander
from numpy.testing import assert_allclose, assert_array_equal
from paths import arc, line, toolpath

from cnc_shape.arrays import frozen
from cnc_shape.disturbances import (
    Disturbances,
    LoadTorque,
    PathDirection,
    ProfileTable,
    Pulses,
    SineBurst,
    Steps,
    value,
)
from cnc_shape.kernels.frames import FRAME_SIZE, path_frames
from cnc_shape.loading import STILL, STILL_ROUNDED, WINDOW, loading
from cnc_shape.modes import Mode
from cnc_shape.program import PathMode
from cnc_shape.shapers.shaping import shape
from cnc_shape.shapers.zero_vibration import zv
from cnc_shape.trajectory import Trajectory

NORMAL, TANGENT, BINORMAL = PathDirection.NORMAL, PathDirection.TANGENT, PathDirection.BINORMAL
LEVEL = np.eye(3)
ALWAYS = Steps((0.0,), (1.0,))
PERIOD = 1e-3
XYZ = ("x", "y", "z")
F3 = SineBurst(0.514, 6.91, 9.4)  # spec: inertia compensation, section 2


def command(position, velocity, acceleration, axes=XYZ, replayed=False):
    place = frozen(np.zeros(len(position)))
    arrays = (frozen(position), frozen(velocity), frozen(acceleration))
    return Trajectory(axes, PERIOD, place, *arrays, replayed=replayed, rounded=replayed)


def straight(direction, samples, speed=20.0):
    """Steady motion from the origin."""
    velocity = np.tile(speed * np.asarray(direction, float) / np.linalg.norm(direction), (samples, 1))
    return command(velocity * np.arange(samples)[:, None] * PERIOD, velocity, np.zeros_like(velocity))


def circle(samples, radius=50.0, speed=1000.0 / 60.0, plane=LEVEL, ramp=1e-9):
    """Round the origin in the first two columns of `plane`, from rest over `ramp` s, or steady at once."""
    t = np.arange(samples) * PERIOD + (ramp if ramp < PERIOD else 0.0)
    share = np.minimum(t / ramp, 1.0)
    rate = speed * np.sin(np.pi / 2 * share) ** 2
    change = np.where(share < 1.0, speed * np.pi / (2 * ramp) * np.sin(np.pi * share), 0.0)
    gone = speed * (ramp * (share / 2 - np.sin(np.pi * share) / (2 * np.pi)) + np.maximum(t - ramp, 0.0))
    phi = gone / radius
    outward = np.stack([np.cos(phi), np.sin(phi), 0 * t], axis=1) @ plane.T
    along = np.stack([-np.sin(phi), np.cos(phi), 0 * t], axis=1) @ plane.T
    return command(
        radius * outward,
        rate[:, None] * along,
        change[:, None] * along - (rate**2 / radius)[:, None] * outward,
    )


def replayed(whole, digits):
    """A time table of a command: positions rounded, velocity and acceleration their differences."""
    position = np.round(whole.position, digits)
    velocity = np.gradient(position, PERIOD, axis=0)
    return command(position, velocity, np.gradient(velocity, PERIOD, axis=0), whole.axes, replayed=True)


def joined(*parts):
    position, velocity, acceleration = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("position", "velocity", "acceleration")
    )
    return command(position, velocity, acceleration, parts[0].axes)


def rest(samples):
    return command(*[np.zeros((samples, 3))] * 3)


def steady(direction, axes=XYZ, ticks=1):
    """A load of 1 N m along one direction for ever."""
    return loading(Disturbances((LoadTorque(direction, 1.0, ALWAYS),)), axes, PERIOD, ticks)


def directions(direction, whole):
    """The direction of every sample, (n,3)."""
    return steady(direction, whole.axes)(None, whole, len(whole))[1][:, 0]


TILTED = np.array([[1.0, 1.0, 1.0], [0.0, 2.0**0.5, -(2.0**0.5)], [-1.0, 1.0, 1.0]])
TILTED = np.linalg.qr(TILTED)[0]  # orthonormal, any plane but those of the axes
PLANES = [LEVEL, np.eye(3)[[1, 0, 2]], np.eye(3)[[2, 0, 1]], TILTED]


# --- directions ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("plane", PLANES)
def test_on_a_circle_the_normal_is_outward_and_the_binormal_its_axis(plane):
    whole = circle(2000, plane=plane)
    outward = whole.position / 50.0
    along = whole.velocity / np.linalg.norm(whole.velocity, axis=1)[:, None]
    assert_allclose(directions(NORMAL, whole), outward, atol=1e-12)
    assert_allclose(directions(TANGENT, whole), along, atol=1e-15)
    assert_allclose(directions(BINORMAL, whole), np.cross(along, -outward), atol=1e-12)
    axis = np.cross(plane[:, 0], plane[:, 1])
    assert_allclose(directions(BINORMAL, whole), np.tile(axis, (2000, 1)), atol=1e-12)


def test_on_a_helix_the_normal_is_outward_and_the_binormal_climbs():
    radius, pitch, omega = 8.0, 3.0, 2.0  # mm, mm/rad, rad/s
    phi = omega * np.arange(500) * PERIOD
    cosine, sine, one = np.cos(phi), np.sin(phi), np.ones_like(phi)
    outward = np.stack([cosine, sine, 0 * one], axis=1)
    velocity = omega * np.stack([-radius * sine, radius * cosine, pitch * one], axis=1)
    binormal = np.stack([pitch * sine, -pitch * cosine, radius * one], axis=1) / np.hypot(radius, pitch)
    whole = command(
        radius * outward + pitch * phi[:, None] * [0, 0, 1], velocity, -radius * omega**2 * outward
    )
    assert_allclose(directions(NORMAL, whole), outward, atol=1e-12)
    assert_allclose(directions(BINORMAL, whole), binormal, atol=1e-12)


@pytest.mark.parametrize(
    ("along", "normal"),
    [((1, 0, 0), (0, 1, 0)), ((0, -1, 0), (1, 0, 0)), ((3, 4, 5), (-0.8, 0.6, 0)),
     ((0, 0, 1), (0, -1, 0)), ((0, 0, -2), (0, 1, 0))],
)  # fmt: skip
def test_before_any_curve_the_normal_is_level_to_the_left(along, normal):
    whole = straight(along, 10)
    assert_allclose(directions(NORMAL, whole), np.tile(normal, (10, 1)), atol=1e-15)
    unit = np.asarray(along) / np.linalg.norm(along)
    assert_allclose(
        directions(BINORMAL, whole), np.tile(np.cross(unit, -np.asarray(normal)), (10, 1)), atol=1e-15
    )


def test_on_a_straight_line_after_a_curve_the_normal_stays():
    bend = circle(1000)
    line = straight(bend.velocity[-1], 500)
    normal = directions(NORMAL, joined(bend, line, rest(50)))
    assert_allclose(normal[1000:], np.tile(bend.position[-1] / 50.0, (550, 1)), atol=1e-12)


def test_the_normal_is_carried_along_without_a_twist():
    # a clockwise quarter ends along -y with its normal along +x; corners then turn it as they turn the path
    quarter = circle(4713, plane=np.diag([1.0, -1.0, 1.0]))
    last = quarter.velocity[-1] / np.linalg.norm(quarter.velocity[-1])
    out = quarter.position[-1] / 50.0
    up = np.array([0.0, 0.0, 1.0])
    whole = joined(quarter, straight(up, 10), straight(out, 10), straight(-last, 10), straight(last, 10))
    normal = directions(NORMAL, whole)[len(quarter) :]
    assert_allclose(normal[:10], np.tile(out, (10, 1)), atol=1e-12)  # across the corner's plane: stays
    assert_allclose(normal[10:20], np.tile(-up, (10, 1)), atol=1e-12)  # in it: turns with the path
    assert_allclose(normal[20:30], np.tile(-up, (10, 1)), atol=1e-12)
    assert_allclose(normal[30:], np.tile(-up, (10, 1)), atol=1e-12)  # the way back


def test_a_bend_the_other_way_turns_the_normal_over():
    one = circle(800)
    other = command(one.position, one.velocity[-1:] + one.velocity[:1] - one.velocity[::-1], one.acceleration)
    whole = joined(
        one, command(one.position, one.velocity[::-1], -one.acceleration[::-1]), other.cut(slice(0, 0))
    )
    assert_allclose(directions(NORMAL, whole)[800:], -one.position[::-1] / 50.0, atol=1e-12)


@pytest.mark.parametrize("direction", PathDirection)
def test_before_the_first_motion_there_is_no_direction_and_at_rest_the_last_one_holds(direction):
    moving = circle(300, plane=TILTED)
    told = directions(direction, joined(rest(20), moving, rest(40), moving))
    assert not told[:20].any()
    assert_array_equal(told[320:360], np.tile(told[319], (40, 1)))
    assert_array_equal(told[360:], told[20:320])


def test_from_rest_the_normal_is_right_before_the_path_has_turned_by_a_microradian():
    whole = circle(200, ramp=0.1)
    normal = directions(NORMAL, whole)
    right = np.linalg.norm(normal - whole.position / 50.0, axis=1) < 1e-9
    assert right[2:].all()
    assert not normal[0].any()


@pytest.mark.parametrize("shares", [(1.0, 1.0, 1.0), (0.0, 1e-3, 2.0)])
def test_rounding_near_rest_is_no_curve(shares):
    # along a line in space, from a crawl to a stop: acceleration lies along the velocity but for rounding
    along = np.array(shares) / np.linalg.norm(shares)
    speed = 10.0 ** -np.arange(0.0, 12.0, 0.01)
    whole = command(
        np.zeros((speed.size, 3)), speed[:, None] * along, -1000.0 * (along + 1e-15 * np.cos(np.arange(3.0)))
        * np.ones((speed.size, 1)),
    )  # fmt: skip
    level = np.cross([0, 0, 1], along)
    assert_allclose(
        directions(NORMAL, whole), np.tile(level / np.linalg.norm(level), (speed.size, 1)), atol=1e-9
    )


def test_on_a_planned_circle_the_normal_is_outward():
    # the planner's curves stand in for the arc within its tolerance, and bend as it does
    stop = PathMode.EXACT_STOP
    moves = line(50, 0, 0, mode=stop), arc((50, 0, 0), (0, 0, 0), 2.0 * np.pi, mode=stop)
    columns, _ = streamed([toolpath(*moves)], MILL)
    whole = command(*[columns[f"Trajectory.{name}"] for name in ("position", "velocity", "acceleration")])
    place = columns["Trajectory.arc_length"]
    round_ = (place > 50.1) & (place < 50.0 + 100.0 * np.pi - 0.1)
    assert_allclose(directions(NORMAL, whole)[round_], whole.position[round_] / 50.0, atol=3e-3)


def test_every_direction_has_unit_length():
    columns, _ = streamed([wander(np.random.default_rng(5), 400)], MILL)
    whole = command(*[columns[f"Trajectory.{name}"] for name in ("position", "velocity", "acceleration")])
    first = int(np.argmax(np.linalg.norm(whole.velocity, axis=1) > STILL))
    for direction in PathDirection:
        length = np.linalg.norm(directions(direction, whole), axis=1)
        assert not length[:first].any()
        assert_allclose(length[first:], 1.0, rtol=5e-16)


# --- time tables --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("digits", "error"), [(12, 1e-9), (6, 2e-4), (5, 2e-3), (4, 2e-2)])
@pytest.mark.parametrize("plane", [LEVEL, TILTED])
def test_the_normal_of_a_replayed_circle_is_not_noise(digits, error, plane):
    whole = circle(3000, plane=plane)
    normal = directions(NORMAL, replayed(whole, digits))
    settled = slice(round(3 * WINDOW / PERIOD), -1)  # the last velocity is a one-sided difference
    away = np.linalg.norm(normal - whole.position / 50.0, axis=1)[settled]
    assert away.max() < error if plane is LEVEL else away.max() < max(20 * error, 0.01)


@pytest.mark.parametrize("digits", [3, 4, 5, 6])
def test_the_rounding_of_a_replayed_line_is_no_curve(digits):
    rng = np.random.default_rng(1)
    for _ in range(10):
        whole = replayed(straight(rng.normal(size=3), 2000), digits)
        turned = directions(NORMAL, whole)[1:] - directions(NORMAL, whole)[:-1]
        assert np.linalg.norm(turned[1:-1], axis=1).max() < 0.2 * 10.0 ** (3 - digits)


@pytest.mark.parametrize("digits", [4, 6])
def test_the_rounding_of_a_shaped_line_is_hardly_ever_a_curve(digits):
    """A shaper knows its own velocity, which does not make the positions any finer."""
    shaper, flips = zv(Mode(30.0, 0.02)), 0
    for seed in range(5):
        whole = replayed(straight(np.random.default_rng(seed).normal(size=3), 2000), digits)
        told = shape(whole, dict.fromkeys(XYZ, shaper))
        assert not told.replayed
        turned = np.diff(directions(NORMAL, told), axis=0)
        flips += int((np.linalg.norm(turned, axis=1) > 0.2 * 10.0 ** (3 - digits)).sum())
    assert flips < 0.01 * 5 * 2000  # of all samples; taken for exact, nearly all would be


def test_a_single_corner_of_a_replayed_path_is_no_curve():
    whole = joined(straight((1, 0, 0), 200), straight((0, 1, 0), 200))
    told = command(whole.position, whole.velocity, whole.acceleration, replayed=True)
    assert_allclose(directions(NORMAL, told)[200:], np.tile((-1.0, 0.0, 0.0), (200, 1)), atol=1e-12)


def test_a_replayed_corner_from_rest_is_no_curve():
    whole = joined(straight((1, 0, 0), 200), rest(20), straight((0, 1, 0), 200))
    told = command(whole.position, whole.velocity, whole.acceleration, replayed=True)
    assert_allclose(directions(NORMAL, told)[220:], np.tile((-1.0, 0.0, 0.0), (200, 1)), atol=1e-12)


# --- torques ------------------------------------------------------------------------------------------


def test_the_torque_follows_its_profile_from_tick_to_tick():
    whole, ticks = circle(19000), 4
    step = loading(Disturbances((LoadTorque(NORMAL, 2.5, F3),)), XYZ, PERIOD, ticks)
    torque = step(None, whole, len(whole))[1]
    t = (np.arange(len(whole) * ticks) * PERIOD / ticks).reshape(-1, ticks)
    expected = 2.5 * value(F3, t)[..., None] * (whole.position / 50.0)[:, None]
    assert_allclose(torque, expected, atol=1e-9)
    assert_allclose(np.linalg.norm(torque, axis=2).max(), 2.5, rtol=1e-6)


def test_loads_add_up():
    one = LoadTorque("x", 2.0, Steps((0.1,), (1.0,)))
    other = LoadTorque(TANGENT, -0.5, Pulses(0.05, 0.02, 0.1, 0.0, (1.0,)))
    whole = circle(400)

    def torque(*loads):
        return loading(Disturbances(loads), XYZ, PERIOD, 4)(None, whole, 400)[1]

    assert_allclose(torque(one, other), torque(one) + torque(other), atol=1e-15)
    assert not torque().any()
    assert torque().shape == (400, 4, 3)


def test_a_load_along_an_axis_is_on_that_axis_alone_even_at_rest():
    axes = ("c", "z", "x")
    whole = command(*[np.zeros((5, 3))] * 3, axes=axes)
    for name in axes:
        expected = np.tile([float(axis == name) for axis in axes], (5, 2, 1))
        assert_array_equal(steady(name, axes, 2)(None, whole, 5)[1], expected)
    assert not steady("y", axes, 2)(None, whole, 5)[1].any()  # a program without y


def test_directions_find_their_axes_by_name():
    plain = circle(100, plane=TILTED)
    axes, order = ("b", "z", "x", "y"), [2, 0, 1]
    arrays = [
        np.hstack([np.full((100, 1), 7.0), values[:, order]])
        for values in (plain.position, plain.velocity, plain.acceleration)
    ]
    for direction in PathDirection:
        told = steady(direction, axes)(None, command(*arrays, axes=axes), 100)[1][:, 0]
        assert_array_equal(told[:, 1:], directions(direction, plain)[:, order])
        assert not told[:, 0].any()


def test_a_plane_command_has_its_normal_in_the_plane():
    whole = circle(100)
    flat = command(*[v[:, :2] for v in (whole.position, whole.velocity, whole.acceleration)], axes=("x", "y"))
    assert_allclose(directions(NORMAL, flat), whole.position[:, :2] / 50.0, atol=1e-12)
    assert not directions(BINORMAL, flat).any()  # across the plane nothing can move


def test_a_command_of_other_axes_or_too_few_samples_is_refused():
    with pytest.raises(ValueError, match="axes"):
        steady("x", ("x", "y"))(None, circle(3), 3)
    with pytest.raises(ValueError, match="rows"):
        steady("x")(None, circle(3), 4)


# --- chunks -------------------------------------------------------------------------------------------

EVERYTHING = Disturbances(
    (
        LoadTorque(NORMAL, 2.5, SineBurst(3.0, 0.8, 0.5)),
        LoadTorque(TANGENT, -1.0, Pulses(0.05, 0.02, 0.1, 0.03, (1.0, -0.5, 2.0))),
        LoadTorque(BINORMAL, 0.3, ProfileTable((0.0, 0.3, 2.0), (1.0, -1.0, 0.5))),
        LoadTorque("y", 1.0, Steps((0.1, 0.2), (1.0, -2.0))),
    )
)


def varied(table):
    """Curves, lines, corners, and rests before, between and after."""
    bend, other = circle(150, plane=TILTED, ramp=0.05), circle(90)
    whole = joined(
        rest(5), straight((1, 2, 0), 40), bend, straight(bend.velocity[-1], 60), rest(7), straight((0, 0, 1), 20),
        straight((0, 1, 0), 30), other, rest(9),
    )  # fmt: skip
    if not table:
        return whole
    position = np.round(np.cumsum(whole.velocity, axis=0) * PERIOD, 5)
    velocity = np.gradient(position, PERIOD, axis=0)
    return command(position, velocity, np.gradient(velocity, PERIOD, axis=0), replayed=True)


@pytest.mark.parametrize("table", [False, True])
@settings(max_examples=30)
@given(sizes=st.lists(st.integers(0, 60), min_size=1, max_size=8).filter(any), extra=st.integers(0, 3))
def test_chunks_make_no_difference(table, sizes, extra):
    whole = varied(table)
    step = loading(EVERYTHING, XYZ, PERIOD, 4)
    ended, expected = step(None, whole, len(whole))
    state, parts, first = None, [], 0
    while first < len(whole):
        for size in sizes:
            chunk = whole.cut(slice(first, first + size + extra))  # the samples beyond come again
            rows = min(size, len(chunk))
            state, torque = step(state, chunk, rows)
            parts.append(torque)
            first += rows
    assert_array_equal(np.concatenate(parts).view(np.int64), expected.view(np.int64))
    assert state.samples == ended.samples == len(whole)
    assert_array_equal(state.frame, ended.frame)
    assert_array_equal(step.at_rest(state, 50), step.at_rest(ended, 50))


def test_one_sample_a_chunk_makes_no_difference():
    whole, step = varied(True), loading(EVERYTHING, XYZ, PERIOD, 4)
    state, parts = None, []
    for k in range(len(whole)):
        state, torque = step(state, whole.cut(slice(k, k + 2)), 1)
        parts.append(torque)
    assert_array_equal(np.concatenate(parts).view(np.int64), step(None, whole, len(whole))[1].view(np.int64))


def test_at_rest_goes_on_as_a_command_that_rests():
    step = loading(EVERYTHING, XYZ, PERIOD, 4)
    bend = circle(300)
    ended, _ = step(None, bend, 300)
    expected = step(None, joined(bend, rest(400)), 700)[1][300:]
    assert_array_equal(step.at_rest(ended, 400), expected)
    assert expected.any()


def test_nothing_in_is_nothing_out():
    step = loading(EVERYTHING, XYZ, PERIOD, 4)
    state, torque = step(None, circle(3), 0)
    assert torque.shape == (0, 4, 3)
    assert state.samples == 0
    assert not step.at_rest(state, 20)[:, :, [0, 2]].any()  # no motion, no direction
    assert_array_equal(step(state, circle(3), 3)[1], step(None, circle(3), 3)[1])


# --- the slow twin ------------------------------------------------------------------------------------


def both(whole):
    """Frames by the kernel and by its twin."""
    share, still = (1.0 - np.exp(-PERIOD / WINDOW), STILL_ROUNDED) if whole.rounded else (0.0, STILL)
    frames = np.zeros((len(whole), 3, 3))
    arrays = whole.velocity.copy(), whole.acceleration.copy()
    path_frames(*arrays, PERIOD, still, share, np.zeros(FRAME_SIZE), frames)
    return frames, naive.path_frames(*arrays, PERIOD, still, share)


@pytest.mark.parametrize("table", [False, True])
def test_frames_are_those_of_the_slow_twin(table):
    assert_allclose(*both(varied(table)), atol=1e-9)


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("digits", [None, 9, 6])
def test_frames_of_programs_are_those_of_the_slow_twin(seed, digits):
    columns, _ = streamed([wander(np.random.default_rng(seed), 60)], MILL)
    whole = command(
        *[columns[f"Trajectory.{name}"][:2000] for name in ("position", "velocity", "acceleration")]
    )
    assert_allclose(*both(whole if digits is None else replayed(whole, digits)), atol=1e-7)
