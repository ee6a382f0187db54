"""Every compiled function is held against an independent, slow definition: the table says where."""

import re
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parent
PACKAGE = TESTS.parent / "cnc_shape"
KERNEL = re.compile(r"^@(?:kernel|inlined)\ndef (\w+)", re.MULTILINE)

# module: what its kernels are compared with, and the test file that does it. Kernels of one module call
# one another; those that are called from outside are compared, and the rest with them.
TWINS = {
    "controllers/cross_coupling.py": ("naive.servo_loop", "test_simulation.py"),
    "controllers/disturbance_observer.py": ("naive_servo.run", "test_inertia_compensation.py"),
    "controllers/estimators.py": ("naive.servo_loop", "test_loop.py"),
    "controllers/feedforward.py": ("naive.servo_loop", "test_simulation.py"),
    "controllers/friction_feedforward.py": ("naive_servo.run", "test_inertia_compensation.py"),
    "controllers/inertia_compensation.py": ("naive_servo.run", "test_inertia_compensation.py"),
    "controllers/inertia_identification.py": ("naive_servo.run", "test_inertia_compensation.py"),
    "controllers/loop.py": ("naive.servo_loop", "test_simulation.py"),
    "controllers/motor_loop.py": ("naive_servo.run", "test_inertia_compensation.py"),
    "controllers/position_loop.py": ("naive.servo_loop", "test_simulation.py"),
    "controllers/servo_drive.py": ("naive_servo.run", "test_inertia_compensation.py"),
    "kernels/arcs.py": ("naive.contour_distance", "test_contour.py"),
    "kernels/cells.py": ("naive.hat_path", "test_smoothing.py"),
    "kernels/chords.py": ("naive.chords", "test_polyline.py"),
    "kernels/decimals.py": ("Fraction", "test_decimals.py"),
    "kernels/extremes.py": ("naive.extremes", "test_recording.py"),
    "kernels/foot_point.py": ("naive.polyline_distance", "test_contour.py"),
    "kernels/frames.py": ("naive.path_frames", "test_loading.py"),
    "kernels/hats.py": ("naive.hat_widths", "test_smoothing.py"),
    "kernels/jerk_caps.py": ("optimum.fastest", "test_jerk_optimum.py"),
    "kernels/jerk_cells.py": ("naive.path_excesses", "test_jerk_path_limits.py"),
    "kernels/jerk_certificate.py": ("naive.law_loads", "test_jerk.py"),
    "kernels/jerk_interior.py": ("solveh_banded", "test_jerk_kernels.py"),
    "kernels/jerk_law.py": ("optimum.fastest", "test_jerk_optimum.py"),
    "kernels/jerk_phases.py": ("np.roots", "test_jerk_kernels.py"),
    "kernels/jerk_pieces.py": ("np.cumsum", "test_jerk_kernels.py"),
    "kernels/jerk_refine.py": ("optimum.fastest", "test_jerk_optimum.py"),
    "kernels/jerk_rescue.py": ("naive.rest_to_rest", "test_jerk_streaming.py"),
    "kernels/jerk_rounding.py": ("naive.highest_below", "test_jerk.py"),
    "kernels/jerk_scan.py": ("naive.rest_to_rest", "test_jerk.py"),
    "kernels/jerk_spline.py": ("BSpline", "test_jerk_optimum.py"),
    "kernels/jerk_stretch.py": ("optimum.fastest", "test_jerk_optimum.py"),
    "kernels/jerk_windows.py": ("naive.rest_to_rest", "test_jerk_streaming.py"),
    "kernels/kinematics_delta.py": ("naive.trilateration", "test_kinematics.py"),
    "kernels/kinematics_legs.py": ("naive.leg_joints", "test_kinematics.py"),
    "kernels/kinematics_trunnion.py": ("naive.tilted", "test_kinematics.py"),
    "kernels/knots.py": ("naive.knots", "test_shaped_programs.py"),
    "kernels/layout.py": ("naive.curve_points", "test_contour.py"),
    "kernels/limit_use.py": ("naive.limit_use", "test_limit_use.py"),
    "kernels/linear.py": ("np.linalg", "test_kinematics.py"),
    "kernels/noise.py": ("naive.normal_noise", "test_noise.py"),
    "kernels/offsets.py": ("naive.smoothed_offset", "test_contour_compensation.py"),
    "kernels/passing.py": ("naive.passing_times", "test_cycle_time.py"),
    "kernels/path_limits.py": ("naive.path_excesses", "test_path_limits.py"),
    "kernels/plain_moves.py": ("COMPILED_FROM", "test_plain_moves.py"),  # the interpreter in Python
    "kernels/plain_rows.py": ("read_rows", "test_plain_rows.py"),  # the reader in Python
    "kernels/polyline.py": ("naive.tangent_polygon", "test_polyline.py"),
    "kernels/progress.py": ("naive.along_path", "test_path_shaping.py"),
    "kernels/ring.py": ("naive.filtered", "test_live.py"),
    "kernels/sampling.py": ("naive.samples", "test_trajectory.py"),
    "kernels/speed_limits.py": ("naive.speed_limits", "test_feedrate.py"),
    "kernels/structure.py": ("naive.vibration_over_position", "test_position_modes.py"),
    "kernels/sums.py": ("naive.squares", "test_sums.py"),
    "kernels/taps.py": ("naive.delayed_sum", "test_shaping.py"),
    "kernels/time_law.py": ("naive.fastest", "test_feedrate.py"),
}


def modules() -> list[str]:
    """Source files that hold a kernel."""
    return sorted(
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if KERNEL.search(path.read_text(encoding="utf-8"))
    )


def test_every_module_with_kernels_has_a_twin_and_only_those():
    assert modules() == sorted(TWINS)


@pytest.mark.parametrize("module", TWINS)
def test_the_twin_is_compared_where_the_table_says(module):
    twin, test = TWINS[module]
    assert re.search(rf"\b{re.escape(twin)}\b", (TESTS / test).read_text(encoding="utf-8"))
