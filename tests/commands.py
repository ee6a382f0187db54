"""Axis commands for tests, in closed form at any time."""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import frozen
from cnc_shape.trajectory import Trajectory


def trapezoid(time, distance, velocity, acceleration):
    """Position, velocity and acceleration of a rest-to-rest move; the velocity must be reached."""
    rise, cruise = velocity / acceleration, distance / velocity - velocity / acceleration
    if cruise < 0:
        raise ValueError(f"{distance=} is too short")
    end = 2 * rise + cruise
    t = np.clip(time, 0.0, end)
    pieces = [t < rise, t < rise + cruise]
    position = np.select(
        pieces,
        [0.5 * acceleration * t**2, 0.5 * velocity * rise + velocity * (t - rise)],
        distance - 0.5 * acceleration * (end - t) ** 2,
    )
    speed = np.select(pieces, [acceleration * t, velocity], acceleration * (end - t))
    still = (time < 0.0) | (time >= end - 1e-12)
    accel = np.select(
        [still, time < rise - 1e-12, time < rise + cruise - 1e-12], [0.0, acceleration, 0.0], -acceleration
    )
    return position, speed, accel


def point_to_point(
    sample_time, distance=10.0, velocity=100.0, acceleration=2000.0, axes=("x", "y", "z")
) -> Trajectory:
    """A trapezoidal move of the first axis, sampled."""
    duration = distance / velocity + velocity / acceleration
    time = np.arange(int(np.ceil(duration / sample_time - 1e-9)) + 1) * sample_time
    p, v, a = trapezoid(time, distance, velocity, acceleration)
    direction = np.eye(len(axes))[0]
    return Trajectory(axes, sample_time, frozen(p), *(frozen(np.outer(s, direction)) for s in (p, v, a)))


def circling(sample_time, radius, feed, turns) -> Trajectory:
    """A circle at constant speed, already moving at t = 0."""
    omega = feed / radius
    time = np.arange(int(turns * 2 * np.pi / omega / sample_time)) * sample_time
    c, s, o = np.cos(omega * time), np.sin(omega * time), 0.0 * time
    position = radius * np.stack([c, s, o], axis=1)
    velocity = feed * np.stack([-s, c, o], axis=1)
    return Trajectory(
        ("x", "y", "z"),
        sample_time,
        frozen(feed * time),
        frozen(position),
        frozen(velocity),
        frozen(-(omega**2) * position),
    )


def straight(sample_time, direction, feed, seconds) -> Trajectory:
    """A line at constant speed, already moving at t = 0."""
    unit = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    time = np.arange(int(seconds / sample_time)) * sample_time
    position = np.outer(feed * time, unit)
    return Trajectory(
        ("x", "y", "z"), sample_time, frozen(feed * time), frozen(position),
        frozen(np.broadcast_to(feed * unit, position.shape)), frozen(np.zeros_like(position)),
    )  # fmt: skip


def part(command: Trajectory, low: int, high: int) -> Trajectory:
    """Samples low...high-1 as a chunk."""
    rows = slice(low, high)
    return Trajectory(
        command.axes, command.sample_time, frozen(command.arc_length[rows]), frozen(command.position[rows]),
        frozen(command.velocity[rows]), frozen(command.acceleration[rows]),
    )  # fmt: skip
