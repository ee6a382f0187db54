"""Kinematics: there and back, rates against differences, and the two Jacobians of paper 004."""

from dataclasses import replace
from itertools import pairwise

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from cnc_shape.arrays import frozen
from cnc_shape.errors import OptionError
from cnc_shape.experiments.contour_control.rigs import RAILS
from cnc_shape.kernels.linear import conditions, solve
from cnc_shape.kinematics import (
    KINEMATICS,
    Rails,
    cartesian,
    corexy,
    cubic_parallel,
    cubic_rails,
    first_refusal,
    linear_delta,
    stewart,
    trunnion_ac,
)
from cnc_shape.kinematics.cubic_parallel import legs_on, reciprocal_jacobian
from cnc_shape.kinematics.cubic_parallel_screws import (
    origin_jacobian,
    screw_jacobian,
    screw_jacobian_as_printed,
)
from cnc_shape.kinematics.legs import Legs, orientation, twist_jacobian, twist_rates
from cnc_shape.kinematics.reach import BLOCK, condition
from cnc_shape.kinematics.trunnion_ac import angles_of, tool_direction

CUBE, TOOL = RAILS, RAILS.tool_offset
PIVOT = np.array([12.0, -7.0, -80.0])


def ring(radius, degrees, height):
    angle = np.radians(degrees)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(6, height)], axis=1)


BASE, PLATFORM = ring(200, [-40, 60, 80, 180, 200, 300], -300), ring(80, [0, 20, 120, 140, 240, 260], 0)
SIX = Legs(np.zeros((6, 3)), BASE, PLATFORM - np.array([0, 0, 40.0]), np.zeros(6))


def user_rails(seed):
    """Rails as a user may have them: tilted, of any length of direction, with unequal links."""
    random = np.random.default_rng(seed)
    direction = CUBE.direction * 2.5 + random.uniform(-0.4, 0.4, (6, 3))
    point = CUBE.platform_point + random.uniform(-8, 8, (6, 3))
    length = random.uniform(260, 380, 6)
    unit = direction / np.linalg.norm(direction, axis=1)[:, None]
    origin = point - TOOL - length[:, None] * unit + random.uniform(-15, 15, (6, 3))
    return Rails(direction, point, origin, length, TOOL)


MACHINES = {
    "cartesian": cartesian(),
    "corexy": corexy(),
    "linear_delta": linear_delta(150.0, 300.0),
    "cubic_parallel": cubic_parallel(CUBE),
    "cubic_parallel of a user": cubic_parallel(user_rails(4)),
    "stewart": stewart(BASE, PLATFORM, np.array([0, 0, 40.0])),
    "trunnion_ac": trunnion_ac(PIVOT),
}
every_machine = pytest.mark.parametrize("machine", MACHINES.values(), ids=MACHINES)


def poses(machine, count, seed=1):
    """Poses of the tested workspace: at most 60 mm away along each axis, turned by at most 0.25 rad."""
    reach = [60.0] * 3 + [0.25] * (len(machine.axes) - 3)
    return np.random.default_rng(seed).uniform(-1, 1, (count, len(reach))) * reach


def random_poses(count, seed=2):
    """Positions and orientations, those by vectors of rotation."""
    random = np.random.default_rng(seed)
    return random.uniform(-60, 60, (count, 3)), Rotation.from_rotvec(
        random.uniform(-0.25, 0.25, (count, 3))
    ).as_matrix()


# --- every machine ----------------------------------------------------------------------------------


def test_every_kinematics_is_tested():
    assert {machine.name for machine in MACHINES.values()} == set(KINEMATICS)
    assert all(machine.name == name.split()[0] for name, machine in MACHINES.items())


@every_machine
@pytest.mark.parametrize("away", [0.0, 1.0], ids=["from home", "from nearby"])
def test_there_and_back(machine, away):
    axes = poses(machine, 2000)
    near = away * (axes + poses(machine, 2000, seed=2) / 60)
    assert_allclose(machine.forward(machine.inverse(axes), near), axes, rtol=0, atol=1e-9)


@every_machine
def test_rates_are_the_derivatives_of_the_joints(machine):
    axes = poses(machine, 50)
    expected = [naive.rates(lambda row: machine.inverse(row[None])[0], row) for row in axes]
    assert_allclose(machine.inverse_jacobian(axes), expected, rtol=0, atol=5e-9)


@every_machine
def test_rows_do_not_know_one_another(machine):
    axes = poses(machine, 40)
    axes[10:20, 3:] = axes[10, 3:]  # an orientation that stays
    for k in range(3, axes.shape[1]):  # and angles that change one at a time
        axes[10 + k : 20, k] += 0.1
    joints, near = machine.inverse(axes), axes + poses(machine, 40, seed=2) / 60
    for cuts in ([7], [1, 2, 11, 12, 30], range(41)):
        edges = [0, *cuts, 40]
        parts = [slice(*edge) for edge in pairwise(edges)]
        for whole, pieces in (
            (joints, [machine.inverse(axes[part]) for part in parts]),
            (machine.forward(joints, near), [machine.forward(joints[part], near[part]) for part in parts]),
            (machine.inverse_jacobian(axes), [machine.inverse_jacobian(axes[part]) for part in parts]),
        ):
            assert_array_equal(np.concatenate(pieces), whole)


@every_machine
def test_the_tested_workspace_is_not_refused(machine):
    assert first_refusal(machine, poses(machine, 3000)) is None


@pytest.mark.parametrize("machine", list(MACHINES.values())[2:], ids=list(MACHINES)[2:])
def test_rows_of_another_width_are_refused(machine):
    for function in (machine.inverse, machine.inverse_jacobian):
        with pytest.raises(ValueError, match="shape"):
            function(np.zeros((4, 2)))
    with pytest.raises(ValueError, match="shape"):
        machine.forward(np.zeros(len(machine.axes)), np.zeros(len(machine.axes)))


# --- hexapods ---------------------------------------------------------------------------------------

HEXAPODS = {
    "cubic_parallel": (MACHINES["cubic_parallel"], legs_on(CUBE)),
    "cubic_parallel of a user": (MACHINES["cubic_parallel of a user"], legs_on(user_rails(4))),
    "stewart": (MACHINES["stewart"], SIX),
}
every_hexapod = pytest.mark.parametrize(("machine", "legs"), HEXAPODS.values(), ids=HEXAPODS)


@every_hexapod
def test_joints_and_poses_equal_their_slow_twins(machine, legs):
    axes = poses(machine, 12)
    joints = np.array([naive.leg_joints(row, legs) for row in axes])
    assert_allclose(machine.inverse(axes), joints, rtol=0, atol=1e-10)
    home = np.zeros_like(axes)
    found = [
        naive.pose_of(row, start, lambda pose: machine.inverse(pose[None])[0])
        for row, start in zip(joints, home, strict=True)
    ]
    assert_allclose(machine.forward(joints, home), found, rtol=0, atol=1e-8)


@every_hexapod
def test_axis_rates_are_twists_through_the_rates_of_the_angles(machine, legs):
    axes = poses(machine, 50)
    twist = [
        twist_jacobian(legs, row[:3], rotation) for row, rotation in zip(axes, orientation(axes), strict=True)
    ]
    assert_allclose(twist @ twist_rates(axes), machine.inverse_jacobian(axes), rtol=0, atol=1e-11)


def test_orientation_turns_about_x_then_y_then_z():
    axes = poses(MACHINES["stewart"], 50) * 4
    assert_allclose(orientation(axes), [naive.turned(row) for row in axes], atol=1e-15)


@given(seed=st.integers(0, 10**6), size=st.sampled_from([1e-9, 1e-3, 1.0, 3.0]))
def test_turn_is_the_angle_between_orientations(seed, size):
    first = poses(MACHINES["stewart"], 20, seed) * 4
    second = first + size * poses(MACHINES["stewart"], 20, seed + 1)
    between = Rotation.from_matrix(orientation(first)).inv() * Rotation.from_matrix(orientation(second))
    assert_allclose(MACHINES["stewart"].turn(first, second), between.magnitude(), rtol=1e-6, atol=1e-15)


def test_joints_of_the_cube_are_zero_at_home():
    assert_allclose(MACHINES["cubic_parallel"].inverse(np.zeros((1, 6))), np.zeros((1, 6)), atol=1e-13)


def test_a_slider_moves_with_the_platform_along_its_rail():
    joints = MACHINES["cubic_parallel"].inverse(np.array([[5.0, 0, 0, 0, 0, 0]]))[0]
    assert_allclose(joints[:2], [5.0, 5.0], atol=1e-12)
    assert_allclose(joints[2:], 300.0 - np.sqrt(300.0**2 - 5.0**2), atol=1e-12)


def test_condition_of_the_cube():  # a prototype: 2.68 .. 4.69 over 2000 random poses
    weight = np.diag([1, 1, 1, 1 / 60, 1 / 60, 1 / 60])
    number = [
        np.linalg.cond(reciprocal_jacobian(CUBE, *pose) @ weight)
        for pose in zip(*random_poses(2000), strict=True)
    ]
    assert 2.65 < min(number) < 2.75
    assert 4.3 < max(number) < 4.8


@pytest.mark.parametrize("size", [1.0, 30.0, 1000.0])
def test_large_machines_are_found_too(size):
    rails = cubic_rails(60.0 * size, 300.0 * size, size * TOOL)
    machine = cubic_parallel(rails)
    axes = poses(machine, 300) * [size, size, size, 1, 1, 1]
    assert_allclose(machine.forward(machine.inverse(axes), 0 * axes), axes, rtol=0, atol=1e-10 * size)


@pytest.mark.parametrize("name", ["cubic_parallel", "cubic_parallel of a user"])
def test_steps_that_lead_too_far_are_halved(name):
    machine = MACHINES[name]
    axes = 2 * poses(machine, 2000, seed=0)  # from home, full steps lose three of the user's
    assert_allclose(machine.forward(machine.inverse(axes), 0 * axes), axes, rtol=0, atol=1e-9)


def test_a_pose_that_no_joints_hold_is_nan():
    machine = MACHINES["stewart"]
    joints = np.stack([np.full(6, 1.0), machine.inverse(np.zeros((1, 6)))[0]])
    found = machine.forward(joints, np.zeros((2, 6)))
    assert np.isnan(found[0]).all()
    assert_allclose(found[1], 0.0, atol=1e-10)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"direction": np.zeros((6, 3))}, "rail of q1 has no direction"),
        ({"direction": np.ones((5, 3))}, "direction has shape"),
        ({"platform_point": np.ones((6, 2))}, "platform_point has shape"),
        ({"origin": np.full((6, 3), np.nan)}, "not finite"),
        ({"link_length": np.ones(5)}, "link_length has shape"),
        ({"link_length": np.zeros(6)}, "link_length must be above 0"),
        ({"tool_offset": np.zeros(2)}, "tool_offset has shape"),
    ],
)
def test_rails_that_hold_no_platform_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        cubic_parallel(replace(CUBE, **change))


@pytest.mark.parametrize("sizes", [(0.0, 300.0), (60.0, -1.0), (np.nan, 300.0)])
def test_a_cube_without_size_is_refused(sizes):
    with pytest.raises(OptionError, match="must be above 0"):
        cubic_rails(*sizes, TOOL)


# --- the Jacobians of the paper ---------------------------------------------------------------------


@pytest.mark.parametrize("rails", [CUBE, *map(user_rails, range(5))], ids=lambda rails: "")
def test_minus_in_eq_4_is_right(rails):
    for pose in zip(*random_poses(20), strict=True):
        right = np.linalg.inv(reciprocal_jacobian(rails, *pose))
        assert_allclose(screw_jacobian(rails, *pose), right, rtol=0, atol=1e-10 * np.abs(right).max())
        assert_allclose(
            naive.leg_twists(legs_on(rails), *pose), right, rtol=0, atol=1e-10 * np.abs(right).max()
        )


def test_plus_in_eq_4_is_wrong_by_twice_the_jacobian():  # measured: a relative error of 2.000
    for pose in zip(*random_poses(20), strict=True):
        right, printed = screw_jacobian(CUBE, *pose), screw_jacobian_as_printed(CUBE, *pose)
        active = np.zeros((6, 6))
        active[:3, 0] = CUBE.direction[0]
        assert_allclose(printed, 2 * active - right, atol=1e-10)
        assert np.abs(printed - right).max() / np.abs(right).max() == pytest.approx(2.0, abs=1e-3)


def test_screws_about_the_origin_tell_the_velocity_of_the_wrong_point():
    for position, rotation in zip(*random_poses(20), strict=True):
        right, wrong = screw_jacobian(CUBE, position, rotation), origin_jacobian(CUBE, position, rotation)
        assert_allclose(wrong[3:], right[3:], atol=1e-12)
        assert_allclose(wrong[:3], right[:3] + np.cross(position, right[3:].T).T, atol=1e-11)


# --- CoreXY and delta -------------------------------------------------------------------------------


def test_corexy_adds_and_subtracts():
    assert_array_equal(corexy().inverse(np.array([[3.0, 1.0, 7.0]])), [[4.0, 2.0, 7.0]])
    assert_array_equal(corexy().forward(np.array([[4.0, 2.0, 7.0]]), np.zeros((1, 3))), [[3.0, 1.0, 7.0]])
    assert_array_equal(corexy().inverse_jacobian(np.zeros((1, 3)))[0, :2, :2], [[1, 1], [1, -1]])


@pytest.mark.parametrize("order", [(90, 210, 330), (330, 210, 90), (10, 95, 300)])
def test_the_delta_hangs_where_surveyors_say(order):
    angles = np.radians(order)
    machine = linear_delta(150.0, 300.0, tuple(angles))
    joints = machine.inverse(poses(machine, 100))
    towers = 150.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    expected = [naive.trilateration(np.column_stack([towers, row]), 300.0) for row in joints]
    assert_allclose(machine.forward(joints, np.zeros_like(joints)), expected, atol=1e-11)


def test_the_carriages_of_a_delta_stand_level_over_its_centre():
    height = 5.0 + np.sqrt(300.0**2 - 150.0**2)
    assert_allclose(MACHINES["linear_delta"].inverse(np.array([[0.0, 0.0, 5.0]])), [[height] * 3])


@pytest.mark.parametrize(
    "arguments", [(0.0, 300.0), (150.0, 150.0), (150.0, np.inf), (150.0, 300.0, (0.0, 1.0, 1.0))]
)
def test_a_delta_that_cannot_move_is_refused(arguments):
    with pytest.raises(OptionError):
        linear_delta(*arguments)


# --- trunnion ---------------------------------------------------------------------------------------


def test_the_table_carries_the_workpiece_along():
    machine = MACHINES["trunnion_ac"]
    axes = poses(machine, 50) * [1, 1, 1, 4, 12]
    expected = [naive.tilted(row[:3], row[3], row[4], PIVOT) for row in axes]
    joints = machine.inverse(axes)
    assert_allclose(joints[:, :3], expected, atol=1e-12)
    assert_array_equal(joints[:, 3:], axes[:, 3:])
    back = machine.forward(joints, axes)
    assert_allclose(back, axes, rtol=0, atol=5 * 2e-14)  # prototype: 2e-14 at its largest


def test_the_tool_points_along_the_spindle_seen_from_the_table():
    a, c = np.random.default_rng(1).uniform(-np.pi, np.pi, (2, 50))
    spindle = [naive.tilted(tool_direction(*angles), *angles, 0.0) for angles in zip(a, c, strict=True)]
    assert_allclose(spindle, np.tile([0.0, 0.0, 1.0], (50, 1)), atol=1e-14)


def test_angles_come_back_from_directions():
    random = np.random.default_rng(1)
    a, c = random.uniform(0.01, 3.0, 200), np.cumsum(random.uniform(-2.0, 2.0, 200))
    assert_allclose(angles_of(tool_direction(a, c), 0.0), [a, c], rtol=0, atol=1e-12)


def test_the_table_stays_while_the_tool_is_upright():
    directions = tool_direction(np.array([0.0, 0.3, 0.0, 0.0, 0.3]), np.array([9.0, 1.0, 2.0, 3.0, 1.5]))
    a, c = angles_of(directions, 0.7)
    assert_allclose(a, [0.0, 0.3, 0.0, 0.0, 0.3], atol=1e-15)
    assert_allclose(c, [0.7, 1.0, 1.0, 1.0, 1.5], atol=1e-15)


def test_turn_of_a_table_is_the_angle_between_tool_directions():
    turn = MACHINES["trunnion_ac"].turn
    level, tilted = np.zeros((2, 5)), np.zeros((2, 5))
    level[:, 4] = 0.4
    tilted[:, 3:] = [[0.3, 2.0], [1e-8, 0.0]]
    assert_allclose(turn(level, tilted), [0.3, 1e-8], rtol=1e-12)
    assert_array_equal(
        turn(level, level + np.array([1, 2, 3, 0, 0.5])), [0.0, 0.0]
    )  # upright: turning is no tilt


# --- reach ------------------------------------------------------------------------------------------


def line(machine, end, count=200):
    """Poses on the way from home to `end`."""
    return np.linspace(0.0, 1.0, count)[:, None] * np.pad(end, (0, len(machine.axes) - len(end)))


def test_the_leg_that_cannot_reach_is_named():
    machine = MACHINES["linear_delta"]
    row, reason = first_refusal(machine, line(machine, [0.0, -160.0, 0.0], 161))
    assert row == 150  # 300 mm from the tower at y = 150
    assert reason == "leg q1 cannot reach"
    assert first_refusal(machine, line(machine, [0.0, -160.0, 0.0], 161)[:149]) is None


def test_all_legs_that_cannot_reach_are_named():
    machine = MACHINES["linear_delta"]
    assert first_refusal(machine, np.array([[0.0, 900.0, 0.0]])) == (0, "legs q1, q2, q3 cannot reach")


def test_a_late_row_is_counted_from_the_first():
    machine = MACHINES["cubic_parallel"]
    axes = np.zeros((2 * BLOCK + 5, 6))
    axes[BLOCK + 3, 1] = 400.0
    assert first_refusal(machine, axes)[0] == BLOCK + 3


def test_a_singular_pose_is_told():
    machine = stewart(ring(200, range(0, 360, 60), -300), ring(80, range(0, 360, 60), 0), np.zeros(3))
    row, reason = first_refusal(machine, np.zeros((1, 6)))  # both hexagons regular and alike
    assert row == 0
    assert reason.startswith("the pose is singular: condition number")


def test_angles_that_turn_about_one_axis_are_singular():
    machine = MACHINES["stewart"]
    axes = np.zeros((1, 6))
    axes[0, 4] = np.pi / 2
    assert "singular" in first_refusal(machine, axes)[1]
    assert first_refusal(machine, 0 * axes) is None


def test_a_singular_pose_between_two_rows_is_told():
    machine = MACHINES["stewart"]
    axes = np.zeros((2, 6))
    axes[1, 5] = np.radians(170.0)  # past the turn about z at which the legs lose hold
    assert first_refusal(machine, axes) == (1, "the way to the pose leads through a singular one")


def test_no_poses_are_not_refused():
    assert first_refusal(MACHINES["stewart"], np.zeros((0, 6))) is None


# --- linear systems ---------------------------------------------------------------------------------


@given(seed=st.integers(0, 10**6), size=st.integers(1, 7))
@settings(max_examples=50)
def test_small_systems_are_solved(seed, size):
    random = np.random.default_rng(seed)
    matrices, right = random.normal(size=(4, size, size)), random.normal(size=size)
    out, work = np.empty(size), np.empty((size, size))
    for matrix in matrices:
        kept = matrix.copy(), right.copy()
        determinant = solve(matrix, right, out, work)
        assert_allclose(matrix @ out, right, atol=1e-12 * np.linalg.cond(matrix))
        assert determinant == pytest.approx(np.linalg.det(matrix))
        assert_array_equal(matrix, kept[0])
        assert_array_equal(right, kept[1])
    rows, columns = frozen(random.uniform(0.1, 10, size)), frozen(random.uniform(0.1, 10, size))
    number, found = np.empty(4), np.empty(4)
    conditions(frozen(matrices), rows, columns, number, found)
    weighted = rows[:, None] * matrices * columns
    assert_allclose(number, [np.linalg.cond(matrix, 1) for matrix in weighted], rtol=1e-6)
    assert_allclose(found, np.linalg.det(weighted), rtol=1e-9)


def test_a_singular_system_has_no_answer():
    matrix, out = np.array([[1.0, 2.0], [2.0, 4.0]]), np.empty(2)
    assert solve(matrix, np.ones(2), out, np.empty((2, 2))) == 0.0
    assert np.isnan(out).all()
    number, determinant = np.empty(2), np.empty(2)
    conditions(frozen([matrix, matrix * np.nan]), frozen([1, 1]), frozen([1, 1]), number, determinant)
    assert number[0] == np.inf
    assert np.isnan(number[1])


def test_condition_does_not_depend_on_the_unit_of_length():
    small, large = cubic_rails(60.0, 300.0, TOOL), cubic_rails(600.0, 3000.0, 10 * TOOL)
    axes = poses(MACHINES["cubic_parallel"], 20)
    number, _ = condition(cubic_parallel(small), axes)
    scaled, _ = condition(cubic_parallel(large), axes * [10, 10, 10, 1, 1, 1])
    assert_allclose(scaled, number, rtol=1e-9)
