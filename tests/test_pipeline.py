"""The chain: chunks change nothing, samples keep their numbers, limits and tolerances."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from paths import arc, line, program

from cnc_shape.api import simulate_program
from cnc_shape.cases import default_cases, pick_cases, timings
from cnc_shape.certificate import worst_violation
from cnc_shape.config.bundled import bundled
from cnc_shape.config.machine_file import load_machine
from cnc_shape.config.setup import Planning, Shaping
from cnc_shape.controllers.compensation import DisturbanceObserver, InertiaCompensation
from cnc_shape.disturbances import UNDISTURBED, Disturbances, LoadTorque, PathDirection, SineBurst
from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, Machine, ServoMotor
from cnc_shape.motion import moving, replaying
from cnc_shape.opening import open_motion
from cnc_shape.pipeline import Case, run
from cnc_shape.planning import plan
from cnc_shape.readers import ReadingOptions, read_program, read_trajectory
from cnc_shape.recording import MOTORS, Signals
from cnc_shape.report.table import summary_json
from cnc_shape.shapers.contour_compensation import half_width
from cnc_shape.smoothing import Smoothing, smooth
from cnc_shape.toolpath import build_toolpath

GOLDEN = Path(__file__).parent / "golden"
SAMPLES = {
    "bracket.nc": "xy_stage.yaml",
    "pocket.nc": "mill_three_axis.yaml",
    "clover.csv": "xy_stage.yaml",
    "probing.nc": "cmm.yaml",
    "circle_time.csv": "xy_stage.yaml",
    "fan.nc": "cubic_parallel.yaml",
    "helix.nc": "cubic_parallel.yaml",
    "circle5_time.csv": "cubic_parallel.yaml",
    "servo_square.nc": "servo_three_axis.yaml",
    "tilted_circle_time.csv": "servo_three_axis.yaml",
}
PROGRAMS = [name for name in SAMPLES if not name.endswith("_time.csv")]


def setup_of(sample: str):
    return load_machine(bundled(SAMPLES[sample]))


def cut(whole, size: int):
    """A program in chunks of `size` moves."""
    columns = (
        "motion",
        "target",
        "center",
        "normal",
        "sweep",
        "feed_rate",
        "dwell",
        "path_mode",
        "path_tolerance",
        "merge_tolerance",
        "line",
    )
    for low in range(0, len(whole), size):
        start = whole.start if low == 0 else whole.target[low - 1]
        yield replace(
            whole, start=start, **{name: getattr(whole, name)[low : low + size] for name in columns}
        )


def same(first, second) -> None:
    """Equal to the last bit: scalars and every recorded sample."""
    assert first.summary == second.summary
    for mine, theirs in zip(first.signals, second.signals, strict=True):
        for name in set(Signals.__slots__) - {"motors"}:
            assert_array_equal(getattr(mine, name), getattr(theirs, name))
        for name in MOTORS if mine.motors is not None else ():
            assert_array_equal(getattr(mine.motors, name), getattr(theirs.motors, name))
    assert_array_equal(first.path, second.path)


@pytest.mark.parametrize("sample", PROGRAMS)
@pytest.mark.parametrize("rows", [1, 2, 7])
def test_a_streamed_sample_equals_the_whole_one_bit_for_bit(sample, rows):
    setup = setup_of(sample)
    whole = simulate_program(bundled(sample), setup)
    same(simulate_program(bundled(sample), setup, options=ReadingOptions(rows=rows)), whole)


def tiny_segments():
    """Straights of 2,000 segments of 10 um, corners after every one, an arc of three turns between them."""
    at, moves = np.zeros(3), []
    for k, direction in enumerate(([1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0])):
        for _ in range(500):
            at = at + 0.04 * np.array(direction)
            moves.append(line(*at, feed_rate=80.0))
        if k == 1:
            moves.append(arc(tuple(at), (at[0] + 4.0, at[1], at[2]), 6 * np.pi, feed_rate=60.0))
    return program(*moves)


@pytest.mark.parametrize("size", [1, 499, 500, 501, 777])
def test_tiny_segments_with_corners_on_the_borders_of_chunks(size):
    setup = load_machine(bundled("xy_stage.yaml"))
    whole = tiny_segments()
    cases = default_cases(setup)

    def through(chunks):
        blocks = moving(chunks, setup.machine, 0.01, 1e-3, timings(cases))
        return run(blocks, setup, cases, "tiny", record=True)

    same(through(cut(whole, size)), through([whole]))


def servo_cases(setup, torque_limit: float = 7.1):
    """A machine with two servo motors, alone and with all its terms, each undisturbed and under a load."""
    motor = ServoMotor(4.6e-4, torque_limit, 10.0, viscous=5e-4, coulomb=0.08, encoder_counts=10_000)
    axes = [
        replace(axis, drive=motor, modes=()) if axis.name in "xy" else axis for axis in setup.machine.axes
    ]
    setup = replace(setup, machine=replace(setup.machine, axes=tuple(axes)))
    alone = replace(setup.control, cross_coupling=None)
    helped = replace(
        alone, disturbance_observer=DisturbanceObserver(), inertia_compensation=InertiaCompensation()
    )
    load = Disturbances((LoadTorque(PathDirection.NORMAL, 2.5, SineBurst(4.0, 1.0, 0.3)),))
    shaping = setup.command_shaping(Shaping.NONE)
    return setup, [
        Case(name + "+disturbed" * bool(acts), shaping, control, disturbances=acts)
        for name, control in (("independent", alone), ("disturbance_observer+inertia_compensation", helped))
        for acts in (UNDISTURBED, load)
    ]


@pytest.mark.parametrize("size", [1, 500, 777])
def test_what_servo_motors_do_does_not_depend_on_chunks(size):
    setup, cases = servo_cases(load_machine(bundled("xy_stage.yaml")))
    whole = tiny_segments()

    def through(chunks):
        blocks = moving(chunks, setup.machine, 0.01, 1e-3, timings(cases))
        return run(blocks, setup, cases, "tiny", record=True)

    found = through([whole])
    same(through(cut(whole, size)), found)
    assert [case.disturbed for case in found.summary.cases] == [False, True, False, True]
    for case, signals in zip(found.summary.cases, found.signals, strict=True):
        motors = signals.motors
        assert motors.joints == tuple(motor.joint for motor in case.motors) == ("x", "y")
        for k, motor in enumerate(case.motors):
            assert motor.peak_torque == np.abs(motors.torque[:, k]).max()
            assert motor.peak_load == np.abs(motors.load[:, k]).max()
            assert motor.peak_gain_ratio == motors.gain_ratio[:, k].max()
            assert motor.saturated_share == np.mean(np.abs(motors.torque[:, k]) >= 7.1)
            assert (motor.peak_load > 1.0) == case.disturbed
    assert found.summary.cases[3].motors[0].peak_gain_ratio > 2.0


def test_a_weak_motor_is_at_its_limit_for_a_share_of_the_time():
    setup, cases = servo_cases(load_machine(bundled("xy_stage.yaml")), torque_limit=0.3)
    blocks = moving([tiny_segments()], setup.machine, 0.01, 1e-3, timings(cases))
    motors = run(blocks, setup, cases[1:2], "tiny").summary.cases[0].motors
    assert all(motor.peak_torque == 0.3 and 0.01 < motor.saturated_share < 1.0 for motor in motors)


@pytest.mark.parametrize("sample", SAMPLES)
def test_samples_keep_their_numbers(sample):
    """Golden summaries: a change that is meant to move them writes them anew, and says why."""
    got = summary_json(simulate_program(bundled(sample), setup_of(sample), record=False).summary)
    path = GOLDEN / f"{sample}.json"
    want = json.loads(path.read_text())
    assert [case["name"] for case in got["cases"]] == [case["name"] for case in want["cases"]]
    assert_allclose(got["cycle_time_s"], want["cycle_time_s"], rtol=1e-9)
    assert got["samples"] == want["samples"]
    for mine, theirs in zip(got["cases"], want["cases"], strict=True):
        for key, value in theirs.items():
            if isinstance(value, dict):
                assert mine[key] == pytest.approx(value, rel=1e-6, abs=1e-6)
            elif isinstance(value, float):
                assert mine[key] == pytest.approx(value, rel=1e-6, abs=1e-6), key
            else:
                assert mine[key] == value


@pytest.mark.parametrize("sample", PROGRAMS)
def test_every_sample_keeps_limits_and_tolerance(sample):
    setup = setup_of(sample)
    read = read_program(bundled(sample))
    toolpath = build_toolpath(read)
    path = smooth(toolpath, Smoothing(setup.planning.path_tolerance))
    limits = [axis.limits for axis in setup.machine.with_axes(read.axes).axes]
    assert worst_violation(plan(path, limits), limits, 33).worst <= 1e-6
    told = toolpath.path_tolerance[np.isfinite(toolpath.path_tolerance)]
    allowed = max(float(told.max(initial=0.0)), setup.planning.path_tolerance)
    summary = simulate_program(bundled(sample), setup, record=False).summary
    assert summary.cases[0].command.max <= allowed * (1 + 1e-9)


def test_shaping_pays_on_the_bundled_sample_and_has_its_price():
    summary = simulate_program(bundled("bracket.nc"), setup_of("bracket.nc"), record=False).summary
    unshaped, shaped, _ = summary.cases
    assert shaped.tool.rms < 0.3 * unshaped.tool.rms
    assert shaped.tool.max < 0.3 * unshaped.tool.max
    assert max(shaped.residual_vibration.values()) < 2e-3 * max(unshaped.residual_vibration.values())
    assert shaped.command.max > 5 * unshaped.command.max  # the price: corners of the command are rounded
    duration = max(shaper.duration for shaper in setup_of("bracket.nc").shapers.values())
    gains = pick_cases(setup_of("bracket.nc"), ["shaped"])[0].shaping.gains(("x", "y", "z"))
    longer = duration + 2.0 * half_width(gains)  # the shaper's impulses, and the compensation's window
    assert_allclose(shaped.cycle_time - unshaped.cycle_time, longer, rtol=1e-9)


def test_cases_of_a_machine_with_and_without_shapers():
    setup = load_machine(bundled("xy_stage.yaml"))
    assert [case.name for case in default_cases(setup)] == ["unshaped", "shaped", "shaped+cross_coupled"]
    unshaped = replace(setup, planning=Planning(0.01, Shaping.NONE))
    assert default_cases(unshaped)[0].name == "independent"
    assert default_cases(replace(setup, shapers={}))[0].name == "independent"
    alone = replace(setup, control=replace(setup.control, cross_coupling=None))
    assert [case.name for case in default_cases(alone)] == ["unshaped", "shaped"]
    plain, bare = pick_cases(setup, ["axis_shaped", "shaped-feedforward"])
    assert plain.control.feedforward is not None
    assert bare.control.feedforward is None
    picked = pick_cases(setup, ["contour_shaped", "path_shaped"])
    assert picked[0].shaping.structure is not None
    assert picked[1].timing.path_shaper is not None
    with pytest.raises(OptionError, match="no case called 'shape'"):
        pick_cases(setup, ["shape"])


def test_a_replayed_trajectory_bypasses_the_planner():
    setup = load_machine(bundled("xy_stage.yaml"))
    command, toolpath = read_trajectory(bundled("circle_time.csv"), 1e-3)
    result = run(replaying(command, toolpath), setup, default_cases(setup), "circle", record=False)
    assert result.summary.cases[0].command.max < 1e-3  # chords of a 0.12 mm polyline, resampled on it
    assert_allclose(result.summary.cycle_time, 2.195, atol=1e-3)


def test_an_axis_the_machine_lacks_is_named():
    setup = load_machine(bundled("xy_stage.yaml"))
    bare = replace(setup, machine=replace(setup.machine, axes=setup.machine.axes[:1]))
    cases = default_cases(bare)
    with open_motion(str(bundled("bracket.nc")), bare, None, timings(cases)) as motion:
        run(motion.blocks, bare, cases, motion.name)
    (warning,) = [text for text in motion.warnings() if "lacks" in text]
    assert "lacks Y, which" in warning


def test_a_move_beyond_the_travel_names_its_line():
    setup = load_machine(bundled("xy_stage.yaml"))
    short = Machine("short", (Axis("x", Limits(500.0, 5000.0, travel=(-10.0, 50.0))),))
    with pytest.raises(
        InfeasibleError, match=r"X reaches 60 mm, beyond its travel of -10 to 50 mm"
    ) as refused:
        simulate_program(bundled("bracket.nc"), replace(setup, machine=short))
    assert refused.value.line == 7


def test_a_program_that_moves_nothing_is_told():
    setup = load_machine(bundled("xy_stage.yaml"))
    with pytest.raises(InfeasibleError, match="moves nothing"):
        run(moving([program()], setup.machine, 0.01, 1e-3), setup, default_cases(setup), "empty.nc")


@pytest.mark.parametrize(
    "name",
    [
        "gp_screw.gcode", "lcnc_arcspiral.ngc", "lcnc_cds.ngc", "lcnc_lathe_pawn.ngc", "ugs_communicator.nc",
        "ugs_no_spaces.gcode", "cncjs_tball_pocket_laser.gcode", "camotics_tiger.nc", "ugs_rotation.ngc",
        "webgcode_pycam.ngc",
    ],
)  # fmt: skip
def test_real_programs_run_through_and_keep_their_tolerance(shared, name):
    setup = load_machine(bundled("xy_stage.yaml"))
    path = shared / "data" / "gcode" / "programs" / name
    summary = simulate_program(path, setup, ["unshaped"], record=False).summary
    (case,) = summary.cases
    assert 0.0 < case.command.max <= 0.01 * (1 + 1e-9)  # no G64 P in any of them: the machine's 0.01 mm
    naive = json.loads((path.parent / f"{name}.expected.json").read_text())
    assert summary.cycle_time > 0.9 * naive["feed_time_s"]
    assert np.isfinite([case.tool.max, case.drives.rms, *case.residual_vibration.values()]).all()
