"""The cross-coupled servo loop: of three axes against the same in pure Python, of six legs in real time."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial
from math import pi, sqrt
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import Kind, Row, best_of, report, workshop
from benchmarks.motions import LIMITS, SAMPLE_TIME, command
from cnc_shape.arrays import frozen
from cnc_shape.contour import contour_error
from cnc_shape.controllers import Control, CrossCoupling, Estimator, Feedforward
from cnc_shape.controllers.loop import Command, Poses
from cnc_shape.joints import Joints, joints_of
from cnc_shape.kinematics import cubic_parallel, cubic_rails
from cnc_shape.machine import Axis, FirstOrderLag, Machine
from cnc_shape.planning import plan
from cnc_shape.plant import discretise
from cnc_shape.readers import read_program
from cnc_shape.segments import path_table, segments
from cnc_shape.servo import PathWindows, ServoLoop, make_loop
from cnc_shape.simulation import simulate, simulating
from cnc_shape.smoothing import Smoothing, smooth
from cnc_shape.toolpath import Toolpath, build_toolpath
from cnc_shape.trajectory import BLOCK, Trajectory, sample
from cnc_shape.windows import foot_windows

BLOCKS = 50_000
STEPS = 20_000  # of the loop in Python
ROUNDS = 5
DRIVES = ((0.0153, 0.9930), (0.0142, 0.9982), (0.0150, 1.0))  # time constant in s, gain
MACHINE = Machine(
    "lag drives",
    tuple(
        Axis(name, limits, FirstOrderLag(*drive))
        for name, limits, drive in zip("xyz", LIMITS, DRIVES, strict=True)
    ),
)
GAIN, COUPLING = 20.0, 80.0  # 1/s
CONTROL = Control(SAMPLE_TIME, GAIN, 0, Feedforward(1.0, 1.0), CrossCoupling(COUPLING))
SIX = Machine(
    "six legs", tuple(Axis(name, limits) for name, limits in zip("xyz", LIMITS, strict=True)),
    tuple(FirstOrderLag(*DRIVES[leg % 3]) for leg in range(6)),
)  # fmt: skip
PARALLEL = cubic_parallel(cubic_rails(60.0, 300.0, frozen([0.0, 0.0, -60.0])))
FEED = 16.0  # mm/s
Vector = list[float]


def loop_in_python(position: list[Vector], velocity: list[Vector]) -> list[Vector]:
    """Positions of the drives under a command; every step adds up the same terms as the compiled loop."""
    plant = discretise(MACHINE.axes, SAMPLE_TIME)
    ahead = plant.transition[:, 0, 1].tolist()  # position from velocity
    decay = plant.transition[:, 1, 1].tolist()
    push, pull = plant.held[:, 0].tolist(), plant.held[:, 1].tolist()  # position, velocity from drive
    forward = [1.0 / gain for _, gain in DRIVES]
    inverse = [tau / gain for tau, gain in DRIVES]
    q, speed, tangent = list(position[0]), [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    found: list[Vector] = []
    for k in range(len(position) - 1):
        found.append(list(q))
        now, then, v, w = position[k], position[k + 1], velocity[k], velocity[k + 1]
        following = [now[0] - q[0], now[1] - q[1], now[2] - q[2]]
        norm = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        if norm > 0.0:
            tangent = [v[0] / norm, v[1] / norm, v[2] / norm]
        along = following[0] * tangent[0] + following[1] * tangent[1] + following[2] * tangent[2]
        for i in range(3):
            drive = GAIN * following[i]
            drive += forward[i] * (then[i] - now[i]) / SAMPLE_TIME + inverse[i] * (w[i] - v[i]) / SAMPLE_TIME
            drive += COUPLING * (following[i] - along * tangent[i])
            q[i] += ahead[i] * speed[i] + push[i] * drive
            speed[i] = decay[i] * speed[i] + pull[i] * drive
    return found


def circling(seconds: float) -> tuple[Trajectory, Toolpath]:
    """Circles about the home pose of the parallel machine, and the path they are."""
    text = "G21 G90 G17 G64 P0.01\nG1 X20 F960\n" + "G3 I-20\n" * round(seconds * FEED / (2 * pi * 20.0))
    with workshop() as folder:
        file = folder / "circles.nc"
        file.write_text(text)
        path = build_toolpath(read_program(file))
    return sample(plan(smooth(path, Smoothing(0.01)), LIMITS), SAMPLE_TIME), path


def parallel_rows() -> Iterator[Row]:
    """Measure the loop of six drives in real time, and beside one linear solution a step."""
    motion, path = circling(60.0)
    steps = len(motion)
    poses = frozen(np.hstack([motion.position, np.zeros((steps, 3))]))
    matrices = PARALLEL.inverse_jacobian(poses[:STEPS])
    errors = np.random.default_rng(1).normal(size=(len(matrices), 6))

    def peer_run() -> None:
        for matrix, error in zip(matrices, errors, strict=True):
            np.linalg.solve(matrix, error)

    peer = best_of(2, peer_run) / len(matrices)
    windows = foot_windows(motion.arc_length, 201, 76, 0.5)
    sought = PathWindows(path_table(segments(path, first=True)), *(frozen(side) for side in windows))
    for name, estimator in (("tangent", Estimator.TANGENT), ("foot point", Estimator.FOOT_POINT)):
        control = Control(SAMPLE_TIME, GAIN, 0, Feedforward(1.0, 1.0), CrossCoupling(COUPLING, estimator))
        joints = joints_of(SIX, PARALLEL)
        loop = make_loop(joints, control)

        def alone(joints: Joints = joints, loop: ServoLoop = loop) -> None:
            """References, Jacobians and ticks; no forward kinematics, no contour error."""
            reference, rates = joints.inverse(poses), joints.rates(poses, joints.pose(motion.velocity))
            told = Command(motion.position, motion.velocity, motion.acceleration, reference, rates)
            every = Poses(joints.inverse_jacobian(poses), 0, 1)
            loop.run(loop.start(reference[0]), told, every, sought)

        def whole(control: Control = control) -> None:
            response = simulate(motion, SIX, control, PARALLEL, path)
            contour_error(response.position, path, *windows)

        for how, work, budget in (("alone", alone, 250.0), ("with its contour error", whole, 120.0)):
            work()
            ours = best_of(ROUNDS, work) / steps
            stage = f"six legs, Jacobian each step, {name}, {how}"
            if how == "alone":
                yield Row(stage, Kind.SHARE, 0.5, "numpy.linalg.solve", "ns/step", ours * 1e9, peer * 1e9)
            period = SAMPLE_TIME * 1e9
            yield Row(stage, Kind.SPEED_UP, budget, "the motion itself", "ns/step", ours * 1e9, period)


def rows() -> Iterator[Row]:
    """Measure."""
    motion = command("printer", BLOCKS)
    short: Trajectory = motion.cut(slice(0, STEPS + 1))
    position, velocity = short.position.tolist(), short.velocity.tolist()
    step = simulating(MACHINE, CONTROL)  # what is prepared once is not of a step
    blocks = [motion.cut(slice(first, first + BLOCK)) for first in range(0, len(motion), BLOCK)]

    def run() -> None:
        state = None
        for block in blocks:
            state, _ = step(state, None, block, block is blocks[-1])

    _, response = step(None, None, motion, True)
    assert np.allclose(response.position[:STEPS], loop_in_python(position, velocity), atol=1e-9)
    ours = best_of(ROUNDS, run) / len(motion)
    peer = best_of(2, partial(loop_in_python, position, velocity)) / STEPS
    stage, unit = "cross-coupled loop, 3 axes", "ns/step"
    yield Row(stage, Kind.SPEED_UP, 100.0, "pure Python", unit, ours * 1e9, peer * 1e9)
    yield from parallel_rows()


if __name__ == "__main__":
    report(rows())
