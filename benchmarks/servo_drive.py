"""Servo motors with observer and adapting gain: a tick of an axis, and whole simulations in real time."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import Kind, Row, best_of, report
from benchmarks.motions import SAMPLE_TIME, command, toolpath
from cnc_shape.arrays import frozen
from cnc_shape.config import load_machine
from cnc_shape.config.bundled import bundled
from cnc_shape.contour import contour_error
from cnc_shape.controllers.loop import Command
from cnc_shape.joints import joints_of
from cnc_shape.servo import NO_POSES, PathWindows, make_loop
from cnc_shape.simulation import simulate
from cnc_shape.windows import foot_windows

BLOCKS = 20_000
ROUNDS = 7
RECORDED = 42.0  # ns an axis and tick, of the compiled prototype: motor, velocity loop, observer, adaptation
REAL_TIME = 300.0
KIND = "printer"
BACK, AHEAD, MARGIN = 91, 35, 0.5  # samples and mm, of the windows for a position gain of 44.67 1/s


def rows() -> Iterator[Row]:
    """Measure."""
    setup = load_machine(bundled("servo_three_axis.yaml"))
    motion, path = command(KIND, BLOCKS), toolpath(KIND, BLOCKS)
    steps = len(motion)
    joints = joints_of(setup.machine.with_axes(motion.axes))
    loop = make_loop(joints, setup.control)
    told = Command(motion.position, motion.velocity, motion.acceleration, motion.position, motion.velocity)
    load = frozen(np.full((steps - 1, loop.motors.ticks, len(joints.drives)), 0.5))

    def run() -> None:
        loop.run(loop.start(motion.position[0]), told, NO_POSES, PathWindows(), load)

    run()
    ticks = (steps - 1) * loop.motors.ticks * len(joints.drives)
    ours = best_of(ROUNDS, run) / ticks
    stage = "observer and adaptation, with motor and velocity loop"
    yield Row(stage, Kind.SHARE, 2.0, "compiled prototype (recorded)", "ns/axis-tick", ours * 1e9, RECORDED)

    windows = foot_windows(motion.arc_length, BACK, AHEAD, MARGIN)

    def whole(*, measured: bool) -> None:
        response = simulate(
            motion, setup.machine, setup.control, toolpath=path, disturbances=setup.disturbances
        )
        if measured:
            contour_error(response.position, path, *windows)

    for measured, how in ((False, "simulated"), (True, "with its contour error")):
        whole(measured=measured)
        ours = best_of(ROUNDS, partial(whole, measured=measured)) / steps
        stage = f"3 servo axes under load, {how}"
        period = SAMPLE_TIME * 1e9
        yield Row(stage, Kind.SPEED_UP, REAL_TIME, "the motion itself", "ns/step", ours * 1e9, period)


if __name__ == "__main__":
    report(rows())
