"""Commanding: what the loop is told of the axes' command, joint by joint."""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen
from cnc_shape.controllers.loop import Command
from cnc_shape.joints import Joints
from cnc_shape.trajectory import Trajectory


def tell(
    joints: Joints, ideal: IntArray, command: Trajectory, before: FloatArray, ticks: int
) -> tuple[FloatArray, Command]:
    """Poses and what the loop is told, one sample more than ticks: after the last, rest.

    Feedforward takes the acceleration of the coming sample from the change of velocity. A replayed
    command's is a central difference, which spreads every change of acceleration over two samples: drives
    are told that of the step which arrives, and its change is the second difference of their positions.

    Parameters
    ----------
    joints
        Of the machine.
    ideal
        (j,) 1 where a drive is where it is told to be.
    command
        At least `ticks` samples; with one more, that one is what the last tick goes to.
    before
        (1,j) mm or rad, what the joints were told before the first of them.
    ticks
        How many.

    Returns
    -------
    pose, told
        (n,p) of the samples, and the command.
    """
    rows = min(ticks + 1, len(command))
    position, velocity, acceleration = (
        values[:rows] for values in (command.position, command.velocity, command.acceleration)
    )
    if rows == ticks:
        position = np.vstack([position, position[-1:]])
        velocity, acceleration = (
            np.vstack([values, np.zeros_like(position[-1:])]) for values in (velocity, acceleration)
        )
    pose = joints.pose(frozen(position))
    rates = joints.rates(pose, joints.pose(frozen(velocity)))
    reference = joints.inverse(pose)
    if command.replayed:
        steps = np.diff(reference, axis=0, prepend=before) / command.sample_time
        rates = np.where(ideal, rates, steps)
    return pose, Command(
        frozen(position), frozen(velocity), frozen(acceleration), frozen(reference), frozen(rates)
    )


def resting(told: Command, ticks: int) -> Command:
    """Stay where a command ends, for some ticks."""
    position = np.repeat(told.position[-1:], ticks + 1, axis=0)
    reference = np.repeat(told.reference[-1:], ticks + 1, axis=0)
    still, quiet = np.zeros_like(position), np.zeros_like(reference)
    return Command(frozen(position), frozen(still), frozen(still), frozen(reference), frozen(quiet))
