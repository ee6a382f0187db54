"""Contour shaping: the laws of curves, corners and lines under shaping, and what compensation leaves of them.

The numbers come from the specification's own simulations; the machine called printer has modes of 55 and
42 Hz (damping 0.05) between ideal drives and the tool.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from paths import arc, line, program

from cnc_shape.arrays import frozen
from cnc_shape.cases import pick_cases, timings
from cnc_shape.config.setup import Planning, Setup, Shaping
from cnc_shape.controllers import Control
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, Machine
from cnc_shape.modes import Mode
from cnc_shape.motion import moving
from cnc_shape.pipeline import run
from cnc_shape.program import PathMode
from cnc_shape.shapers import ei, mzv, sd, umzv, zv, zvd
from cnc_shape.shapers.analysis import contour_factor
from cnc_shape.shapers.command_shaping import CommandShaping, shape_command
from cnc_shape.shapers.shaper import convolve
from cnc_shape.shapers.tool_corner import tool_errors
from cnc_shape.simulation import simulate
from cnc_shape.trajectory import Trajectory, join_trajectories

T = 1e-4  # s
PRINTER = {"x": Mode(55.0, 0.05), "y": Mode(42.0, 0.05)}
FAN = [
    (23.6354, 4.1676), (31.2415, 6.9261), (36.2573, 9.1745), (37.5662, 11.1990), (36.5302, 13.6581),
    (28.5912, 21.5450), (17.3397, 23.8660), (6.6439, 20.4477), (-0.7327, 13.9808), (-5.0000, 8.6603),
    (-9.4046, 12.9443),
]  # fmt: skip  # mm, one blade of three


def machine(modes, velocity=1e4, acceleration=5000.0, axes="xy"):
    return Machine("test", tuple(Axis(a, Limits(velocity, acceleration), modes=(modes[a],)) for a in axes))


def setup(modes, shapers, **planning):
    planning = {"path_tolerance": 0.02, **planning}
    return Setup(machine(modes), Planning(**planning), Control(sample_time=T), shapers=shapers)


def rows(of, moves, names, tolerance=0.02):
    """One summary per case."""
    cases = pick_cases(of, names)
    whole = program(*moves)
    blocks = moving([whole], of.machine, tolerance, T, timings(cases))
    return {case.name: case for case in run(blocks, of, cases, "test").summary.cases}


def spun(radius, feed, turns, ramp):
    """A circle whose speed rises smoothly from rest within `ramp` s."""
    omega = feed / radius
    time = np.arange(int((ramp + turns * 2 * np.pi / omega) / T)) * T
    x = np.minimum(time / ramp, 1.0)
    rate = omega * x**3 * (10 - 15 * x + 6 * x**2)
    turned = omega * ramp * (2.5 * x**4 - 3 * x**5 + x**6) + omega * np.maximum(time - ramp, 0.0)
    rising = omega / ramp * 30 * x**2 * (1 - x) ** 2
    c, s = np.cos(turned), np.sin(turned)
    p = radius * np.stack([c, s], axis=1)
    normal, tangent = np.stack([c, s], axis=1), np.stack([-s, c], axis=1)
    v = radius * rate[:, None] * tangent
    a = radius * (rising[:, None] * tangent - rate[:, None] ** 2 * normal)
    return Trajectory(("x", "y"), T, frozen(radius * turned), frozen(p), frozen(v), frozen(a))


def radius_error(mode, shaper, radius, feed, *, compensated=False, ramp=1.0):
    """Mean radius of the tool less the circle's over the last turn, um."""
    command = spun(radius, feed, 3, ramp)
    modes = {"x": mode, "y": mode}
    shapers = {} if shaper is None else dict.fromkeys(modes, shaper)
    structure = {a: (m,) for a, m in modes.items()} if compensated else None
    shaped = shape_command(command, CommandShaping(shapers, structure=structure))
    tool = simulate(shaped, machine(modes), Control(sample_time=T)).tool[: len(command)]
    turn = round(2 * np.pi * radius / feed / T)
    return 1e3 * (np.hypot(*tool[-turn:].T).mean() - radius)


@pytest.mark.parametrize(
    ("make", "kappa"), [(zv, -0.23370), (umzv, -0.09662), (mzv, -0.62604), (zvd, -1.46740), (ei, -1.59077)]
)
def test_contour_factors_of_undamped_shapers(make, kappa):
    mode = Mode(42.0, 0.0)
    assert contour_factor(make(mode), [mode]) == pytest.approx(kappa, abs=1e-5)


@pytest.mark.parametrize("periods", [0.35, 0.55, 0.8, 0.97])
def test_contour_factor_of_a_symmetric_three_impulse_shaper(periods):
    """``1 - 1/sinc^2(TN/2)``."""
    mode = Mode(42.0, 0.0)
    shaper = sd(mode, duration_periods=periods, max_amplitude=10.0)
    if shaper.amplitudes[0] == pytest.approx(shaper.amplitudes[-1]):
        assert contour_factor(shaper, [mode]) == pytest.approx(1 - 1 / np.sinc(periods / 2) ** 2, abs=1e-6)
    else:
        assert periods < 0.5  # there the bound on the amplitudes decides


@pytest.mark.parametrize(("shaper", "error"), [(None, 74.47), (zv, -16.73), (mzv, -44.62), (zvd, -103.9)])
def test_the_circle_law(shaper, error):
    mode = Mode(42.0, 5e-4)
    got = radius_error(mode, shaper and shaper(mode), 2.0, 100.0)
    assert got == pytest.approx(error, abs=0.02 if shaper is not zvd else 0.1)


def test_compensation_takes_a_circle_back_to_the_fourth_order():
    mode = Mode(42.0, 5e-4)
    assert abs(radius_error(mode, zv(mode), 2.0, 100.0, compensated=True)) < 0.3
    ratios = np.array([0.6, 0.8, 1.0, 1.25, 1.5])  # F / (R f)
    errors = [
        radius_error(mode, zv(mode), 5.0, q * 5.0 * mode.natural_frequency, compensated=True) for q in ratios
    ]
    assert np.ptp(errors / ratios**4) < 0.2 * np.abs(errors / ratios**4).max()


def test_a_common_shaper_keeps_a_line_straight_at_the_drives_but_not_at_the_tool():
    shapers = {a: zv(m) for a, m in PRINTER.items()}
    common = dict.fromkeys(PRINTER, convolve(list(shapers.values())))
    angle = np.radians(30.0)
    moves = [line(40 * np.cos(angle), 40 * np.sin(angle), 0.0, feed_rate=150.0)]
    limits = {"x": 5000.0 * np.cos(angle), "y": 5000.0 * np.sin(angle)}  # 5000 mm/s^2 along the line
    axes = tuple(Axis(a, Limits(1e4, limits[a]), modes=(PRINTER[a],)) for a in PRINTER)

    def of(chosen):
        return Setup(Machine("line", axes), Planning(), Control(sample_time=T), shapers=chosen)

    alike = rows(of(common), moves, ["axis_shaped"])["axis_shaped"]
    apart = rows(of(shapers), moves, ["axis_shaped", "contour_shaped"])
    assert alike.command.max < 1e-12
    assert 1e3 * alike.tool.max == pytest.approx(12.96, abs=0.1)
    assert 1e3 * apart["axis_shaped"].tool.max == pytest.approx(2.97, abs=0.05)
    assert apart["contour_shaped"].tool.max < 0.75 * apart["axis_shaped"].tool.max


def square(side=40.0, feed=100.0, mode=PathMode.EXACT_STOP):
    corners = [(side, 0.0), (side, side), (0.0, side), (0.0, 0.0)]
    return [line(*corner, 0.0, feed_rate=feed, mode=mode) for corner in corners]


def test_on_lines_with_full_stops_path_shaping_is_axis_shaping():
    mode = {"x": Mode(50.0, 0.0), "y": Mode(50.0, 0.0)}  # impulses on the servo grid
    of = setup(mode, {a: zvd(m) for a, m in mode.items()}, stop_dwell=1.0)
    cases = pick_cases(of, ["axis_shaped", "path_shaped"])
    whole = program(*square())
    parts = {case.timing: [] for case in cases}
    for block in moving([whole], of.machine, 0.02, T, timings(cases)):
        if block.timing in parts:
            parts[block.timing].append(block.command)
    by_path = np.concatenate([c.position for c in parts[cases[1].timing]])
    command = join_trajectories(parts[cases[0].timing])
    shaped = shape_command(command, cases[0].shaping)
    assert_allclose(by_path, shaped.position, atol=1e-9)


def test_a_fan_at_speed():
    """Measured by the specification: axis shaping 5.03 um RMS, contour shaping below 0.25, path above 20."""
    from scipy.interpolate import CubicSpline

    turn = np.array([[-0.5, -np.sqrt(0.75)], [np.sqrt(0.75), -0.5]])
    blade = np.array(FAN)
    points = np.concatenate([blade, blade @ turn.T, blade @ turn.T @ turn.T, blade[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    curve = CubicSpline(along, points - points[0], bc_type="periodic")(np.linspace(0, along[-1], 3000))
    of = setup(PRINTER, {a: zv(m) for a, m in PRINTER.items()})
    moves = [line(*point, 0.0, feed_rate=150.0) for point in curve[1:]]
    found = rows(of, moves, ["axis_shaped", "contour_shaped", "path_shaped"], tolerance=0.0005)
    assert 1e3 * found["axis_shaped"].tool.rms == pytest.approx(5.03, abs=0.1)
    assert 1e3 * found["contour_shaped"].tool.rms <= 0.25
    assert 1e3 * found["path_shaped"].tool.rms >= 20.0


@pytest.mark.parametrize(
    ("make", "kappa", "stop", "speed"),
    [
        (umzv, -0.095, 0.045, 0.174), (zv, -0.232, 0.114, 0.279), (mzv, -0.624, 0.309, 0.481),
        (zvd, -1.464, 0.725, 0.774), (ei, -1.587, 0.761, 0.806),
    ],
    ids=["umzv", "zv", "mzv", "zvd", "ei"],
)  # fmt: skip
def test_what_the_tool_does_in_units_of_its_mode(make, kappa, stop, speed):
    """Measured by the specification at a damping of 0.03; the stop of ei depends on its exact form."""
    mode = Mode(42.0, 0.03)
    found = tool_errors(make(mode), [mode])
    assert found.curve * mode.omega**2 == pytest.approx(kappa, abs=0.01)
    assert found.stop * mode.omega**2 == pytest.approx(stop, rel=0.05)
    assert found.corner_at_speed * mode.omega == pytest.approx(speed, rel=0.02)


@pytest.mark.parametrize("make", [zv, mzv, zvd])
def test_what_a_stop_at_a_corner_leaves_by_its_dwell(make):
    """The simulation of whole motions against the closed form."""
    mode = {a: Mode(42.0, 0.03) for a in "xy"}
    shaper = make(mode["x"])
    ratios = tool_errors(shaper, [mode["x"]])
    for share, expected in ((0.0, ratios.stop), (0.5, ratios.stop_half_dwell), (1.0, 0.0)):
        of = setup(mode, dict.fromkeys(mode, shaper), stop_dwell=share)
        got = rows(of, square()[:2], ["axis_shaped"])["axis_shaped"].tool.max
        assert got == pytest.approx(expected * 5000.0, rel=0.05, abs=1e-3 * 5000.0 / mode["x"].omega ** 2)


def test_a_corner_at_speed_goes_by_the_sine_of_its_angle():
    """Commands that turn by 30, 90 and 150 degrees at constant speed, through shaper and structure."""
    mode = Mode(42.0, 0.03)
    time = np.arange(-0.5, 0.5, T)
    before, after = np.minimum(time, 0.0), np.maximum(time, 0.0)
    errors = {}
    for angle in (30.0, 90.0, 150.0):
        way = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        position = 50.0 * (np.outer(before, [1.0, 0.0]) + np.outer(after, way))
        velocity = 50.0 * np.where(time[:, None] < 0.0, [1.0, 0.0], way)
        command = Trajectory(
            ("x", "y"), T, frozen(50.0 * (time - time[0])), frozen(position), frozen(velocity),
            frozen(np.zeros_like(position)),
        )  # fmt: skip
        shaped = shape_command(command, CommandShaping(dict.fromkeys("xy", zv(mode))))
        tool = simulate(shaped, machine({"x": mode, "y": mode}), Control(sample_time=T)).tool[
            4000 : time.size
        ]
        along, across = tool @ way, tool @ np.array([-way[1], way[0]])
        first = np.where(tool[:, 0] <= 0.0, np.abs(tool[:, 1]), np.hypot(*tool.T))
        second = np.where(along >= 0.0, np.abs(across), np.hypot(*tool.T))
        errors[angle] = np.minimum(first, second).max() * mode.omega / 50.0
    assert errors[90.0] == pytest.approx(0.279, rel=0.02)
    assert errors[30.0] == pytest.approx(0.140, rel=0.02)
    assert errors[150.0] == pytest.approx(0.140, rel=0.02)


def test_without_alignment_a_circle_is_cut():
    shapers = {a: zv(m) for a, m in PRINTER.items()}
    moves = [arc((0.0, 0.0, 0.0), (10.0, 0.0, 0.0), 2 * np.pi, feed_rate=200.0)]
    raw = rows(setup(PRINTER, shapers, aligned=False), moves, ["axis_shaped"], 1e-3)["axis_shaped"]
    found = rows(setup(PRINTER, shapers), moves, ["axis_shaped", "contour_shaped"], 1e-3)
    assert 1e3 * raw.tool.rms >= 80.0
    assert 1e3 * found["axis_shaped"].tool.rms == pytest.approx(9.5, abs=0.5)
    assert 1e3 * found["contour_shaped"].tool.rms < 0.4  # 0.3 of it is the polygon of the arc


def test_path_shaping_wins_only_where_the_structure_hardly_bends():
    moves = [arc((0.0, 0.0, 0.0), (10.0, 0.0, 0.0), 2 * np.pi, feed_rate=150.0)]
    for share, path_wins in ((0.3, True), (1.0, False)):
        mode = {a: Mode(42.0, 0.03, share) for a in "xy"}
        found = rows(setup(mode, {a: zv(m) for a, m in mode.items()}), moves, ["axis_shaped", "path_shaped"])
        assert (found["path_shaped"].tool.rms < found["axis_shaped"].tool.rms) is path_wins


def test_what_the_shaper_cancels_stays_cancelled():
    of = setup(PRINTER, {a: zv(m) for a, m in PRINTER.items()})
    for shaping in (Shaping.AXIS, Shaping.CONTOUR):
        name = f"{shaping.value}_shaped"
        found = rows(of, square(mode=PathMode.BLEND), [name])[name]
        assert max(found.residual_vibration.values()) < 1e-5  # mm
