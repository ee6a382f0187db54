"""The servo loop on any kinematics, with every estimator and form: its slow twin, and chunks."""

from __future__ import annotations

from dataclasses import replace

import naive
import numpy as np
import pytest
from commands import circling, part
from numpy.testing import assert_allclose, assert_array_equal
from paths import line, rows, toolpath

from cnc_shape.arrays import frozen
from cnc_shape.controllers import Control, CrossCoupling, Estimator, Feedforward, Form
from cnc_shape.controllers.stability import largest_stable_coupling
from cnc_shape.errors import InfeasibleError
from cnc_shape.experiments.contour_control import rigs
from cnc_shape.experiments.contour_control.rigs import PLANTS
from cnc_shape.kinematics import corexy, linear_delta, trunnion_ac
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, FirstOrderLag, Machine
from cnc_shape.modes import Mode
from cnc_shape.simulation import simulate, simulating
from cnc_shape.trajectory import Trajectory
from cnc_shape.windows import Reach

T = 1e-3
LIMITS = Limits(1000.0, 10_000.0)
CUBIC = rigs.CUBIC.kinematics
MACHINES = {
    "cartesian": (None, None),
    "corexy": (corexy(), PLANTS[:3]),
    "delta": (linear_delta(150.0, 300.0), PLANTS[:3]),
    "cubic": (CUBIC, PLANTS),
}
REACH = Reach(210, 80, 0.5)
PATH = [(3.0, 0.0), (5.0, 2.0), (5.0, 4.0), (2.0, 5.0)]


def polygon_run(feed=20.0, dwell=40) -> tuple[Trajectory, object]:
    """A polygon at constant feed, and rest after it; the path itself."""
    corners = np.array([(0.0, 0.0), *PATH])
    path = toolpath(*[line(x, y) for x, y in PATH])
    place = np.minimum(np.arange(0.0, path.arc_length[-1] / feed + dwell * T, T) * feed, path.arc_length[-1])
    columns = [np.interp(place, path.arc_length, column) for column in corners.T]
    position = np.column_stack([*columns, 0 * place])
    velocity = np.diff(position, axis=0, append=position[-1:]) / T
    acceleration = np.diff(velocity, axis=0, append=velocity[-1:]) / T
    return (
        Trajectory(
            ("x", "y", "z"), T, frozen(place), *(frozen(v) for v in (position, velocity, acceleration))
        ),
        path,
    )


def machine(drives, modes=()) -> Machine:
    own = PLANTS[:3] if drives is None else (FirstOrderLag(1.0),) * 3
    axes = tuple(Axis(name, LIMITS, drive, modes) for name, drive in zip("xyz", own, strict=True))
    return Machine("test", axes, drives or ())


def loop(estimator=Estimator.FOOT_POINT, form=Form.VECTOR, delay=0, every=1, orientation=0.0, feed=True):
    coupling = CrossCoupling(60.0, estimator, 400.0, 0.8, form, orientation)
    return Control(T, 20.0, delay, Feedforward(0.9, 0.8) if feed else None, coupling, every)


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("estimator", Estimator, ids=lambda e: e.name.lower())
@pytest.mark.parametrize("form", Form, ids=lambda f: f.name.lower())
def test_the_loop_equals_its_slow_twin(name, estimator, form):
    kinematics, drives = MACHINES[name]
    command, path = polygon_run()
    if estimator is Estimator.CIRCLE:
        command = circling(T, 5.0, 16.0, 0.5)
    control = loop(estimator, form, delay=1, every=7, orientation=30.0 if name == "cubic" else 0.0)
    stage = machine(drives)
    how = () if kinematics is None else (kinematics,)
    response = simulate(command, stage, control, *how, toolpath=path, reach=REACH)
    joint, _ = naive.servo_loop(command, stage.axes, control, kinematics, drives, path, REACH)
    near = 2e-6 if form is Form.SCALAR else 2e-9  # where the error is next to nothing, it has no direction
    assert_allclose(response.joint, joint, atol=near)
    if kinematics is not None:
        pose = np.zeros((len(command), len(kinematics.axes)))
        pose[:, :3] = command.position
        there = kinematics.forward(frozen(joint), frozen(pose))
        assert_allclose(response.position, there[:, :3], atol=near)


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("chunk", [1, 7, 64])
def test_streamed_equals_whole_bit_for_bit(name, chunk):
    kinematics, drives = MACHINES[name]
    command, path = polygon_run()
    control = loop(delay=1, every=5)
    how = () if kinematics is None else (kinematics,)
    step = simulating(machine(drives, (Mode(33.0, 0.02),)), control, *how, reach=REACH)
    state, parts = None, []
    pieces = [rows(path, k, k + 1) for k in range(len(path))]
    arrived = 0
    for low in range(0, len(command), chunk):
        high = min(low + chunk, len(command))
        while arrived < len(pieces) and command.arc_length[high - 1] >= path.arc_length[arrived]:
            state, out = step(state, pieces[arrived], part(command, low, low), False)
            parts.append(out)
            arrived += 1
        state, out = step(state, None, part(command, low, high), high == len(command))
        parts.append(out)
    whole_state, whole = step(None, path, command, True)
    for field in ("reference", "joint", "position", "tool", "drive", "turn"):
        assert_array_equal(np.concatenate([getattr(p, field) for p in parts]), getattr(whole, field))
    assert_array_equal(state.settling, whole_state.settling)


def test_structure_behind_joints_is_that_behind_axes_where_both_move_alike():
    """CoreXY with equal drives moves as a Cartesian machine does, and bends as it does."""
    modes = (Mode(30.0, 0.02, 0.8), Mode(100.0, 0.01, 0.2))
    command, _ = polygon_run()
    drive = FirstOrderLag(0.0148, 0.992)
    axes = tuple(Axis(name, LIMITS, drive, modes) for name in "xyz")
    straight = simulate(command, Machine("cartesian", axes), Control(T, 20.0))
    crossed = simulate(command, Machine("corexy", axes, (drive,) * 3), Control(T, 20.0), corexy())
    assert_allclose(crossed.position, straight.position, atol=1e-11)
    assert_allclose(crossed.tool, straight.tool, atol=2e-6)  # between samples the drives run along cubics


def test_a_pose_out_of_reach_is_told_with_its_line():
    path = toolpath(*[line(20.0 * k, 0.0) for k in range(1, 30)])
    place = np.linspace(0.0, path.arc_length[-1], 2000)
    position = np.column_stack([place, 0 * place, 0 * place])
    velocity = np.gradient(position, axis=0) / T
    command = Trajectory(
        ("x", "y", "z"), T, frozen(place), frozen(position), frozen(velocity), frozen(0 * velocity)
    )
    with pytest.raises(InfeasibleError, match=r"reach|singular") as refused:
        simulate(command, machine(PLANTS), Control(T, 20.0), CUBIC, path)
    assert refused.value.line is not None
    assert path.line[0] < refused.value.line < path.line[-1]


def test_five_axes_turn_the_workpiece():
    """A tilted circle on a trunnion: the drives follow, and the angle of the tool is told apart."""
    n = 1500
    ramp = np.clip(np.arange(n) / (n - 300), 0.0, 1.0)
    position = np.column_stack(
        [10 * np.sin(6 * ramp), 10 * np.cos(6 * ramp), 0 * ramp, 0.3 * ramp, 2.0 * ramp]
    )
    velocity = np.gradient(position, axis=0) / T
    acceleration = np.gradient(velocity, axis=0) / T
    command = Trajectory(
        ("x", "y", "z", "a", "c"),
        T,
        frozen(60 * ramp),
        frozen(position),
        frozen(velocity),
        frozen(acceleration),
    )
    axes = tuple(Axis(name, LIMITS) for name in command.axes)
    five = Machine("five", axes, PLANTS[:5])
    pivot = trunnion_ac(frozen([0.0, 0.0, -50.0]))
    response = simulate(command, five, Control(T, 20.0), pivot)
    assert response.turn.size == n
    assert response.turn.max() > 1e-3
    ideal = simulate(command, Machine("five", axes), Control(T, 20.0), pivot)
    assert_allclose(ideal.position, position, atol=1e-11)
    assert_allclose(ideal.turn, 0.0, atol=1e-7)


def test_joints_without_their_kinematics_are_a_wrong_call():
    command, _ = polygon_run()
    with pytest.raises(ValueError, match="give the kinematics"):
        simulate(command, machine(PLANTS), Control(T))


def test_an_error_of_ten_metres_is_a_loop_that_diverged():
    """The integral of a length grows without end; its first 100 m are no contour error to tell."""
    command, path = polygon_run(dwell=12_000)
    control = Control(T, 10.0, 3, None, CrossCoupling(10.0, Estimator.FOOT_POINT, 300.0, form=Form.SCALAR))
    with pytest.raises(InfeasibleError, match="the loop diverged: axis") as refused:
        simulate(command, machine(None), control, toolpath=path, reach=REACH)
    time = float(str(refused.value).split("t = ")[1].split()[0])
    before = command.cut(slice(0, round(time / T)))
    response = simulate(before, machine(None), control, toolpath=path, reach=REACH)
    assert 2e3 < np.abs(response.following_error).max() <= 1e4


def test_a_loop_that_becomes_unstable_on_the_way_is_refused_there():
    """Unlike drives on a delta: at the end of the way a third of the gain is stable that is at its start."""
    drives = (FirstOrderLag(0.03), FirstOrderLag(0.005), FirstOrderLag(0.005))
    kinematics, direction = linear_delta(150.0, 300.0), np.array([0.0, 1.0, -1.0]) / np.sqrt(2.0)
    place = 100.0 * np.clip(np.arange(3000) / 2600, 0.0, 1.0)
    position = [0.0, -60.0, 0.0] + place[:, None] * direction
    velocity = np.gradient(position, axis=0) / T
    velocity[0] = 0.0
    command = Trajectory(
        ("x", "y", "z"), T, frozen(place), frozen(position), frozen(velocity), frozen(0 * velocity)
    )
    first, final = kinematics.inverse_jacobian(frozen(position[[0, -1]]))[:, None]
    base = Control(T, 20.0, 2)
    least = largest_stable_coupling(drives, base, final, frozen(direction[None]))
    assert least < 0.4 * largest_stable_coupling(drives, base, first)
    path = toolpath(line(*position[-1]), start=tuple(position[0]))

    def run(gain):
        return simulate(
            command, machine(drives), replace(base, cross_coupling=CrossCoupling(gain)), kinematics, path
        )

    with pytest.raises(InfeasibleError, match="unstable across the path at X 0, Y -") as refused:
        run(1.5 * least)
    assert refused.value.line == 1
    run(0.95 * least)
