"""What a shaper costs and what it is good for, in numbers that can be compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.modes import Mode
from cnc_shape.shapers.analysis import contour_factor, vibration
from cnc_shape.shapers.insensitivity import Insensitivity, insensitivity
from cnc_shape.shapers.shaper import Shaper
from cnc_shape.shapers.tool_corner import ToolErrors, tool_errors

ASSUMED_FREQUENCY_ERROR = 0.1  # -, relative, of a mode that does not say how uncertain it is
FREQUENCY_SCAN, DAMPING_SCAN = 201, 9  # points over the uncertain range
CORNER_SCAN, CORNER_ROUNDS = 201, 4  # points, and how often the scan is narrowed around the best


@dataclass(frozen=True, slots=True)
class ModelError:
    """The most that is left of a mode whose frequency and damping are not those of the model."""

    frequency: float  # -, relative, up or down
    damping: float  # -, relative, up or down
    assumed: bool  # the mode itself did not say
    residual_vibration: float  # -, largest V in that range


@dataclass(frozen=True, slots=True)
class Assessment:
    """A shaper on the modes of an axis."""

    residual_vibration: tuple[float, ...]  # -, V at each mode
    model_error: tuple[ModelError, ...]  # per mode
    insensitivity: Insensitivity
    contour_factor: float | None
    corner_per_speed: float  # s
    corner_per_acceleration: float  # s^2
    tool: ToolErrors

    @property
    def worst_residual(self) -> float:
        """Largest V of any mode, anywhere in its uncertain range."""
        return max(error.residual_vibration for error in self.model_error)

    def corner_smoothing(self, speed: float) -> float:
        """How far a right-angled corner is cut that is taken at constant `speed`, mm/s; in mm."""
        return self.corner_per_speed * speed

    def corner_acceleration(self, tolerance: float) -> float | None:
        """Acceleration of both axes, mm/s^2, at which a corner with a stop stays within `tolerance`, mm.

        None where the shaper does not smooth corners at all.
        """
        return tolerance / self.corner_per_acceleration if self.corner_per_acceleration > 0.0 else None


def assess(shaper: Shaper, modes: Sequence[Mode], tolerance: float) -> Assessment:
    """Measure `shaper` on `modes`; `tolerance` is the V that the band of insensitivity is told for.

    Raises
    ------
    OptionError
        Tolerance outside (0, 1).
    """
    return Assessment(
        residual_vibration=tuple(float(vibration(shaper, m.omega, m.damping_ratio)) for m in modes),
        model_error=tuple(model_error(shaper, mode) for mode in modes),
        insensitivity=insensitivity(shaper, modes, tolerance),
        contour_factor=contour_factor(shaper, modes),
        corner_per_speed=corner_cut(shaper, 1),
        corner_per_acceleration=0.5 * corner_cut(shaper, 2),
        tool=tool_errors(shaper, modes),
    )


def model_error(shaper: Shaper, mode: Mode) -> ModelError:
    """Largest V over the range in which the mode may be; 10 % of frequency where it does not say."""
    frequency = mode.frequency_uncertainty if mode.is_uncertain else ASSUMED_FREQUENCY_ERROR
    ratio = np.linspace(1.0 - frequency, 1.0 + frequency, FREQUENCY_SCAN)
    spread = mode.damping_uncertainty
    damping = mode.damping_ratio * np.linspace(1.0 - spread, 1.0 + spread, DAMPING_SCAN if spread else 1)
    worst = vibration(shaper, mode.omega * ratio[:, None], damping[None, :]).max()
    return ModelError(frequency, spread, not mode.is_uncertain, float(worst))


def corner_cut(shaper: Shaper, power: int) -> float:
    """How far the shaped path misses a right-angled corner, over what the axes do there, s^power.

    One axis comes to the corner and stops at t = 0, the other starts: ``x(t) = -max(0, -t)^power`` and
    ``y(t) = max(0, t)^power``; power 1 is a constant speed, power 2 twice a constant acceleration. Shaped,
    the axes overlap, ``x(t) = -sum A_i max(0, t_i - t)^power``, ``y(t) = sum A_i max(0, t - t_i)^power``, and
    the distance to the nearer leg is the smaller of |x| and |y|. Its largest value is returned.
    """
    low, high = 0.0, shaper.duration
    best = 0.0
    for _ in range(CORNER_ROUNDS):
        time = np.linspace(low, high, CORNER_SCAN)
        after = time[:, None] - shaper.times
        x = np.abs(np.maximum(-after, 0.0) ** power @ shaper.amplitudes)
        y = np.abs(np.maximum(after, 0.0) ** power @ shaper.amplitudes)
        distance = np.minimum(x, y)
        top = int(distance.argmax())
        best = max(best, float(distance[top]))
        low, high = float(time[max(top - 1, 0)]), float(time[min(top + 1, CORNER_SCAN - 1)])
    return best


def step_response(shaper: Shaper, modes: Sequence[Mode], time: FloatArray) -> FloatArray:
    """Position of the tool, (n,), after a unit step of the command that goes through `shaper`.

    The step excites each mode by its share of all participations; the time of the shaper's own delay is not
    taken out. `time` is (n,) s.
    """
    shares = np.array([mode.participation for mode in modes])
    total = shares.sum()
    shares = shares / total if total != 0.0 else np.full(shares.size, 1.0 / shares.size)
    after = time[:, None] - shaper.times
    response = np.zeros(time.size)
    for share, mode in zip(shares.tolist(), modes, strict=True):
        wave = mode.omega_damped * np.maximum(after, 0.0)
        decay = np.exp(-mode.damping_ratio * mode.omega * np.maximum(after, 0.0))
        ratio = mode.damping_ratio * mode.omega / mode.omega_damped
        swung = np.where(after >= 0.0, 1.0 - decay * (np.cos(wave) + ratio * np.sin(wave)), 0.0)
        response += share * (swung @ shaper.amplitudes)
    return response
