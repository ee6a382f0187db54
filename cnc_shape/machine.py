"""Machine: what a machine is made of. Its shapers, gains and kinematics live above."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TypeAlias

from cnc_shape.limits import Limits
from cnc_shape.modes import Mode
from cnc_shape.program import ROTARY
from cnc_shape.units import DEGREE, TWO_PI


@dataclass(frozen=True, slots=True)
class IdealDrive:
    """A drive that is where it is told to be."""


@dataclass(frozen=True, slots=True)
class FirstOrderLag:
    """A velocity drive ``v' = (gain * u - v) / time_constant``, ``q' = v`` (paper 004, eq 14)."""

    time_constant: float  # s
    gain: float = 1.0  # -


@dataclass(frozen=True, slots=True)
class VelocityLoop:
    """PI velocity control inside a drive, at a tick of its own."""

    bandwidth: float = 400.0  # rad/s, torque gain over nominal inertia
    integral_time: float = 0.01  # s; inf: no integral
    sample_time: float = 2.5e-4  # s

    def ticks(self, sample_time: float) -> int:
        """Ticks, at least one, in a sample of the position loop (s)."""
        return max(round(sample_time / self.sample_time), 1)


@dataclass(frozen=True, slots=True)
class ServoMotor:
    """A motor with its drive: torque behind a current lag turns an inertia against friction and load.

    ``J w' = T - B w - Tc sign(w) - Td``, ``th' = w``; a screw makes `lead` of every revolution.
    """

    inertia: float  # kg m^2, of everything that turns
    torque_limit: float  # N m
    lead: float  # mm or rad of the axis per revolution
    viscous: float = 0.0  # N m s
    coulomb: float = 0.0  # N m
    current_time_constant: float = 0.0  # s; 0: the current is there at once
    encoder_counts: int = 0  # per revolution; 0: the encoder is exact
    velocity_loop: VelocityLoop = VelocityLoop()
    nominal_inertia: float | None = None  # kg m^2, what the controllers take it for; None: the true one

    @property
    def pitch(self) -> float:
        """Of the screw: mm or rad of the axis per rad of the motor."""
        return self.lead / TWO_PI

    @property
    def believed_inertia(self) -> float:
        """What the controllers take the inertia for, kg m^2."""
        return self.inertia if self.nominal_inertia is None else self.nominal_inertia

    @property
    def velocity_gain(self) -> float:
        """Torque per speed that the velocity loop asks for at a gain ratio of 1, N m s."""
        return self.believed_inertia * self.velocity_loop.bandwidth


Drive: TypeAlias = IdealDrive | FirstOrderLag | ServoMotor

LINEAR_DEFAULT = Limits(velocity=200.0, acceleration=2000.0)  # mm/s, mm/s^2
ROTARY_DEFAULT = Limits(velocity=90.0 * DEGREE, acceleration=900.0 * DEGREE)  # rad/s, rad/s^2


@dataclass(frozen=True, slots=True)
class Axis:
    """One Cartesian or rotary axis: what it may do, what moves it, and what vibrates behind it."""

    name: str
    limits: Limits
    drive: Drive = IdealDrive()
    modes: tuple[Mode, ...] = ()


@dataclass(frozen=True, slots=True)
class Machine:
    """The axes of a machine."""

    name: str
    axes: tuple[Axis, ...]
    joints: tuple[Drive, ...] = ()  # drives of a machine whose joints are not its axes; (): those of the axes

    def axis(self, name: str) -> Axis:
        """Return the axis called `name`; an axis the machine lacks is ideal, without travel limits."""
        for axis in self.axes:
            if axis.name == name:
                return axis
        return Axis(name, ROTARY_DEFAULT if name in ROTARY else LINEAR_DEFAULT)

    def with_axes(self, names: Iterable[str]) -> Machine:
        """Return the machine with just the axes `names`, in that order."""
        return replace(self, axes=tuple(self.axis(name) for name in names))
