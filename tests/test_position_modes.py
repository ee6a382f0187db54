"""Modes over position: the push of every drive in closed form, tables along a motion, shapers at their design point."""

from __future__ import annotations

from dataclasses import replace

import naive
import numpy as np
import pytest
from commands import circling, part, point_to_point
from conftest import ROOT
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from cnc_shape.arrays import frozen
from cnc_shape.config.dump import dump_machine
from cnc_shape.config.machine_file import parse_machine
from cnc_shape.controllers import Control, CrossCoupling, Feedforward
from cnc_shape.errors import ConfigError, OptionError
from cnc_shape.kernels.structure import advance, table_at
from cnc_shape.kinematics import corexy
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, FirstOrderLag, IdealDrive, Machine, ServoMotor, VelocityLoop
from cnc_shape.modes import Mode, ModeTable
from cnc_shape.plant import discretise
from cnc_shape.shapers import zv
from cnc_shape.shapers.analysis import residual_vibration
from cnc_shape.shapers.shaping import shape
from cnc_shape.simulation import simulate, simulating
from cnc_shape.trajectory import Trajectory
from cnc_shape.units import DEGREE

LIMITS = Limits(1000.0, 10_000.0)
T = 1e-3
OVER_Z = ModeTable("z", (0.0, 100.0, 300.0), (50.0, 40.0, 25.0), (0.02, 0.03, 0.01))
SHAPED_AT = Mode(40.0, 0.03, 0.7, table=OVER_Z)
IDEAL = IdealDrive()
DRIVES = (IDEAL, FirstOrderLag(0.0148, 0.992), FirstOrderLag(0.2 * T, 1.1))
MOTOR = ServoMotor(4.6e-4, 7.1, 10.0, 5e-4, 0.08, 2e-4, 131_072)


# --- the table ------------------------------------------------------------------------------------


def test_linear_between_rows_and_clamped_beyond():
    assert OVER_Z.at(-5.0) == (50.0, 0.02)
    assert OVER_Z.at(100.0) == (40.0, 0.03)
    assert_allclose(OVER_Z.at(50.0), (45.0, 0.025), rtol=1e-15)
    assert_allclose(OVER_Z.at(200.0), (32.5, 0.02), rtol=1e-15)
    assert OVER_Z.at(1e9) == (25.0, 0.01)


@given(st.lists(st.floats(-500.0, 500.0), min_size=2, max_size=9, unique=True), st.floats(-600.0, 600.0))
def test_the_loop_stands_where_the_table_says(rows, position):
    rows = sorted(rows)
    if min(np.diff(rows)) < 1e-3:
        return
    frequency, damping = 20.0 + 10.0 * np.cos(rows), 0.1 + 0.05 * np.sin(rows)
    mode = ModeTable("z", tuple(rows), tuple(frequency.tolist()), tuple(damping.tolist()))
    expected = np.interp(position, rows, frequency), np.interp(position, rows, damping)
    assert_allclose(mode.at(position), expected, rtol=1e-12)
    above = frozen(np.column_stack([rows, frequency, damping]) - 1.0)  # rows of another table before it
    table = frozen(np.vstack([above, np.column_stack([rows, frequency, damping])]))
    assert_allclose(table_at(table, len(rows), 2 * len(rows), position), expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("position", "frequency", "damping", "reason"),
    [
        ((0.0,), (30.0,), (0.1,), "two positions"),
        ((0.0, 1.0), (30.0,), (0.1, 0.1), "as many"),
        ((0.0, 0.0), (30.0, 20.0), (0.1, 0.1), "must increase: 0 follows 0"),
        ((0.0, np.inf), (30.0, 20.0), (0.1, 0.1), "finite"),
        ((0.0, 1.0), (30.0, 0.0), (0.1, 0.1), "must be positive"),
        ((0.0, 1.0), (30.0, 20.0), (0.1, 1.0), "below 1"),
        ((0.0, 1.0), (30.0, 1e6), (0.1, 0.1), "between 0.001 and 100000"),
    ],
)
def test_a_table_that_is_none_is_refused(position, frequency, damping, reason):
    with pytest.raises(OptionError, match=reason):
        ModeTable("z", position, frequency, damping)


def test_the_longest_period_is_that_of_the_softest_place():
    assert Mode(40.0, 0.0).longest_period == 1.0 / 40.0
    assert_allclose(SHAPED_AT.longest_period, 1.0 / (25.0 * np.sqrt(1.0 - 0.01**2)), rtol=1e-15)
    assert SHAPED_AT.damped_period < SHAPED_AT.longest_period
    assert replace(SHAPED_AT, natural_frequency=10.0).longest_period > 0.1
    assert SHAPED_AT.at(100.0) == replace(SHAPED_AT, table=None)
    assert SHAPED_AT.scaled(2.0).at(0.0).natural_frequency == 100.0


# --- one stretch of time --------------------------------------------------------------------------


def by_exponential(d, w, omega, zeta, start, slope, fading, rate, time):
    """States: deflection, its rate, the linear push, its slope, the fading push."""
    M = np.zeros((5, 5))
    M[0, 1], M[1] = 1.0, [-(omega**2), -2.0 * zeta * omega, 1.0, 0.0, 1.0]
    M[2, 3], M[4, 4] = 1.0, -rate
    return (expm(M * time) @ [d, w, start, slope, fading])[:2]


@pytest.mark.parametrize("turn", [1e-6, 1e-2, 0.3, 0.4999, 0.5001, 2.0, 20.0])  # omega T
@pytest.mark.parametrize("fade", [0.0, 1e-3, 0.3, 0.6, 5.0, 1e3])  # rate T
@pytest.mark.parametrize("zeta", [0.0, 0.02, 0.9])
def test_every_push_is_answered_exactly(turn, fade, zeta):
    mixed = (T**2, -T, 1.0, 2.0 / T, 3.0)
    for d, w, start, slope, fading in (*np.diag(mixed).tolist(), mixed):
        found = advance(d, w, turn / T, zeta, start, slope, fading, fade / T, T)
        expected = by_exponential(d, w, turn / T, zeta, start, slope, fading, fade / T, T)
        scale = max(abs(expected[0]), abs(expected[1]) * T)
        assert_allclose(np.array(found) * [1.0, T], expected * [1.0, T], rtol=0.0, atol=1e-12 * scale)


def test_a_mode_far_slower_than_the_stretch_is_a_free_mass():
    """Particular and homogeneous solution would cancel to the last digit."""
    d, w = advance(0.0, 0.0, 1e-6, 0.5, 3.0, 4.0, 0.0, 0.0, T)
    assert_allclose(d, 3.0 * T**2 / 2.0 + 4.0 * T**3 / 6.0, rtol=1e-9)
    assert_allclose(w, 3.0 * T + 4.0 * T**2 / 2.0, rtol=1e-9)


@given(st.floats(1.0, 4000.0), st.floats(0.0, 0.95), st.floats(0.0, 1e5), st.integers(1, 7))
def test_a_stretch_is_its_parts(omega, zeta, rate, parts):
    start, slope, fading, time = 50.0, -3e4, 80.0, 1.5e-3
    whole = advance(1e-3, 0.2, omega, zeta, start, slope, fading, rate, time)
    d, w, part_time = 1e-3, 0.2, time / parts
    for k in range(parts):
        t = k * part_time
        d, w = advance(
            d, w, omega, zeta, start + slope * t, slope, fading * np.exp(-rate * t), rate, part_time
        )
    assert_allclose((d, w * time), (whole[0], whole[1] * time), rtol=0.0, atol=1e-15)


# --- a whole motion -------------------------------------------------------------------------------


def machine(drive=IDEAL, mode=SHAPED_AT, more=()):
    axes = tuple(Axis(name, LIMITS, drive, (mode, *more) if name == "x" else ()) for name in "xyz")
    return Machine("test", axes)


def moving(sample_time=T, seconds=0.4, reach=200.0):
    """X swings while Z runs from 0 to `reach`, both smoothly: position and its derivatives."""
    time = np.arange(round(seconds / sample_time) + 1) * sample_time
    turn = 2.0 * np.pi / seconds
    x = 5.0 * (1.0 - np.cos(3.0 * turn * time))
    z = reach * (time / seconds - np.sin(turn * time) / (2.0 * np.pi))
    speeds = 15.0 * turn * np.sin(3.0 * turn * time), reach / seconds * (1.0 - np.cos(turn * time))
    pushes = 45.0 * turn**2 * np.cos(3.0 * turn * time), reach / seconds * turn * np.sin(turn * time)
    return Trajectory(
        ("x", "y", "z"), sample_time, frozen(time),
        *(frozen(np.column_stack([a, 0.0 * time, c])) for a, c in ((x, z), speeds, pushes)),
    )  # fmt: skip


@pytest.mark.parametrize("drive", [*DRIVES, MOTOR], ids=["ideal", "lag", "lag within a sample", "motor"])
def test_a_table_that_says_the_same_everywhere_changes_nothing(drive):
    plain = Mode(40.0, 0.03, 0.7)
    same = replace(plain, table=ModeTable("z", (0.0, 100.0), (40.0, 40.0), (0.03, 0.03)))
    more, loop = (Mode(90.0, 0.01, 0.3),), Control(T, 20.0, 1, Feedforward(1.0, 1.0))
    command = moving()
    one, other = (simulate(command, machine(drive, mode, more), loop) for mode in (plain, same))
    assert_array_equal(one.joint, other.joint)
    assert np.abs(one.tool - one.position).max() > 0.01
    assert_allclose(other.tool, one.tool, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("drive", DRIVES, ids=["ideal", "lag", "lag within a sample"])
@pytest.mark.parametrize("axis", ["z", "x", "b"])
def test_along_a_motion_the_table_is_followed(drive, axis):
    table = replace(OVER_Z, axis=axis, position=(-1.0, 8.0, 150.0))
    stage = machine(drive, replace(SHAPED_AT, table=table), (Mode(90.0, 0.01, 0.3),))
    command = moving(seconds=0.2)
    response = simulate(command, stage, Control(T, 20.0, 0, Feedforward(1.0, 1.0)))
    joint, rate = command.position, command.velocity
    if drive != IdealDrive():
        joint, rate = response.joint, np.zeros_like(response.joint)
        decay = np.exp(-T / drive.time_constant)
        for k in range(len(rate) - 1):
            rate[k + 1] = decay * rate[k] + (1.0 - decay) * drive.gain * response.drive[k]
    n = len(command) - 1
    bent = naive.vibration_over_position(stage.axes, joint, rate, response.drive[:n], T)
    assert np.abs(bent).max() > 1e-3
    assert_allclose((response.tool - response.position)[:n], bent, rtol=0.0, atol=1e-11)


def test_behind_a_motor_the_table_is_followed():
    """With one tick a sample the motor's speed follows from its positions, between which it is linear."""
    stage = machine(replace(MOTOR, velocity_loop=VelocityLoop(sample_time=T)))
    response = simulate(moving(seconds=0.2), stage, Control(T, 20.0, 0, Feedforward(1.0, 1.0)))
    rate = np.zeros_like(response.joint)
    for k, step in enumerate(np.diff(response.joint, axis=0)):
        rate[k + 1] = 2.0 * step / T - rate[k]
    n = len(rate) - 1
    bent = naive.vibration_over_position(stage.axes, response.joint, rate, response.drive[:n], T)
    assert np.abs(bent).max() > 0.05
    assert_allclose((response.tool - response.position)[:n], bent, rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("drive", [*DRIVES, MOTOR], ids=["ideal", "lag", "lag within a sample", "motor"])
def test_where_the_axis_rests_the_mode_is_that_of_the_place(drive):
    command, loop = moving(seconds=0.2, reach=0.0), Control(T, 20.0, 0, Feedforward(1.0, 1.0))
    command = replace(command, position=frozen(command.position + np.array([0.0, 0.0, 70.0])))
    found = simulate(command, machine(drive), loop)
    expected = simulate(command, machine(drive, SHAPED_AT.at(70.0)), loop)
    assert np.abs(expected.tool - expected.position).max() > 0.01
    assert_allclose(found.tool, expected.tool, rtol=0.0, atol=1e-12 if drive != MOTOR else 1e-6)


def test_an_axis_that_does_not_move_stands_at_zero():
    command = point_to_point(T, axes=("x",))
    stage = machine(mode=SHAPED_AT)
    there = simulate(command, machine(mode=SHAPED_AT.at(0.0)), Control(T))
    assert_allclose(simulate(command, stage, Control(T)).tool, there.tool, rtol=0.0, atol=1e-12)


def test_behind_joints_that_are_no_axes_the_position_is_cartesian():
    command = moving()
    stage = replace(machine(), joints=(IdealDrive(),) * 3)
    found = simulate(command, stage, Control(T), corexy())
    expected = simulate(command, machine(), Control(T))
    assert np.abs(expected.tool - expected.position).max() > 0.01
    assert_allclose(found.tool, expected.tool, rtol=0.0, atol=1e-9)


def test_frozen_samples_converge_to_the_equation_whose_mode_moves():
    """The error of freezing is of first order: it halves with the sample time."""

    def error(sample_time):
        command = moving(sample_time)
        response = simulate(command, machine(), Control(sample_time))
        time = command.arc_length

        def equation(t, state):
            frequency, zeta = OVER_Z.at(200.0 * (t / 0.4 - np.sin(5.0 * np.pi * t) / (2.0 * np.pi)))
            omega = 2.0 * np.pi * frequency
            push = 45.0 * (5.0 * np.pi) ** 2 * np.cos(15.0 * np.pi * t)
            return [state[1], -2.0 * zeta * omega * state[1] - omega**2 * state[0] - 0.7 * push]

        exact = solve_ivp(equation, (0.0, time[-1]), [0.0, 0.0], t_eval=time, rtol=1e-10, atol=1e-12)
        return np.abs((response.tool - response.position)[:, 0] - exact.y[0]).max(), np.abs(exact.y[0]).max()

    coarse, size = error(T)
    fine, _ = error(T / 2.0)
    assert coarse < 0.02 * size
    assert_allclose(coarse / fine, 2.0, rtol=0.05)


@pytest.mark.parametrize("drive", [FirstOrderLag(0.0153, 0.993), MOTOR], ids=["lag", "motor"])
@pytest.mark.parametrize("chunk", [1, 7, 64])
def test_streamed_equals_whole_bit_for_bit(chunk, drive):
    command = moving(seconds=0.2)
    stage = machine(drive, more=(Mode(90.0, 0.01, 0.3),))
    step = simulating(stage, Control(T, 20.0, 1, Feedforward(1.0, 1.0), CrossCoupling(20.0)))
    state, parts = None, []
    for low in range(0, len(command), chunk):
        high = min(low + chunk, len(command))
        state, out = step(state, None, part(command, low, high), high == len(command))
        parts.append(out)
    state_whole, whole = step(None, None, command, True)
    for name in ("joint", "tool", "drive"):
        assert_array_equal(np.concatenate([getattr(p, name) for p in parts]), getattr(whole, name))
    assert_array_equal(state.settling, state_whole.settling)


def test_axes_without_tables_keep_their_bits():
    plain = Axis("x", LIMITS, FirstOrderLag(0.0153, 0.993), (Mode(33.7, 0.02), Mode(90.0, 0.01)))
    tabled = Axis("y", LIMITS, IdealDrive(), (SHAPED_AT,))
    alone, beside = discretise([plain], T), discretise([plain, tabled], T)
    assert_array_equal(beside.transition[0], alone.transition[0])
    command = circling(T, 5.0, 50.0, 0.8)
    still = replace(tabled, modes=(replace(SHAPED_AT, table=None),))
    one, other = (simulate(command, Machine("test", (plain, y)), Control(T)) for y in (tabled, still))
    assert_array_equal(one.tool[:, 0], other.tool[:, 0])
    assert not np.array_equal(one.tool[:, 1], other.tool[:, 1])


# --- against the design point ---------------------------------------------------------------------


def test_a_shaper_leaves_least_where_it_was_designed_and_what_theory_says_elsewhere():
    """Residual vibration over that of the same move unshaped, at rest at several heights."""
    undamped = Mode(40.0, 0.0, table=ModeTable("z", (0.0, 100.0, 300.0), (50.0, 40.0, 25.0), (0.0, 0.0, 0.0)))
    shaper, stage = zv(undamped), machine(mode=undamped)
    ratios = {}
    for height in (0.0, 50.0, 80.0, 100.0, 140.0, 220.0):
        command = point_to_point(T, distance=1.5, acceleration=16_000.0)
        lift = np.array([0.0, 0.0, height])
        command = replace(command, position=frozen(command.position + lift))
        left = []
        for told in (shape(command, {"x": shaper}), command):
            state, _ = simulating(stage, Control(T))(None, None, told, True)
            left.append(state.residual[0])
        ratios[height] = left[0] / left[1]
        theory = residual_vibration(shaper, undamped, undamped.table.at(height)[0] / 40.0)
        assert_allclose(ratios[height], theory, rtol=0.02, atol=2e-3)
    assert ratios[100.0] < 2e-3
    assert ratios[0.0] > ratios[50.0] > ratios[80.0] > ratios[100.0] < ratios[140.0] < ratios[220.0]


# --- the machine file -----------------------------------------------------------------------------

FILE = """axes:
  x:
    limits: {{velocity_mm_s: 300, acceleration_mm_s2: 3000}}
    modes:
      - frequency_hz: 40
        damping_ratio: 0.03
        over_position: {{{keys}}}
  a:
    limits: {{velocity_deg_s: 90, acceleration_deg_s2: 900}}
"""


def parse(keys):
    return parse_machine(FILE.format(keys=keys).encode(), "machine.yaml")


def table_of(keys):
    return parse(keys).machine.axis("x").modes[0].table


@pytest.mark.parametrize(
    ("keys", "table"),
    [
        (
            "axis: z, position_mm: [0, 100, 300], frequency_hz: [50, 40, 25], damping_ratio: [0.02, 0.03, 0.01]",
            OVER_Z,
        ),
        (
            "position_mm: [0, 9], frequency_hz: [50, 40]",
            ModeTable("x", (0.0, 9.0), (50.0, 40.0), (0.03, 0.03)),
        ),
        (
            "axis: a, position_deg: [-90, 37], frequency_hz: [50, 40], damping_ratio: 0",
            ModeTable("a", (-90 * DEGREE, 37 * DEGREE), (50.0, 40.0), (0.0, 0.0)),
        ),
    ],
    ids=["all keys", "least keys", "rotary"],
)
def test_a_machine_file_says_it_and_a_dump_says_it_again(keys, table):
    setup = parse(keys)
    assert setup.machine.axis("x").modes == (Mode(40.0, 0.03, table=table),)
    assert parse_machine(dump_machine(setup).encode(), "dump") == setup


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("frequency_hz: [50, 40]", "7:24: error: axes.x.modes[0].over_position: position_mm is missing"),
        (
            "axis: a, position_mm: [0, 1], frequency_hz: [50, 40]",
            "7:47: error: axes.x.modes[0].over_position.position_mm: axis a stands in degrees",
        ),
        ("position_deg: [0, 1], frequency_hz: [50, 40]", "axis x stands in mm"),
        (
            "position_mm: [0, 2, 1], frequency_hz: [50, 40, 30]",
            "7:45: error: axes.x.modes[0].over_position.position_mm[2]: 1 is not above 2 before it",
        ),
        ("position_mm: [0, 2, 3], frequency_hz: [50, 40]", "frequency_hz: 2 values for 3 positions"),
        (
            "position_mm: [0, 2], frequency_hz: [50, 40], damping_ratio: [0.1, 0.1, 0.1]",
            "damping_ratio: 3 values for 2 positions",
        ),
        ("position_mm: [0, 2], frequency_hz: [50, 40], damping_ratio: []", "at least 1"),
        ("position_mm: [0], frequency_hz: [50]", "at least 2"),
        ("position_mm: [0, 2], frequency_hz: [50, 0]", "at least 0.001, not 0"),
        (
            "position_mm: [0, 2], frequency_hz: [50, 40], damping_ratio: soft",
            "must be a number, not the text",
        ),
        ("position_mm: [0, 2], frequency_hz: [50, 40], damping_ratio: 1", "less than 1"),
        ("axis: u, position_mm: [0, 2], frequency_hz: [50, 40]", "must be x, y, z, a, b or c"),
        ("positions_mm: [0, 2], frequency_hz: [50, 40]", "unknown key"),
    ],
)
def test_what_a_machine_file_cannot_mean_is_refused_at_its_place(keys, message):
    with pytest.raises(ConfigError) as refused:
        parse(keys)
    assert message in str(refused.value)


def test_the_example_of_the_documentation_is_a_machine():
    text = (ROOT / "docs" / "machine-file.md").read_text(encoding="utf-8")
    example = text.split("## Modes over position")[1].split("```yaml")[1].split("```")[0]
    setup = parse_machine(example.encode(), "example.yaml")
    table = setup.machine.axis("x").modes[0].table
    assert table == ModeTable("z", (-300.0, -100.0, 0.0), (28.0, 40.0, 48.0), (0.02, 0.03, 0.03))
