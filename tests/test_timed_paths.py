"""Time tables as commands and as paths: differences, splines, circles, and what a loop makes of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from answers import answer
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from programs import from_memory
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline

from cnc_shape.arrays import frozen
from cnc_shape.contour import contour_error
from cnc_shape.controllers import Control, CrossCoupling, Estimator, Feedforward
from cnc_shape.errors import CncShapeError, InfeasibleError, ProgramError
from cnc_shape.kinematics import cubic_parallel, cubic_rails
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, FirstOrderLag, Machine
from cnc_shape.program import Motion
from cnc_shape.readers import Curve, ReadingOptions, table_reading, timed_spline
from cnc_shape.readers.trajectories import rates, resample
from cnc_shape.segments import segments
from cnc_shape.simulation import simulate, simulating
from cnc_shape.toolpath import build_toolpath
from cnc_shape.windows import foot_reach, foot_windows

T = 1e-3
POLYLINE, SPLINE, CIRCLE = Curve.POLYLINE, Curve.SPLINE, Curve.CIRCLE


def table(time, columns, digits=9) -> str:
    """A time table with columns in the order given."""
    rows = np.column_stack([time, *columns.values()]).tolist()
    text = "\n".join(",".join(f"{value:.{digits}f}" for value in row) for row in rows)
    return ",".join(["time_s", *columns]) + "\n" + text + "\n"


def path_of(text, curve=POLYLINE, closed=False):
    return table_reading(from_memory(text, name="t.csv"), ReadingOptions(curve=curve, closed=closed)).timed


def command_of(text, period=T, curve=POLYLINE, closed=False):
    return resample(path_of(text, curve, closed), period, samples=10**6)


# differences


def test_rates_of_a_circle_are_its_tangent_and_its_curvature():
    angle = 0.02 * np.arange(50)
    position = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    velocity, acceleration = rates(position, 1e-2)
    inner = slice(1, -1)
    tangent = np.column_stack([-np.sin(angle), np.cos(angle), 0 * angle])
    assert_allclose(velocity[inner], 2.0 * math.sin(0.02) / 0.02 * tangent[inner], atol=1e-12)
    assert_allclose(acceleration[inner], -4.0 * (math.sin(0.01) / 0.01) ** 2 * position[inner], atol=1e-10)
    for end in (0, -1):
        assert not velocity[end].any()
        assert not acceleration[end].any()


def test_rates_at_a_corner_are_those_of_arriving():
    turned = math.radians(21.0)
    ahead = np.array([math.cos(turned), math.sin(turned), 0.0])
    position = np.array([[-2.0, 0, 0], [-1.0, 0, 0], [0, 0, 0], 3.0 * ahead, 6.0 * ahead])
    velocity, acceleration = rates(position, 1.0)
    assert_allclose(velocity[1:4], [[1, 0, 0], [1, 0, 0], 3.0 * ahead], atol=1e-15)
    along = 3.0 * math.cos(turned) - 1.0
    assert_allclose(acceleration[1:4], [[0, 0, 0], [along, 0, 0], [0, 0, 0]], atol=1e-15)


def test_rates_where_the_motion_turns_back_tell_the_whole_acceleration():
    position = np.array([[0.0, 0, 0], [1, 2, 0], [0, 0, 0], [1, 2, 0]])
    velocity, acceleration = rates(position, 1.0)
    assert_allclose(velocity[1:3], [[1, 2, 0], [-1, -2, 0]], atol=1e-15)
    assert_allclose(acceleration[1:3], [[-2, -4, 0], [2, 4, 0]], atol=1e-15)


def test_rates_of_a_bend_below_the_angle_of_a_corner_are_central():
    turned = math.radians(19.0)
    ahead = np.array([math.cos(turned), math.sin(turned), 0.0])
    position = np.array([[-1.0, 0, 0], [0, 0, 0], ahead])
    velocity, acceleration = rates(position, 1.0)
    assert_allclose(velocity[1], (np.array([1.0, 0, 0]) + ahead) / 2.0)
    assert_allclose(acceleration[1], ahead - [1.0, 0, 0])


def test_rates_where_a_side_is_at_rest_are_the_mean():
    position = np.array([[0.0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 1, 0], [1, 2, 0]])
    velocity, _ = rates(position, 1.0)
    assert_allclose(velocity[1:4], [[0.5, 0, 0], [0.5, 0, 0], [0, 0.5, 0]])


def test_rates_of_axes_that_only_turn():
    position = np.zeros((4, 4))
    position[:, 3] = [0.0, 1.0, 3.0, 2.0]
    velocity, acceleration = rates(position, 1.0)
    assert velocity[:, 3].tolist() == [0.0, 1.5, 0.5, 0.0]
    assert acceleration[:, 3].tolist() == [0.0, 1.0, -3.0, 0.0]


# the specification's table, from files: contour control, section 5

FEED, ALONG, DWELL = 16.0, 160.0, 0.5  # mm/s, mm/s^2, s
PLANTS = tuple(
    FirstOrderLag(tau, gain)
    for tau, gain in (
        (0.0153, 0.9930), (0.0142, 0.9982), (0.0160, 0.9755), (0.0126, 1.0029), (0.0138, 1.0004),
        (0.0151, 0.9901),
    )
)  # fmt: skip
AHEAD = Feedforward(1.0, 1.0, 0.0148, 1.0)
TANGENT, FOOT = Estimator.TANGENT, Estimator.FOOT_POINT
LAWS = {
    "A": (None, None),
    "B": (None, CrossCoupling(10.0, TANGENT)),
    "B40": (None, CrossCoupling(40.0, TANGENT)),
    "C": (None, CrossCoupling(80.0, FOOT)),
    "D": (AHEAD, None),
    "E": (AHEAD, CrossCoupling(80.0, TANGENT)),
    "F": (AHEAD, CrossCoupling(80.0, FOOT)),
    "G": (AHEAD, CrossCoupling(80.0, FOOT, 800.0, 1.16)),
}
EXPECTED = {  # rms / max, um, of A B B40 C D E F G
    ("circle20", "cartesian"): "6.25/8.5 1.47/2.6 8.31/9.4 1.25/1.7 1.46/2.3 0.29/0.5 0.29/0.5 0.06/0.2",
    ("circle20", "cubic"): "7.00/10.3 1.53/2.7 8.09/9.8 1.69/2.6 2.18/4.0 0.44/0.8 0.44/0.8 0.08/0.2",
    ("circle5", "cartesian"): "24.01/27.9 4.41/6.8 32.77/35.5 4.88/5.7 1.81/3.1 0.38/0.8 0.38/0.8 0.24/0.6",
    ("circle5", "cubic"): "26.32/32.1 3.17/6.1 31.68/35.3 5.42/7.2 3.91/7.1 0.81/1.5 0.81/1.5 0.39/1.0",
    ("diamond_through", "cartesian"): "18.13/202.6 10.13/139.1 12.61/129.9 13.90/156.5 2.37/10.1 0.66/7.2 0.66/7.2 0.37/4.8",
    ("diamond_through", "cubic"): "19.11/211.0 10.40/144.9 11.25/120.9 14.22/159.7 4.00/28.2 1.37/20.2 1.37/20.2 0.86/13.5",
    ("lemniscate", "cartesian"): "8.44/14.0 1.81/3.7 11.25/17.7 1.70/2.8 1.63/2.4 0.33/0.5 0.33/0.5 0.08/0.3",
    ("lemniscate", "cubic"): "9.59/16.4 1.70/3.5 10.85/17.9 2.15/3.6 2.62/4.8 0.53/1.0 0.53/1.0 0.12/0.5",
}  # fmt: skip
DIAMOND = np.array([(15.0, 15.0), (0.0, 30.0), (-30.0, 0.0), (0.0, -30.0), (30.0, 0.0), (15.0, 15.0)])


def circle(radius, laps):
    return 2 * np.pi * radius * laps, lambda s: radius * np.array([np.cos(s / radius), np.sin(s / radius)])


def diamond():
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(DIAMOND, axis=0).T))])
    return along[-1], lambda s: np.array([np.interp(s, along, column) for column in DIAMOND.T])


def lemniscate(a=30.0):
    u = np.linspace(0.0, 2 * np.pi, 200_001)
    along = np.concatenate([[0.0], cumulative_simpson(a / np.sqrt(1.0 + np.sin(u) ** 2), x=u)])

    def at(s):
        w = np.interp(s, along, u)
        return a * np.array([np.cos(w), np.sin(w) * np.cos(w)]) / (1.0 + np.sin(w) ** 2)

    return along[-1], at


CONTOURS = {
    "circle20": circle(20.0, 1), "circle5": circle(5.0, 3), "diamond_through": diamond(),
    "lemniscate": lemniscate(),
}  # fmt: skip


def replayed(contour: str, order=("x_mm", "y_mm"), digits=9) -> str:
    """A contour at constant feed, from rest to rest and a dwell at its end, as a table every millisecond."""
    length, at = CONTOURS[contour]
    ramp = FEED / ALONG
    end = length / FEED + ramp
    time = T * np.arange(math.ceil((end + DWELL) / T - 1e-9) + 1)
    place = np.where(time < ramp, 0.5 * ALONG * time**2, FEED * (time - 0.5 * ramp))
    place = np.where(time > end - ramp, length - 0.5 * ALONG * np.maximum(end - time, 0.0) ** 2, place)
    columns = dict(zip(("x_mm", "y_mm"), at(place), strict=True))
    return table(time, {name: columns[name] for name in order}, digits)


def rig(name):
    axes = tuple(Axis(axis, Limits(1e3, 1e4), plant) for axis, plant in zip("xyz", PLANTS[:3], strict=True))
    if name == "cartesian":
        return Machine("cartesian", axes), None
    return Machine("cubic", axes, PLANTS), cubic_parallel(cubic_rails(60.0, 300.0, frozen([0.0, 0.0, -60.0])))


def measured(command, toolpath, name, law, gain=20.0):
    """RMS and largest contour error, um, dwell included."""
    machine, kinematics = rig(name)
    control = Control(command.sample_time, gain, 0, *LAWS[law])
    through = () if kinematics is None else (kinematics,)
    response = simulate(command, machine, control, *through, toolpath=toolpath)
    reach = foot_reach(1.0 / gain, 0.0, command.sample_time)
    lower, upper = foot_windows(command.arc_length, reach.back, reach.ahead, reach.margin)
    error = contour_error(response.position, toolpath, lower, upper)
    return 1e3 * error.rms, 1e3 * error.max


@pytest.mark.parametrize(("contour", "name"), EXPECTED)
@pytest.mark.parametrize("order", [("x_mm", "y_mm"), ("y_mm", "x_mm")], ids=lambda order: order[0])
def test_replayed_tables_come_to_the_numbers_of_the_specification(contour, name, order):
    """RMS within 3 %, the maximum within 5 % (10 % at corners), and half of the last digit that is told."""
    command, toolpath = command_of(replayed(contour, order))
    widest = 0.1 if "through" in contour else 0.05
    for law, cell in zip(LAWS, EXPECTED[contour, name].split(), strict=True):
        rms, highest = map(float, cell.split("/"))
        got_rms, got_highest = measured(command, toolpath, name, law)
        assert got_rms == pytest.approx(rms, rel=0.03, abs=0.02), law
        assert abs(got_highest - highest) <= max(widest * highest, 0.05) + 0.05, law


@pytest.mark.parametrize(
    ("contour", "curve"), [("circle5", CIRCLE), ("circle5", SPLINE), ("lemniscate", SPLINE)]
)
def test_paths_through_the_rows_come_to_the_same_numbers(contour, curve):
    command, toolpath = command_of(replayed(contour), curve=curve)
    for law, cell in zip(LAWS, EXPECTED[contour, "cartesian"].split(), strict=True):
        rms, highest = map(float, cell.split("/"))
        got_rms, got_highest = measured(command, toolpath, "cartesian", law)
        assert got_rms == pytest.approx(rms, rel=0.03, abs=0.02), law
        assert abs(got_highest - highest) <= max(0.05 * highest, 0.05) + 0.05, law


def test_drives_of_a_replayed_command_are_fed_second_differences():
    """Section 3.5: u = Kp phi + (q[k+1] - q[k])/(T k) + tau (q[k+1] - 2 q[k] + q[k-1])/(T^2 k)."""
    rng = np.random.default_rng(1)
    x = np.concatenate([[0.0, 0.0], np.cumsum(np.cumsum(rng.normal(size=40)))]) * 1e-3
    command, _ = command_of(table(T * np.arange(x.size), {"x_mm": x}, 12))
    response = simulate(command, rig("cartesian")[0], Control(T, 20.0, 0, AHEAD))
    q = command.position[:, 0]
    before, after = np.append(q[0], q[:-1]), np.append(q[1:], q[-1])
    told = 20.0 * (q - response.position[:, 0])
    told += (after - q) / T + 0.0148 * (after - 2.0 * q + before) / T**2
    assert_allclose(response.drive[:, 0], told, atol=1e-8)


@pytest.mark.parametrize("size", [1, 7, 64])
@pytest.mark.parametrize("name", ["cartesian", "cubic"])
def test_a_replayed_command_in_chunks_gives_the_same_bits(name, size):
    command, toolpath = command_of(replayed("circle5"))
    command = command.cut(slice(0, 200))
    machine, kinematics = rig(name)
    control = Control(T, 20.0, 0, *LAWS["G"])
    through = () if kinematics is None else (kinematics,)
    whole = simulate(command, machine, control, *through, toolpath=toolpath)
    step = simulating(machine, control, *through)
    state, parts = None, []
    for low in range(0, len(command), size):
        chunk = command.cut(slice(low, low + size))
        state, part = step(state, toolpath if low == 0 else None, chunk, low + size >= len(command))
        parts.append(part.joint)
    assert_array_equal(np.concatenate(parts), whole.joint)


# the circle's exact law: contour control, section 4


def circle_law(radius, feed, drive, position_gain, coupling_gain, period):
    """Steady error rho - |z| of z = H (Kp (rho - z) + Kc (rho - Re z)), mm."""
    alpha = math.exp(-period / drive.time_constant)
    beta = drive.time_constant * (1.0 - alpha)
    gamma = drive.gain * (period - beta)
    lam = np.exp(1j * feed * period / radius)
    h = (beta * (1.0 - alpha) * drive.gain / (lam - alpha) + gamma) / (lam - 1.0)
    both = position_gain + coupling_gain
    left = np.array([
        [1.0 + both * h.real, -position_gain * h.imag], [both * h.imag, 1.0 + position_gain * h.real],
    ])  # fmt: skip
    z = np.linalg.solve(left, both * radius * np.array([h.real, h.imag]))
    return radius - math.hypot(*z)


def test_the_law_has_the_numbers_of_the_specification():
    drive = FirstOrderLag(0.0148, 0.992)
    for kp, kc, error in ((20, 0, 25.5021), (20, 8, -0.2007), (20, 40, -34.8871), (35, 0, -1.2787)):
        assert 1e3 * circle_law(5.0, 16.0, drive, kp, kc, 1e-3) == pytest.approx(error, abs=1e-4)


@pytest.mark.parametrize("seed", range(20))
def test_a_circle_from_a_table_keeps_the_closed_form(seed):
    rng = np.random.default_rng(seed)
    bounds = ((2, 50), (1, 50), (0.005, 0.03), (0.9, 1.1), (5, 40), (0, 100), (5e-4, 2e-3))
    radius, feed, tau, gain, kp, kc, period = (rng.uniform(*bound) for bound in bounds)
    period = round(period, 6)
    middle, sense = rng.uniform(-30, 30, 2), rng.choice([-1.0, 1.0])
    steps = math.ceil(max(25.0 / kp, 60.0 * tau) / period)
    angle = sense * feed * period / radius * np.arange(steps + 1)
    x, y = middle[:, None] + radius * np.array([np.cos(angle), np.sin(angle)])
    text = table(period * np.arange(steps + 1), {"y_mm": y, "x_mm": x}, 9)
    command, toolpath = command_of(text, period, CIRCLE)
    drive = FirstOrderLag(tau, gain)
    machine = Machine("matched", tuple(Axis(name, Limits(1e3, 1e5), drive) for name in "xyz"))
    response = simulate(command, machine, Control(period, kp, 0, None, CrossCoupling(kc, TANGENT)))
    law = circle_law(radius, feed, drive, kp, kc, period)
    settled = response.position[-50:]
    inward = radius - np.hypot(*(settled[:, :2] - middle).T)
    assert_allclose(1e3 * inward, 1e3 * law, atol=1e-3)
    assert_allclose(1e3 * contour_error(settled, toolpath).distance, 1e3 * abs(law), atol=1e-3)


# splines

LINES = {"closed": True, "open": False}


def blade(closed, rows=24):
    """Uneven rows on a wavy ring, the last at the first if closed."""
    rng = np.random.default_rng(3)
    angle = np.sort(rng.uniform(0.0, 2 * np.pi, rows)) if rows > 3 else np.arange(rows) * 2.0
    radius = 20.0 + 4.0 * np.sin(3.0 * angle)
    points = radius * np.array([np.cos(angle), np.sin(angle)])
    return np.column_stack([points, points[:, :1]]) if closed else points


@pytest.mark.parametrize("closed", LINES.values(), ids=LINES)
def test_a_spline_is_laid_out_to_a_nanometre(closed):
    x, y = blade(closed)
    path = path_of(table(0.1 * np.arange(x.size), {"x_mm": x, "y_mm": y}, 12), SPLINE, closed)
    knots = np.round(np.column_stack([x, y]), 12)
    chord = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(knots, axis=0).T))])
    spline = CubicSpline(chord, knots, bc_type="periodic" if closed else "not-a-knot")
    toolpath = build_toolpath(path.program)
    dense = np.linspace(0.0, chord[-1], 20_011)
    points = frozen(np.column_stack([spline(dense), 0 * dense]))
    around = toolpath.arc_length[-1] * dense / chord[-1]
    distance = contour_error(points, toolpath, around - 5.0, around + 5.0).distance
    assert 0.3e-6 < distance.max() <= 1e-6
    assert_allclose(path.program.target[:, :2].min(axis=0), spline(dense).min(axis=0), atol=1e-5)
    assert (toolpath.kind == Motion.FEED).all()
    ends = np.searchsorted(toolpath.arc_length, path.place - 1e-9)
    assert_allclose(toolpath.end[ends[1:] - 1, :2], knots[1:], atol=1e-12)
    assert_array_equal(toolpath.line[ends[1:] - 1], np.arange(3, 2 + x.size))
    assert_array_equal(toolpath.line[ends[:-1]], np.arange(3, 2 + x.size))


def test_a_closed_spline_leads_back_where_the_rows_do_not():
    x, y = blade(closed=False)
    path = path_of(table(0.1 * np.arange(x.size), {"x_mm": x, "y_mm": y}), SPLINE, closed=True)
    toolpath = build_toolpath(path.program)
    assert_allclose(toolpath.end[-1, :2], [x[0], y[0]], atol=1e-8)
    assert path.place[-1] < toolpath.arc_length[-1] - 1.0
    first, last = toolpath.end[0] - toolpath.start[0], toolpath.end[-1] - toolpath.start[-1]
    turn = math.acos(first @ last / np.linalg.norm(first) / np.linalg.norm(last))
    assert turn < 1e-3  # smooth across the seam
    assert np.isinf(toolpath.feed_rate[-1])
    assert toolpath.line[-1] == 2


@pytest.mark.parametrize("curve", [SPLINE, CIRCLE])
@pytest.mark.parametrize("jitter", [0.0, 4e-7])
def test_rows_that_repeat_a_point_dwell_on_the_same_path(curve, jitter):
    angle = np.linspace(0.0, 4.0, 30)
    stays = np.concatenate([[0] * 5, np.arange(12), [12] * 9, np.arange(13, 30), [29] * 4])
    angles, time = angle[stays], 0.01 * np.arange(stays.size)
    noise = jitter * np.random.default_rng(0).uniform(-1.0, 1.0, (2, stays.size))
    columns = dict(
        zip(("x_mm", "y_mm"), 5.0 * np.array([np.cos(angles), np.sin(angles)]) + noise, strict=True)
    )
    dwelling = path_of(table(time, columns, 12), curve)
    plain = path_of(
        table(0.01 * np.arange(30), {"x_mm": 5.0 * np.cos(angle), "y_mm": 5.0 * np.sin(angle)}, 12), curve
    )
    dwells = dwelling.program.motion == Motion.DWELL
    assert dwells.sum() == 17
    assert dwelling.program.dwell.sum() == pytest.approx(0.17)
    moves = ~dwells
    assert moves.sum() == len(plain.program)
    assert_allclose(dwelling.program.target[moves], plain.program.target, atol=2e-12 + 10.0 * jitter)
    assert_allclose(dwelling.place, plain.place[stays], atol=1e-11 + 20.0 * jitter)


def test_a_table_that_is_coarser_than_the_servo_runs_along_its_spline():
    x, y = blade(closed=True)
    time = 0.05 * np.arange(x.size)
    time[10:] += 0.2  # and stands still in between
    text = table(
        np.insert(time, 10, time[9] + 0.2), {"x_mm": np.insert(x, 10, x[9]), "y_mm": np.insert(y, 10, y[9])}
    )
    command, toolpath = command_of(text, T, SPLINE, closed=True)
    error = contour_error(command.position, toolpath, command.arc_length - 1.0, command.arc_length + 1.0)
    assert error.max <= 1e-6
    rows = np.round(time / T).astype(int)
    assert_allclose(command.position[rows, :2], np.column_stack([x, y]), atol=1e-8)
    assert (np.diff(command.arc_length) >= -1e-12).all()
    assert_allclose(error.arc_length, command.arc_length, atol=1e-6)
    standing = command.position[rows[9] : rows[9] + 200]
    assert np.ptp(standing, axis=0).max() < 1e-12


def test_a_coarse_table_speeds_up_smoothly_along_its_spline():
    """Straight lines in time would be off by a h^2 / 8, 8 µm."""
    time = 0.02 * np.arange(11)
    command, _ = command_of(table(time, {"x_mm": 0.5 * ALONG * time**2}), T, SPLINE)
    late = slice(40, 180)  # away from the ends, whose slope is a guess
    true = 0.5 * ALONG * (T * np.arange(len(command))) ** 2
    assert_allclose(command.position[late, 0], true[late], atol=1e-3)


@pytest.mark.parametrize("curve", [POLYLINE, SPLINE, CIRCLE])
def test_rows_at_the_servo_period_are_the_command(curve):
    angle = np.linspace(0.0, 1.0, 100) ** 2
    columns = {"y_mm": 5.0 * np.sin(angle), "x_mm": 5.0 * np.cos(angle)}
    command, toolpath = command_of(table(T * np.arange(100), columns), T, curve)
    assert_allclose(command.position[:, 1], columns["y_mm"], atol=1.01e-9)
    assert command.arc_length[-1] == pytest.approx(toolpath.arc_length[-1], abs=1e-6)


def test_axes_that_turn_go_straight_along_a_spline_and_a_circle():
    angle = np.linspace(0.0, 1.0, 20)
    turning = np.concatenate([10.0 * np.arange(20), [250.0, 250.0]])
    columns = {
        "x_mm": 5.0 * np.cos(np.append(angle, [1.0, 1.0])), "y_mm": 5.0 * np.sin(np.append(angle, [1.0, 1.0])),
        "a_deg": turning,
    }  # fmt: skip
    for curve in (SPLINE, CIRCLE):
        path = path_of(table(0.1 * np.arange(22), columns), curve)
        program = path.program
        assert math.degrees(program.target[-1, 3]) == pytest.approx(250.0)
        assert_array_equal(program.motion[-2:], [Motion.FEED, Motion.DWELL])  # turns alone, then rests
        assert math.degrees(program.feed_rate[-2]) == pytest.approx(600.0)
        assert (np.diff(program.target[:, 3]) >= 0.0).all()


def test_a_spline_of_too_many_lines_is_refused(monkeypatch):
    monkeypatch.setattr(timed_spline, "MOST_LINES", 100)
    x, y = blade(closed=False)
    with pytest.raises(InfeasibleError, match="more than the limit of 100") as caught:
        path_of(table(0.1 * np.arange(x.size), {"x_mm": x, "y_mm": y}), SPLINE)
    assert "polyline" in caught.value.hint


def test_a_spline_of_one_point_is_refused():
    with pytest.raises(InfeasibleError, match="all rows are the same point"):
        path_of("time_s,x_mm\n0,1\n1,1\n2,1\n", SPLINE)


@pytest.mark.parametrize("closed", LINES.values(), ids=LINES)
@pytest.mark.parametrize("rows", [2, 3])
def test_splines_of_few_rows(rows, closed):
    x, y = blade(closed=False, rows=rows)
    path = path_of(table(1.0 * np.arange(rows), {"x_mm": x, "y_mm": y}), SPLINE, closed)
    assert np.isfinite(path.program.target).all()
    assert len(path.program) == 1 if (rows, closed) == (2, False) else len(path.program) > 1


few = st.sampled_from([0.0, 1e-7, 1e-6, 2e-6, 0.001, 1.0, 1.000001, -3.0, 1e5])


@given(st.lists(st.tuples(few, few, st.sampled_from([0.0, 2.0])), min_size=2, max_size=9), st.booleans())
@settings(max_examples=300, deadline=None, derandomize=True)
def test_any_rows_are_a_path_or_refused(rows, closed):
    x, y, a = np.array(rows).T
    text = table(np.arange(x.size), {"y_mm": y, "a_deg": a, "x_mm": x}, 9)
    for curve in Curve:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("cnc_shape.readers.timed_spline.MOST_LINES", 3000)
            try:
                path = path_of(text, curve, closed)
            except CncShapeError:
                continue
        program = path.program
        assert np.isfinite(np.column_stack([program.target, program.sweep, program.dwell])).all()
        assert (program.feed_rate > 0.0).all()
        assert (np.diff(path.place) >= 0.0).all()
        if curve is not CIRCLE:  # rows of equal place stand at the same point
            first = np.searchsorted(path.place, path.place)
            assert_allclose(path.points.position[first, :3], path.points.position[:, :3], atol=1.1e-6)
        command, toolpath = resample(path, 0.25, samples=1000)
        assert np.isfinite(command.position).all()
        assert command.arc_length[-1] <= toolpath.arc_length[-1] * (1.0 + 1e-12)


# circles


def spiral_staircase(turns, radius=7.0, rows=400, tilt=0.7, middle=(3.0, -2.0, 5.0)):
    """Points of a tilted circle with its plane's normal."""
    angle = np.linspace(0.4, 0.4 + 2 * np.pi * turns, rows)
    along, across = np.array([1.0, 0.0, 0.0]), np.array([0.0, math.cos(tilt), math.sin(tilt)])
    points = np.array(middle) + radius * (np.cos(angle)[:, None] * along + np.sin(angle)[:, None] * across)
    return points, np.cross(along, across)


def as_table(points):
    return table(
        0.01 * np.arange(len(points)), dict(zip(("x_mm", "y_mm", "z_mm"), points.T, strict=True)), 12
    )


@pytest.mark.parametrize("turns", [3.25, -3.25, 0.1, 1.0, -1.0])
def test_a_circle_has_the_turns_and_the_sense_of_its_rows(turns):
    points, normal = spiral_staircase(turns)
    path = path_of(as_table(points), CIRCLE)
    program = path.program
    assert (program.motion == Motion.ARC).all()
    assert program.sweep.sum() == pytest.approx(2 * np.pi * turns, abs=1e-9)
    assert_allclose(program.normal, np.tile(normal, (len(program), 1)), atol=1e-8)
    assert_allclose(program.center, np.tile([3.0, -2.0, 5.0], (len(program), 1)), atol=1e-8)
    assert_allclose(program.target, points[1:], atol=1e-9)
    assert_allclose(path.place, 14 * np.pi * abs(turns) * np.linspace(0.0, 1.0, 400), atol=1e-8)
    assert_array_equal(program.line, np.arange(3, 402))
    toolpath = build_toolpath(program)
    assert len(segments(toolpath, first=True).arcs) == 399
    assert contour_error(frozen(points), toolpath).max < 1e-9


def test_a_circle_may_be_run_to_and_fro():
    angle = np.concatenate([np.linspace(0.0, 2.0, 50), np.linspace(1.9, 0.5, 30)])
    columns = {"z_mm": 3.0 * np.cos(angle), "x_mm": 3.0 * np.sin(angle)}
    command, toolpath = command_of(table(T * np.arange(80), columns, 12), T, CIRCLE)
    assert toolpath.arc_length[-1] == pytest.approx(3.0 * 3.5)
    assert (np.diff(command.arc_length) > 0.0).all()
    assert toolpath.normal[0].tolist() == pytest.approx([0.0, 1.0, 0.0])
    assert (toolpath.sweep[:49] > 0.0).all()
    assert (toolpath.sweep[49:] < 0.0).all()


@pytest.mark.parametrize(("turns", "made"), [(0.8, 1.0), (-1.3, -2.0), (2.0, 2.0)])
def test_a_closed_circle_completes_its_last_turn(turns, made):
    points, _ = spiral_staircase(turns)
    program = path_of(as_table(points), CIRCLE, closed=True).program
    assert program.sweep.sum() == pytest.approx(2 * np.pi * made)
    assert len(program) == 399 + (turns != made)


def test_a_closed_polyline_leads_back():
    text = "time_s,x_mm,y_mm\n0,0,0\n1,3,0\n2,3,4\n"
    assert path_of(text, closed=True).program.target.tolist() == [[3, 0, 0], [3, 4, 0], [0, 0, 0]]
    assert len(path_of(text + "3,0,0\n", closed=True).program) == 3


def test_a_row_off_the_circle_is_named():
    points, _ = spiral_staircase(1.5)
    points[123, 2] += 3e-3
    with pytest.raises(ProgramError, match=r"the row is .* µm off the circle of radius 7 mm") as caught:
        path_of(as_table(points), CIRCLE)
    assert caught.value.line == 125
    assert "--path spline" in caught.value.hint


def test_a_large_circle_may_be_left_by_more():
    rng = np.random.default_rng(0)
    points, _ = spiral_staircase(1.0, radius=100.0)
    points += rng.normal(scale=1e-3, size=points.shape)
    path = path_of(as_table(points), CIRCLE)
    assert_allclose(path.program.center[0], [3.0, -2.0, 5.0], atol=5e-4)
    points, _ = spiral_staircase(1.0, radius=7.0)
    points += rng.normal(scale=1e-3, size=points.shape)
    with pytest.raises(ProgramError, match="off the circle"):
        path_of(as_table(points), CIRCLE)


def test_ellipses_and_lines_are_no_circles():
    points, _ = spiral_staircase(1.0)
    with pytest.raises(ProgramError, match="off the circle"):
        path_of(as_table(points * [1.0, 1.01, 1.0]), CIRCLE)
    straight = np.linspace(0.0, 1.0, 10)[:, None] * [3.0, 4.0, 5.0]
    for rows in (straight, straight[:2], straight[:1].repeat(3, axis=0)):
        with pytest.raises(InfeasibleError, match="no circle"):
            path_of(as_table(rows), CIRCLE)


# the command line


def test_check_counts_the_arcs_of_a_circle(capfd, tmp_path):
    file = tmp_path / "staircase.csv"
    file.write_text(as_table(spiral_staircase(1.25)[0]))
    assert answer(capfd, "check", str(file), "--path", "circle")["moves"]["arc"] == 399
    closed = answer(capfd, "check", str(file), "--path", "circle", "--closed")
    assert closed["moves"]["arc"] == 400
    assert closed["feed_length_mm"] == pytest.approx(2 * 14 * math.pi)
    assert answer(capfd, "check", str(file), "--path", "spline")["moves"]["feed"] > 399


def test_simulate_measures_against_the_path_that_is_asked_for(capfd, tmp_path):
    """Rows 20 ms apart at 200 mm/s on a circle of 10 mm: chords leave it by 200 µm, the spline by far less."""
    file = tmp_path / "coarse.csv"
    angle = 0.4 * np.arange(20)
    file.write_text(table(0.02 * np.arange(20), {"x_mm": 10 * np.cos(angle), "y_mm": 10 * np.sin(angle)}))
    largest = {
        curve: answer(capfd, "simulate", str(file), "--path", curve)["cases"][0]["command_contour_max_um"]
        for curve in ("polyline", "spline", "circle")
    }
    assert largest["polyline"] < 1e-6
    assert largest["spline"] < 1.1e-3
    assert largest["circle"] == pytest.approx(1e4 * (1.0 - math.cos(0.2)), rel=1e-3)
