"""The whole story: a program, a machine, and what the machine makes of the program.

Program -> Toolpath -> Path -> Profile -> Trajectory; then for each case: shaped -> simulated -> measured.

::

    motion.py      reads, smooths, plans and samples: once
       |  Block: toolpath + command
       +--> Trial "unshaped":  simulate -> measure -> CaseSummary
       +--> Trial "shaped":    shape -> simulate -> measure -> CaseSummary
       +--> ...

Every stage is a fold over chunks, so a program of any length runs in the memory of one chunk, and the
numbers do not depend on where it was cut.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Protocol

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.config.setup import Setup
from cnc_shape.contour import MeasuringState, Tally, measuring, tally
from cnc_shape.controllers import Control
from cnc_shape.disturbances import UNDISTURBED, Disturbances
from cnc_shape.errors import InfeasibleError
from cnc_shape.joints import CARTESIAN, joints_of
from cnc_shape.kernels.sums import add_squares
from cnc_shape.kinematics import Kinematics
from cnc_shape.limit_use import LimitUse, LimitWatch
from cnc_shape.machine import Machine
from cnc_shape.motion import Block
from cnc_shape.motors import DutyTally, MotorDuty, duties, servo_motors, tally_duty
from cnc_shape.recording import Outline, Recorder, Signals
from cnc_shape.servo import loop_reach
from cnc_shape.shapers.command_shaping import CommandShaping, CommandState, command_shaping
from cnc_shape.simulation import SimulationState, simulating
from cnc_shape.timing import PLAIN, Timing


@dataclass(frozen=True, slots=True)
class Case:
    """One row of the table: how the motion is timed and shaped, and which loop it goes through."""

    name: str
    shaping: CommandShaping
    control: Control
    timing: Timing = PLAIN
    disturbances: Disturbances = UNDISTURBED


@dataclass(frozen=True, slots=True)
class Deviation:
    """Contour error of one signal over all its samples."""

    rms: float  # mm
    max: float  # mm
    line: int | None  # source line of the worst place


def deviation(found: Tally) -> Deviation:
    """What a tally has found."""
    return Deviation(found.rms, found.max, found.line)


@dataclass(frozen=True, slots=True)
class Turn:
    """Angle between the tool's direction against the workpiece and the commanded one, over all samples."""

    rms: float  # rad
    max: float  # rad


@dataclass(frozen=True, slots=True)
class CaseSummary:
    """The scalars of one case: one row of the table."""

    name: str
    cycle_time: float  # s, of the case's (shaped) command
    command: Deviation  # of the command
    drives: Deviation  # of the drives' position through the kinematics
    tool: Deviation  # of drive plus structure
    following_rms: Mapping[str, float]  # joint: mm or rad
    residual_vibration: Mapping[str, float]  # axis: mm or rad
    turn: Turn | None = None  # where the machine turns tool or workpiece
    motors: tuple[MotorDuty, ...] = ()  # of every joint that has a servo motor
    disturbed: bool = False


@dataclass(frozen=True, slots=True)
class Summary:
    """What one run says: one row a case."""

    program: str
    machine: str
    cycle_time: float  # s, of the unshaped command
    sample_time: float  # s
    samples: int
    cases: tuple[CaseSummary, ...]


@dataclass(frozen=True, slots=True)
class Run:
    """A summary with the signals it was made from, the programmed path to draw, and the use of the limits."""

    summary: Summary
    signals: tuple[Signals, ...]  # one a case, in the summary's order; empty where none were recorded
    path: FloatArray  # (p,3) mm, the programmed path, arcs chopped for drawing
    limit_use: LimitUse | None = None  # of the plain motion, where it was planned and recorded

    def signal(self, case: str) -> Signals:
        """Return the signals of the case called `case`; their extremes where there are many."""
        return next(signals for signals in self.signals if signals.case == case)


class Observer(Protocol):
    """What is fed every block of a motion."""

    def advance(self, block: Block) -> None:
        """Take the next block."""
        ...


def _trial(case: Case, machine: Machine, setup: Setup, recorder: Recorder | None) -> Trial:
    """Start a case; a loop that is unstable by itself is the machine file's fault, whatever the program."""
    try:
        return Trial(case, machine, setup.kinematics, recorder)
    except InfeasibleError as error:
        if setup.source and error.source is None:
            error.source = setup.source
            error.line, error.column = setup.loop_place or (None, None)
        raise


class Trial:
    """One case under way: its stages, where they stand, and what they have seen so far."""

    def __init__(
        self,
        case: Case,
        machine: Machine,
        kinematics: Kinematics = CARTESIAN,
        recorder: Recorder | None = None,
    ) -> None:
        self.case = case
        self._machine = machine
        self.recorder = recorder
        period, axes = case.control.sample_time, tuple(axis.name for axis in machine.axes)
        self._shape = command_shaping(case.shaping, axes, period)
        self._longer = case.shaping.longer(axes, period)
        joints = joints_of(machine, kinematics)
        self._joints = joints.names
        self._limits = np.array([motor.torque_limit for motor in servo_motors(joints).values()])
        self._duty: DutyTally | None = None
        reach = loop_reach(joints, case.control, self._longer, case.disturbances.loads)
        self._simulate = simulating(machine, case.control, kinematics, reach, case.disturbances)
        self._measure = measuring(reach)
        self._shaped: CommandState | None = None
        self._simulated: SimulationState | None = None
        self._measured: MeasuringState | None = None
        self._tallies = [Tally(), Tally(), Tally()]  # of the command, the drives, the tool
        self._following = np.zeros(len(joints.names))
        self._turn, self._furthest = np.zeros(1), 0.0  # rad^2, rad: of the tool's direction
        self._turns = kinematics.turn is not None
        self._samples = 0
        self._cycle_time = 0.0

    def advance(self, block: Block) -> None:
        """Run the next block through the case, if it is of the case's own timing."""
        if block.timing is not None and block.timing != self.case.timing:
            return
        command = block.command
        if self.case.shaping.acts:
            self._shaped, command = self._shape(self._shaped, command, block.last)
        self._simulated, response = self._simulate(self._simulated, block.toolpath, command, block.last)
        add_squares(response.following_error, self._following)
        self._samples += len(response.command)
        add_squares(response.turn[:, None], self._turn)
        self._furthest = max(self._furthest, float(response.turn.max(initial=0.0)))
        if response.motors is not None:
            self._duty = tally_duty(self._duty, response.motors, self._limits)
        signals = (response.command.position, response.position, response.tool)
        self._measured, errors = self._measure(
            self._measured, block.toolpath, response.command.arc_length, signals, block.last
        )
        self._tallies = [tally(state, error) for state, error in zip(self._tallies, errors, strict=True)]
        if self.recorder is not None:
            self.recorder.add(response, errors)
        if block.last:
            self._cycle_time = block.cycle_time + self._longer

    def signals(self) -> Signals | None:
        """Samples kept for a report, if any were to be; call it after the last block."""
        if self.recorder is None or self._simulated is None:
            return None
        return self.recorder.signals(self._simulated.settling)

    def summary(self) -> CaseSummary:
        """Scalars of the case; call it after the last block."""
        if self._simulated is None:
            raise ValueError("a case without a single block has no summary")
        axes = [axis.name for axis in self._machine.axes]
        command, drives, tool = (deviation(found) for found in self._tallies)
        following = {
            axis: sqrt(total / self._samples)
            for axis, total in zip(self._joints, self._following.tolist(), strict=True)
        }
        residual = dict(zip(axes, self._simulated.residual.tolist(), strict=True))
        turn = Turn(sqrt(float(self._turn[0]) / self._samples), self._furthest) if self._turns else None
        motors = () if self._duty is None else duties(self._duty)
        return CaseSummary(
            self.case.name, self._cycle_time, command, drives, tool, following, residual, turn,
            motors, bool(self.case.disturbances),
        )  # fmt: skip


def run(
    blocks: Iterable[Block],
    setup: Setup,
    cases: Sequence[Case],
    program: str,
    *,
    record: bool = False,
    all_signals: bool = False,
    observers: Sequence[Observer] = (),
) -> Run:
    """Send a motion through every case and measure it.

    Parameters
    ----------
    blocks
        The motion, from `motion.moving` with the `timings` of the cases, or from `motion.replaying`.
    setup
        The machine.
    cases
        The rows of the table, in order.
    program
        Its name in the table.
    record
        Keep the signals for a report, and what the motion uses of the limits.
    all_signals
        Keep every sample of them, however many there are.
    observers
        Who else sees every block.

    Raises
    ------
    InfeasibleError
        A loop is unstable, a signal that is recorded is not finite, or what `blocks` raises.
    OutputError
        The signals do not fit into the folder for temporary files.
    """
    trials: list[Trial] = []
    outline, watch = Outline(), LimitWatch(setup.machine) if record else None
    samples, cycle_time = 0, 0.0
    for block in blocks:
        unshaped = block.timing is None or block.timing == PLAIN
        if not trials:
            axes = block.command.axes
            machine = setup.machine.with_axes(axes)
            period = setup.control.sample_time
            motors = tuple(servo_motors(joints_of(machine, setup.kinematics)))
            recorders = [
                Recorder(case.name, axes, period, motors=motors, all_signals=all_signals) if record else None
                for case in cases
            ]
            trials = [
                _trial(case, machine, setup, recorder)
                for case, recorder in zip(cases, recorders, strict=True)
            ]
        if record and unshaped and block.toolpath is not None:
            outline.add(block.toolpath)
        if watch is not None:
            watch.advance(block)
        for watcher in (*trials, *observers):
            watcher.advance(block)
        if unshaped:
            samples += len(block.command)
            cycle_time = block.cycle_time
    summary = Summary(
        program, setup.machine.name, cycle_time, setup.control.sample_time, samples,
        tuple(trial.summary() for trial in trials),
    )  # fmt: skip
    signals = tuple(found for trial in trials if (found := trial.signals()) is not None)
    use = None if watch is None else watch.found()
    return Run(summary, signals, outline.points(), use)
