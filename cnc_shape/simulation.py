"""Simulation: the servo loop and the structure, sample by sample.

The command, delayed alike on all axes, goes through the machine's loop and drives joint by joint. Where the
joints are the axes, drive and structure are one linear system. Elsewhere the structure bends behind what
the joints make of the axes::

    command --inverse--> joint references --loop, drives--> joints --forward--> position --structure--> tool
       |                                    ^
       +--inverse Jacobian, path -----------+ cross-coupling
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.commanding import resting, tell
from cnc_shape.controllers import Control, Estimator
from cnc_shape.controllers.loop import Command, Poses
from cnc_shape.controllers.motor_loop import SIGNALS
from cnc_shape.disturbances import UNDISTURBED, Disturbances
from cnc_shape.joints import CARTESIAN, Joints, joints_of
from cnc_shape.kinematics import Kinematics
from cnc_shape.loading import LoadState, loading
from cnc_shape.machine import Machine
from cnc_shape.refusals import (
    check_on_the_way,
    check_own_loops,
    line_in_windows,
    refuse_divergence,
    refuse_pose,
)
from cnc_shape.response import Response, motor_signals
from cnc_shape.segments import path_table
from cnc_shape.servo import NO_POSES, UNLOADED, PathWindows, Ticks, loop_reach, make_loop, structure_of
from cnc_shape.simulation_state import SimulationState, copied_state
from cnc_shape.toolpath import Toolpath
from cnc_shape.trajectory import Trajectory, join_trajectories
from cnc_shape.windows import Reach, Windows, windowing

RESIDUAL_PERIODS = 10.0  # of the slowest mode, watched after the end
SHORTEST_RESIDUAL_TIME = 0.5  # s


SimulationStep = Callable[
    [SimulationState | None, Toolpath | None, Trajectory, bool], tuple[SimulationState, Response]
]


def simulating(
    machine: Machine,
    control: Control,
    kinematics: Kinematics = CARTESIAN,
    reach: Reach | None = None,
    disturbances: Disturbances = UNDISTURBED,
) -> SimulationStep:
    """Return the resumable stage that runs a command through a machine's loop and structure.

    Its step takes the toolpath that has come in (or None), the samples that run on it, and whether that was
    all. A tick needs the sample after it, so the stage holds samples back; after the last one the command
    rests. The path matters where the loop looks for foot points on it, and to name the line of a pose that
    the machine cannot hold.

    Parameters
    ----------
    machine
        Its axes are the command's, in its order.
    control
        The loop; its sample time must be the command's.
    kinematics
        What the joints make of the axes.
    reach
        Of the windows in which foot points are sought; None: that of the position loop.
    disturbances
        What acts on the servo motors besides.

    Raises
    ------
    InfeasibleError
        A loop that is unstable, before anything is simulated; a pose that is out of reach or singular names
        its line; a signal that leaves all bounds.
    """
    joints = joints_of(machine, kinematics)
    check_own_loops(joints, control)
    return _Stage(
        machine,
        control,
        joints,
        reach or loop_reach(joints, control, loads=disturbances.loads),
        disturbances,
    ).step


def simulate(
    command: Trajectory,
    machine: Machine,
    control: Control,
    kinematics: Kinematics = CARTESIAN,
    toolpath: Toolpath | None = None,
    reach: Reach | None = None,
    disturbances: Disturbances = UNDISTURBED,
) -> Response:
    """Run a whole command through a machine.

    Parameters
    ----------
    command
        The (shaped) axis commands.
    machine
        Drives and structure; axes it lacks are ideal.
    control, kinematics, reach, disturbances
        As `simulating`.
    toolpath
        What the command runs on; cross-coupling by foot points needs it.
    """
    step = simulating(machine.with_axes(command.axes), control, kinematics, reach, disturbances)
    return step(None, toolpath, command, True)[1]


class _Stage:
    """The stage's settings; all that changes is in the state."""

    def __init__(
        self,
        machine: Machine,
        control: Control,
        joints: Joints,
        reach: Reach,
        disturbances: Disturbances,
    ) -> None:
        self._control, self._joints, self._period = control, joints, control.sample_time
        self._watched = _residual_ticks(machine, control)
        self._loop = make_loop(joints, control, disturbances.noise)
        self._structure = None if joints.cartesian else structure_of(machine, self._period)
        coupling = control.cross_coupling
        servo = bool(self._loop.motors.servo.any())
        compensated = servo and bool(self._loop.terms.compensation.models)
        self._needs_path = coupling is not None and coupling.estimator is Estimator.FOOT_POINT
        self._searches = self._needs_path or (compensated and len(machine.axes) >= 3)
        self._coupled = (coupling is not None or self._searches) and not joints.cartesian
        self._loading = None
        if servo and disturbances.loads:
            axes = tuple(axis.name for axis in machine.axes)
            self._loading = loading(disturbances, axes, self._period, self._loop.motors.ticks)
        self._windows = None
        if self._searches or not joints.cartesian:
            self._windows = windowing(replace(reach, ahead=max(reach.ahead, 1)))

    def step(
        self, state: SimulationState | None, toolpath: Toolpath | None, command: Trajectory, last: bool
    ) -> tuple[SimulationState, Response]:
        now = self._start(command) if state is None else copied_state(state)
        if not now.begun and len(command):
            now = self._begin(now, command)
        source = now.source if toolpath is None else toolpath.source
        places, windows = now.windows, None
        if self._windows is not None:
            places, windows = self._windows(places, toolpath, command.arc_length, last)
        command = join_trajectories([now.held, command])
        ticks = len(command) if last else max(len(command) - 1, 0)
        if windows is not None:
            ticks = windows.lower.size
        now = replace(now, held=command.cut(slice(ticks, None)), windows=places, source=source)
        if ticks == 0:
            return now, self._nothing(command.cut(slice(0, 0)))
        pose, told = tell(self._joints, self._loop.plant.ideal, command, now.before, ticks)
        lines = partial(line_in_windows, windows, command.arc_length)
        if windows is not None:
            refuse_pose(self._joints, pose, lines, source)
        poses, inverse = self._poses(now, pose, ticks)
        if self._coupled and self._control.cross_coupling is not None:
            check_on_the_way(self._joints, self._control, pose, told.velocity, now.ticks, lines, source)
        load, torque = self._torque(now, pose, command, ticks)
        ran = self._loop.run(now.loop, told, poses, self._path(windows), torque)
        before = now.ticks * self._period
        loaded = self._loading is not None
        refuse_divergence(self._joints, told.reference, ran, before, self._period, source, loaded=loaded)
        position, tool, turn = self._axes(now, pose, ran)
        response = Response(
            command.cut(slice(0, ticks)), frozen(told.reference[:ticks]), ran.joint, position, tool,
            ran.drive, turn, motor_signals(self._joints, ran),
        )  # fmt: skip
        now = replace(
            now, ticks=now.ticks + ticks, before=told.reference[ticks - 1 : ticks], inverse=inverse, load=load
        )
        if last:
            ending = tool[-1:] - position[-1:]
            now = replace(now, settling=self._settle(now, poses, told, windows, ending))
        return now, response

    def _start(self, command: Trajectory) -> SimulationState:
        if command.sample_time != self._period:
            raise ValueError(f"{command.sample_time=} {self._period=}")
        if (
            self._control.cross_coupling is not None
            and self._control.cross_coupling.estimator is not Estimator.TANGENT
            and len(command.axes) < 3
        ):
            raise ValueError(f"{command.axes=}: circles and foot points are of space")
        nowhere = self._loop.start(np.zeros(len(self._joints.drives)))
        bent = None if self._structure is None else self._structure.start(np.zeros(len(command.axes)))
        none = frozen(np.zeros((0, self._joints.coupled, self._joints.coupled)))
        return SimulationState(
            nowhere, bent, False, command.cut(slice(0, 0)), 0, frozen([]), none, None, None, "",
            frozen(np.zeros((0, len(command.axes)))),
        )  # fmt: skip

    def _begin(self, now: SimulationState, command: Trajectory) -> SimulationState:
        """Rest where the command begins."""
        at = command.position[:1]
        told = self._joints.inverse(self._joints.pose(at))
        loop = self._loop.start(told[0])
        bent = None if self._structure is None else self._structure.start(at[0])
        return replace(now, loop=loop, structure=bent, begun=True, before=told)

    def _nothing(self, command: Trajectory) -> Response:
        none = frozen(np.zeros((0, len(self._joints.drives))))
        idle = Ticks(none, none, none, none, frozen(np.zeros((*none.shape, SIGNALS))), 0)
        motors = motor_signals(self._joints, idle)
        return Response(command, none, none, command.position, command.position, none, frozen([]), motors)

    def _poses(self, now: SimulationState, pose: FloatArray, ticks: int) -> tuple[Poses, FloatArray]:
        """Inverse Jacobians for some ticks, and the one in use at their end."""
        if not self._coupled:
            return NO_POSES, now.inverse
        every = self._control.jacobian_every
        phase = now.ticks % every
        inverse = self._joints.inverse_jacobian(frozen(pose[-phase % every : ticks : every]))
        if phase:
            inverse = frozen(np.concatenate([now.inverse, inverse]))
        return Poses(inverse, phase, every), frozen(inverse[-1:])

    def _path(self, windows: Windows | None) -> PathWindows:
        if windows is None or not self._searches:
            return PathWindows()
        if windows.path.low.size == 0:
            if self._needs_path:
                raise ValueError("cross-coupling by foot points needs a path")
            return PathWindows()
        return PathWindows(path_table(windows.path), windows.lower, windows.upper)

    def _torque(
        self, now: SimulationState, pose: FloatArray, command: Trajectory, ticks: int
    ) -> tuple[LoadState | None, FloatArray]:
        """What loads the motors, (ticks, velocity ticks, j) N m, or without rows."""
        if self._loading is None:
            return None, UNLOADED
        load, torque = self._loading(now.load, command, ticks)
        return load, self._joints.torques(pose[:ticks], torque)

    def _axes(
        self, now: SimulationState, pose: FloatArray, ran: Ticks
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position of the drives through the kinematics, of the tool, and how far it is turned."""
        if self._structure is None or now.structure is None:
            return ran.joint, ran.tool, frozen([])
        n = ran.joint.shape[0]
        joint = np.vstack([ran.joint, now.loop.plant[None, :, 0]])
        rate = np.vstack([ran.rate, now.loop.plant[None, :, 1]])
        there = self._joints.forward(frozen(joint), pose)
        position = self._joints.axes(there)
        turn = self._joints.kinematics.turn
        turned = frozen([]) if turn is None else turn(self._joints.own(pose[:n]), self._joints.own(there[:n]))
        if not self._structure.bends:
            return frozen(position[:n]), frozen(position[:n]), turned
        velocity = self._joints.axes(self._joints.velocity(there, frozen(rate)))
        told = Command(position, velocity, velocity, position, velocity)
        tool = self._structure.run(now.structure, told, NO_POSES, PathWindows()).tool
        return frozen(position[:n]), tool, turned

    def _settle(
        self, now: SimulationState, poses: Poses, told: Command, windows: Windows | None, ending: FloatArray
    ) -> FloatArray:
        """Tool minus drives from the end on, the command at rest."""
        n = self._watched
        rest = resting(told, n)
        last = Poses(frozen(poses.inverse[-1:]), 0, n + 1) if len(poses.inverse) else NO_POSES
        pose, path = self._joints.pose(rest.position), self._path(windows)
        around = PathWindows(
            path.path, frozen(np.repeat(path.lower[-1:], n)), frozen(np.repeat(path.upper[-1:], n))
        )
        load = UNLOADED
        if self._loading is not None and now.load is not None:
            load = self._joints.torques(pose[:n], self._loading.at_rest(now.load, n))
        ran = self._loop.run(now.loop, rest, last, around, load)
        position, tool, _ = self._axes(now, pose, ran)
        return frozen(np.vstack([ending, tool - position]))


def _residual_ticks(machine: Machine, control: Control) -> int:
    periods = [mode.longest_period for axis in machine.axes for mode in axis.modes]
    watched = max(RESIDUAL_PERIODS * max(periods, default=0.0), SHORTEST_RESIDUAL_TIME)
    return int(np.ceil(watched / control.sample_time))
