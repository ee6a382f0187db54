"""Simulation: the servo loop and the structure, sample by sample.

The command, delayed alike on all axes, goes through the machine's loop (`controllers`) and through its
drives and structure as one linear system (`plant`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.controllers import cross_coupling, feedforward, position_loop
from cnc_shape.controllers.control import Control
from cnc_shape.controllers.loop import servo_loop
from cnc_shape.controllers.stability import check_stability
from cnc_shape.errors import InfeasibleError
from cnc_shape.machine import Machine
from cnc_shape.plant import Plant, discretise
from cnc_shape.trajectory import Trajectory, join_trajectories

RESIDUAL_PERIODS = 10.0  # of the slowest mode, watched after the end
SHORTEST_RESIDUAL_TIME = 0.5  # s


@dataclass(frozen=True, eq=False, slots=True)
class Response:
    """What drives and tool did under a command: a chunk of samples."""

    command: Trajectory
    joint: FloatArray  # (n,j) mm or rad, position of the drives
    position: FloatArray  # (n,d) mm or rad, of the drives through the kinematics
    tool: FloatArray  # (n,d) mm or rad, drives plus structure
    drive: FloatArray  # (n,j) mm/s, velocity command of the loop
    signals: Mapping[str, FloatArray] = field(default_factory=dict[str, FloatArray])

    @property
    def following_error(self) -> FloatArray:
        """Command minus drives, (n,d) mm or rad."""
        return self.command.position - self.position

    def summary(self) -> str:
        """Largest following error and deflection of every axis, in one line."""
        following = np.abs(self.following_error).max(axis=0, initial=0.0)
        deflection = np.abs(self.tool - self.position).max(axis=0, initial=0.0)
        told = zip(self.command.axes, following.tolist(), deflection.tolist(), strict=True)
        return "; ".join(f"{axis.upper()} follows to {f:.4g}, bends by {d:.4g}" for axis, f, d in told)


@dataclass(frozen=True, eq=False, slots=True)
class SimulationState:
    """Where the loop stands between two chunks."""

    plant: FloatArray  # (d,s)
    late: FloatArray  # (delay,d) commands the drives have yet to hear, oldest first
    tangent: FloatArray  # (3,) last direction of the command
    held: Trajectory  # at most one sample, waiting for the one after it
    time: float  # s, of the next sample
    settling: FloatArray  # (m,d) mm or rad, tool minus drive at and after the end; (0,d) before

    @property
    def residual(self) -> FloatArray:
        """Largest |tool - drive| of every axis once the command has come to rest, (d,) mm or rad."""
        return np.abs(self.settling).max(axis=0, initial=0.0)


def simulating(
    machine: Machine, control: Control
) -> Callable[[SimulationState | None, Trajectory, bool], tuple[SimulationState | None, Response]]:
    """Return the resumable stage that runs a command through a machine's loop and structure.

    The machine's axes are the command's, in its order. A tick needs the sample after it, so the stage
    holds one sample back; after the last one the command rests.

    Raises
    ------
    InfeasibleError
        A loop that is unstable, before anything is simulated; a signal that leaves all bounds.
    """
    axes = machine.axes
    plant = discretise(axes, control.sample_time)
    check_stability(axes, control)
    position_gains = position_loop.PositionGains(frozen([control.position_gain] * len(axes)))
    feed_gains = feedforward.gains(control.feedforward or feedforward.Feedforward(), axes)
    couple_gains = cross_coupling.CrossCouplingGains(
        control.cross_coupling.proportional if control.cross_coupling else 0.0
    )

    def run(state: SimulationState, position: FloatArray, velocity: FloatArray) -> tuple[FloatArray, ...]:
        return servo_loop(
            position, velocity, control.sample_time,
            plant.transition, plant.held, plant.rising, plant.states, plant.ideal,
            position_gains, int(control.feedforward is not None), feed_gains,
            int(control.cross_coupling is not None), couple_gains,
            state.plant, state.late, state.tangent,
        )  # fmt: skip

    def step(
        state: SimulationState | None, command: Trajectory, last: bool
    ) -> tuple[SimulationState | None, Response]:
        if state is None and len(command) == 0:
            return None, Response(
                command, command.position, command.position, command.position, command.position
            )
        now = _start(plant, command, control) if state is None else _copy(state)
        command = join_trajectories([now.held, command])
        ticks = len(command) if last else max(len(command) - 1, 0)
        rest = command.position[-1:] if last else command.position[:0]
        position = np.concatenate([command.position, rest])
        velocity = np.concatenate([command.velocity, np.zeros_like(rest)])
        joint, tool, drive = run(now, position, velocity)
        _refuse_divergence(tool, drive, now.time, machine, control)
        settling = now.settling
        if last and len(command):
            after = np.repeat(rest, _residual_ticks(machine, control) + 1, axis=0)
            still, shaken, _ = run(now, after, np.zeros_like(after))
            settling = np.vstack([tool[-1:] - joint[-1:], shaken - still])
        response = Response(
            command.cut(slice(0, ticks)), frozen(joint), frozen(joint), frozen(tool), frozen(drive)
        )
        held = command.cut(slice(ticks, None))
        time = now.time + ticks * control.sample_time
        return SimulationState(now.plant, now.late, now.tangent, held, time, frozen(settling)), response

    return step


def simulate(command: Trajectory, machine: Machine, control: Control) -> Response:
    """Run a whole command through a machine.

    Parameters
    ----------
    command
        The (shaped) axis commands.
    machine
        Drives and structure; axes it lacks are ideal.
    control
        The loop; its sample time must be the command's.
    """
    return simulating(machine.with_axes(command.axes), control)(None, command, True)[1]


def _start(plant: Plant, command: Trajectory, control: Control) -> SimulationState:
    if command.sample_time != control.sample_time:
        raise ValueError(f"{command.sample_time=} {control.sample_time=}")
    state = np.zeros(plant.held.shape)
    state[:, 0] = command.position[0]
    axes = len(command.axes)
    return SimulationState(
        state,
        np.zeros((control.delay_samples, axes)),
        np.zeros(3),
        command.cut(slice(0, 0)),
        0.0,
        np.zeros((0, axes)),
    )


def _copy(state: SimulationState) -> SimulationState:
    return SimulationState(
        state.plant.copy(), state.late.copy(), state.tangent.copy(), state.held, state.time, state.settling
    )


def _residual_ticks(machine: Machine, control: Control) -> int:
    periods = [mode.damped_period for axis in machine.axes for mode in axis.modes]
    watched = max(RESIDUAL_PERIODS * max(periods, default=0.0), SHORTEST_RESIDUAL_TIME)
    return int(np.ceil(watched / control.sample_time))


def _refuse_divergence(
    tool: FloatArray, drive: FloatArray, start: float, machine: Machine, control: Control
) -> None:
    """Stop at the first sample that is not a number, naming axis and time."""
    bad = ~(np.isfinite(tool) & np.isfinite(drive))
    if bad.any():
        row, axis = (int(index) for index in np.argwhere(bad)[0])
        raise InfeasibleError(
            f"the loop diverged: axis {machine.axes[axis].name} has left all bounds at t = "
            f"{start + row * control.sample_time:.4f} s",
            hint="lower the gains",
        )
