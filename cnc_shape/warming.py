"""Warming: every kernel compiled ahead, by running the chain on programs that need them all.

numba compiles a kernel for the types it is called with, so the kernels are called as the commands call
them: small programs of every kind of move and table go through check, simulate and apply, whole and in
small chunks.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from cnc_shape.applying import Application
from cnc_shape.arrays import FloatArray, IntArray, frozen
from cnc_shape.cases import default_cases, timings
from cnc_shape.census import count
from cnc_shape.certificate import worst_violation
from cnc_shape.config.bundled import bundled
from cnc_shape.config.machine_file import load_machine
from cnc_shape.config.setup import Setup
from cnc_shape.cycle_time import cycle_time
from cnc_shape.disturbances import Disturbances, LoadTorque, PathDirection, Steps
from cnc_shape.kernels import compiled_count
from cnc_shape.kernels.noise import normal
from cnc_shape.kinematics import cubic_parallel, cubic_rails, first_refusal, linear_delta, trunnion_ac
from cnc_shape.limits import NO_PATH_LIMITS, PathLimits
from cnc_shape.loading import loading
from cnc_shape.motion import planned
from cnc_shape.opening import open_motion
from cnc_shape.pipeline import run
from cnc_shape.planning import plan
from cnc_shape.readers import ReadingOptions, read_program, reading
from cnc_shape.readers.source import COMPILED_FROM
from cnc_shape.recording.extremes import BUCKETS
from cnc_shape.shapers.discretisation import Interpolation
from cnc_shape.shapers.live import LiveShaper, filters
from cnc_shape.smoothing import Smoothing, smooth
from cnc_shape.toolpath import build_toolpath
from cnc_shape.trade import Trade
from cnc_shape.trajectory import Trajectory
from cnc_shape.writers.points import points_file, points_of
from cnc_shape.writers.program import write_program

MACHINES = (  # ideal and lagging drives and motors, with modes and without, under loads and not
    "xy_stage.yaml",
    "mill_three_axis.yaml",
    "servo_three_axis.yaml",
)
SMALL_CHUNK = 4  # rows, so that every stage is entered with a state
LINES = """G21 G90 G64 P0.02
G1 X10 F3000
X10 Y5
X9.9 Y5.1 Z-1
X0
"""
CURVES = """G21 G90 G17 G64 P0.02
G1 X10 F3000
G3 X0 Y10 I-10
G2 X0 Y10 Z2 I0 J-4
G3 X0 Y0 Z0 I0 J-5
G4 P0.1
G61
G1 X4 A10
G1 A0
G18 G2 X0 Z0 R2
G1 Y2
G0 X0 Y0
M2
"""
TABLE = "x_mm,y_mm,z_mm,feed_mm_min\n0,0,0,1200\n4,0,0,1200\n4,3,1,900\n2,3,0,900\n0,0,0,900\n"
TIMES = "time_s,x_mm,y_mm\n0,0,0\n0.01,0.1,0\n0.03,0.4,0.1\n0.05,0.5,0.2\n"
SAMPLES = 20 * BUCKETS  # more than a report keeps as they are
LONG = "G21 G90\nG1 X1 F3000\nG4 P{seconds}\nX0\n"
PROGRAMS = {"lines.nc": LINES, "curves.nc": CURVES, "table.csv": TABLE, "times.csv": TIMES}


def warm() -> Iterator[int]:
    """Compile every kernel for the types that the commands use; yields how many are compiled by now.

    What is compiled already is loaded and not compiled again.
    """
    machines = [load_machine(bundled(name)) for name in MACHINES]
    with tempfile.TemporaryDirectory(prefix="cnc-shape-") as folder:
        for name, text in PROGRAMS.items():
            path = Path(folder) / name
            path.write_text(text.ljust(COMPILED_FROM, "\n"))  # long enough for the compiled readers
            for options in (ReadingOptions(), ReadingOptions(rows=SMALL_CHUNK)):
                _check(path, options)
                yield compiled_count()
                for setup in machines:
                    _simulate(path, setup, options)
                    yield compiled_count()
                    _apply(path, setup, options)
                    yield compiled_count()
        for name in ("lines.nc", "curves.nc"):
            _certify(Path(folder) / name, machines[0])
            _clock(Path(folder) / name, machines[0])
        _thin(Path(folder) / "long.nc", machines[0])
        _stream(machines[0])
        _hold()
        _disturb()
        yield compiled_count()


def _check(path: Path, options: ReadingOptions) -> None:
    with reading(path, options) as opened:
        census = None
        points: list[dict[str, FloatArray | IntArray]] = []
        for chunk in opened.chunks:
            census = count(census, chunk)
            points.append(points_of(chunk))
        points_file(points)


def _clock(path: Path, setup: Setup) -> None:
    with reading(path) as opened:
        cycle_time(planned(opened.chunks, setup.machine, setup.planning.path_tolerance), setup.machine)


def _simulate(path: Path, setup: Setup, options: ReadingOptions) -> None:
    late = replace(setup, control=replace(setup.control, delay_samples=1))
    for variant in (setup, late):
        cases, trade = default_cases(variant), Trade(variant)
        with open_motion(str(path), variant, options, timings(cases), trade.timings) as motion:
            run(motion.blocks, variant, cases, motion.name, record=True, observers=[trade])


def _apply(path: Path, setup: Setup, options: ReadingOptions) -> None:
    shaping = setup.command_shaping(setup.planning.shaping)
    with open_motion(str(path), setup, options) as motion:
        work = Application(motion.blocks, setup.machine, shaping, setup.control.sample_time)
        write_program(path.with_suffix(".shaped.nc"), work.blocks(), force=True)
        work.summary()


def _thin(path: Path, setup: Setup) -> None:
    """Record more samples than are kept as they are."""
    path.write_text(LONG.format(seconds=SAMPLES * setup.control.sample_time))
    with open_motion(str(path), setup) as motion:
        run(motion.blocks, setup, default_cases(setup)[:1], motion.name, record=True)


def _stream(setup: Setup) -> None:
    sample_time = setup.control.sample_time
    wanted = filters(setup.acting_shapers, ("x", "y"), sample_time, Interpolation.LINEAR, {})
    LiveShaper(wanted).push(np.zeros(2))


def _hold() -> None:
    """Hold a pose with every kinematics that has kernels of its own."""
    nowhere = np.zeros(3)
    for machine in (
        cubic_parallel(cubic_rails(1.0, 5.0, nowhere)),
        linear_delta(1.0, 2.0),
        trunnion_ac(nowhere),
    ):
        poses = np.zeros((2, len(machine.axes)))
        first_refusal(machine, poses)
        machine.forward(machine.inverse(poses), poses)
        if machine.turn is not None:
            machine.turn(poses, poses)


def _disturb() -> None:
    """Load a path, and read an encoder in noise."""
    still = frozen(np.zeros((1, 3)))
    command = Trajectory(("x", "y", "z"), 1.0, frozen([0.0]), still, still, still)
    load = LoadTorque(PathDirection.NORMAL, 1.0, Steps((0.0,), (1.0,)))
    loading(Disturbances((load,)), command.axes, command.sample_time, 1)(None, command, 1)
    normal(0, 0, 0)


def _certify(path: Path, setup: Setup) -> None:
    program = read_program(path)
    limits = [axis.limits for axis in setup.machine.with_axes(program.axes).axes]
    curve = smooth(build_toolpath(program), Smoothing(setup.planning.path_tolerance))
    gentle = [replace(limit, jerk=50.0 * limit.acceleration) for limit in limits]
    for wanted in (limits, gentle):
        for path_limits in (NO_PATH_LIMITS, PathLimits(500.0, 1e-3, 1e-3)):
            worst_violation(plan(curve, wanted, path_limits), wanted, path_limits=path_limits)
