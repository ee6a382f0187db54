"""A run to report on, from closed forms: a corner and an arc, a lag, a vibrating structure, a shaper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from cnc_shape.arrays import frozen, frozen_integers
from cnc_shape.modes import Mode
from cnc_shape.motors import duties, tally_duty
from cnc_shape.pipeline import CaseSummary, Deviation, Run, Summary
from cnc_shape.recording import Signals
from cnc_shape.response import MotorSignals
from cnc_shape.shapers import Shaper

PROGRAM = "corner_and_arc.nc"
TEXT = b"G21 G90\nG1 X40 F3000 (out)\nG1 Y20\nG3 X0 Y20 I-20 J0\nG1 Y0\n"
CORNERS = np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 20.0], [0.0, 20.0]])
LENGTHS = np.cumsum([0.0, 40.0, 20.0, 20.0 * np.pi, 20.0])
SPEED = 50.0  # mm/s
MODE = Mode(30.0, 0.02)


def at(s: np.ndarray) -> np.ndarray:
    """Points of the programmed path at the lengths `s`."""
    angle = (s - LENGTHS[2]) / 20.0
    knots = LENGTHS[[0, 1, 2]]
    x = np.where(s < LENGTHS[2], np.interp(s, knots, CORNERS[:3, 0]), 20.0 + 20.0 * np.cos(angle))
    y = np.where(s < LENGTHS[2], np.interp(s, knots, CORNERS[:3, 1]), 20.0 + 20.0 * np.sin(angle))
    back = s > LENGTHS[3]
    x, y = np.where(back, 0.0, x), np.where(back, 20.0 - (s - LENGTHS[3]), y)
    return np.column_stack([x, y, np.zeros_like(s)])


def foot(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nearest points of the path, their distances and lines."""
    candidates = []
    for start, end in (((0, 0), (40, 0)), ((40, 0), (40, 20)), ((0, 20), (0, 0))):
        a, b = np.array([*start, 0.0]), np.array([*end, 0.0])
        share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        candidates.append(a + share[:, None] * (b - a))
    center = np.array([20.0, 20.0, 0.0])
    arm = points - center
    arm[:, 1] = np.maximum(arm[:, 1], 0.0)
    candidates.insert(2, center + 20.0 * arm / np.linalg.norm(arm, axis=1, keepdims=True))
    feet = np.array(candidates)
    distances = np.linalg.norm(feet - points, axis=2)
    nearest = distances.argmin(axis=0)
    rows = np.arange(points.shape[0])
    return feet[nearest, rows], distances[nearest, rows], nearest + 2


def shaper() -> Shaper:
    """ZV for `MODE`, undamped."""
    return Shaper(frozen([0.0, 0.5 / MODE.natural_frequency]), frozen([0.5, 0.5]))


def make_run(samples: int = 4000, program: str = PROGRAM, machine: str = "XY stage") -> Run:
    """Three cases of about `samples` samples each."""
    cycle_time = LENGTHS[-1] / SPEED + 0.4
    dt = (cycle_time + 0.5) / samples
    t = np.arange(samples) * dt
    share = np.clip(t / cycle_time, 0.0, 1.0)
    s = LENGTHS[-1] * (share - np.sin(2.0 * np.pi * share * 4) / (2.0 * np.pi * 4))  # rests between the moves
    command = at(s)
    delay = max(round(0.5 / MODE.natural_frequency / dt), 1)
    shaped = 0.5 * (command + np.vstack([np.repeat(command[:1], delay, axis=0), command[:-delay]]))
    parts = [
        _case("unshaped", command, dt, 0.003, cycle_time),
        _case("shaped", shaped, dt, 0.003, cycle_time + 0.0167),
        _case("shaped+cross_coupled", shaped, dt, 0.001, cycle_time + 0.0167),
    ]
    summary = Summary(program, machine, cycle_time, dt, samples, tuple(case for _, case in parts))
    path = at(np.linspace(0.0, LENGTHS[-1], 2000))
    return Run(summary, tuple(signals for signals, _ in parts), frozen(path))


def _case(
    name: str, command: np.ndarray, dt: float, lag: float, cycle_time: float
) -> tuple[Signals, CaseSummary]:
    velocity = np.gradient(command, dt, axis=0)
    acceleration = np.gradient(velocity, dt, axis=0)
    alpha = dt / (lag + dt)
    offset = command[0]
    position = lfilter([alpha], [1.0, alpha - 1.0], command - offset, axis=0) + offset
    drive = np.gradient(np.gradient(position, dt, axis=0), dt, axis=0)
    w, z = MODE.omega, MODE.damping_ratio
    k = 2.0 / dt
    a0, a1, a2 = k * k + 2 * z * w * k + w * w, 2 * (w * w - k * k), k * k - 2 * z * w * k + w * w
    deflection = lfilter(-np.array([1.0, 2.0, 1.0]) / a0, [1.0, a1 / a0, a2 / a0], drive, axis=0)
    deflection[:, 2] = 0.0
    tool = position + deflection
    time = np.arange(command.shape[0]) * dt
    (_, ce, cl), (_, de, dl), (feet, te, tl) = foot(command), foot(position), foot(tool)

    def deviation(errors, lines) -> Deviation:
        worst = int(errors.argmax())
        return Deviation(float(np.sqrt(np.mean(errors**2))), float(errors[worst]), int(lines[worst]))

    axes = ("x", "y", "z")
    rest = np.abs(deflection[time > cycle_time]).max(axis=0, initial=0.0)
    following = np.sqrt(np.mean((command - position) ** 2, axis=0))
    signals = Signals(
        name, axes, 1, frozen(time), frozen(command), frozen(position), frozen(tool), frozen(velocity),
        frozen(acceleration), frozen(ce), frozen(de), frozen(te), frozen(feet), frozen_integers(tl),
        frozen(time[time >= cycle_time] - cycle_time), frozen(deflection[time >= cycle_time]),
    )  # fmt: skip
    return signals, CaseSummary(
        name, cycle_time, deviation(ce, cl), deviation(de, dl), deviation(te, tl),
        dict(zip(axes, following.tolist(), strict=True)), dict(zip(axes, rest.tolist(), strict=True)),
    )  # fmt: skip


JOINTS = ("x", "y")  # those of `driven` that have a servo motor
TORQUE_LIMIT = 2.2  # N m
INERTIA = 4.6e-4  # kg m^2


def driven(samples: int = 4000) -> Run:
    """A machine with servo motors, every case followed by itself under a load torque."""
    plain = make_run(samples)
    names = ("independent", "disturbance_observer", "disturbance_observer+inertia_compensation")
    kept, rows = [], []
    for name, signals, row in zip(names, plain.signals, plain.summary.cases, strict=True):
        for disturbed in (False, True):
            case = name + "+disturbed" * disturbed
            motors = motor_signals(signals.time, name, 2.5 if disturbed else 0.0)
            duty = duties(tally_duty(None, motors, np.full(len(JOINTS), TORQUE_LIMIT)))
            grown = {"independent": 4.0, "disturbance_observer": 1.1}.get(name, 1.5) if disturbed else 1.0
            tool = replace(row.tool, rms=grown * row.tool.rms, max=grown * row.tool.max)
            rows.append(replace(row, name=case, tool=tool, motors=duty, disturbed=disturbed))
            kept.append(replace(signals, case=case, motors=motors))
    return replace(plain, signals=tuple(kept), summary=replace(plain.summary, cases=tuple(rows)))


def motor_signals(time: np.ndarray, case: str, peak: float) -> MotorSignals:
    """A load that turns round as it swells and ebbs, an observer that lags, a gain that follows."""
    end = time[-1]
    swelling = peak * np.sin(np.pi * time / end) ** 2
    load = np.column_stack(
        [swelling * np.cos(8.0 * np.pi * time / end), swelling * np.sin(8.0 * np.pi * time / end)]
    )
    friction = 0.08 * np.sign(np.sin(12.0 * np.pi * time / end))[:, None]
    torque = np.clip(load + friction, -TORQUE_LIMIT, TORQUE_LIMIT)
    sees, adapts = case != "independent", "inertia" in case
    pole = np.exp(-(time[1] - time[0]) / 0.01)
    seen = lfilter([1.0 - pole], [1.0, -pole], load + friction, axis=0) * sees
    felt = np.maximum(np.abs(seen) - 0.12, 0.0) / 265.0 * adapts
    gain = np.clip(1.0 + felt / INERTIA, 1.0, 2.5)
    still = np.ones_like(load)
    return MotorSignals(
        JOINTS, frozen(torque), frozen(load), frozen(seen), frozen(gain), frozen(felt), frozen(still),
        frozen(INERTIA * still),
    )  # fmt: skip
