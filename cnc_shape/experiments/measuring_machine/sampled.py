"""Real-time shaping of a hand-driven motion: what the interval and the ramp inside it cost."""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.experiments.experiment import Row, Table
from cnc_shape.experiments.straight_motion import StraightMotion
from cnc_shape.modes import Mode
from cnc_shape.shapers import NONE, Shaper, zv
from cnc_shape.shapers.analysis import vibration
from cnc_shape.shapers.discretisation import Interpolation, discretise, worst_residual

MODE = Mode(natural_frequency=1.0, damping_ratio=0.0)  # one period is one second
INTERVALS = (0.01, 0.05, 0.1, 0.2)  # of a period
JITTER = 0.1  # -, how far the interval varies for the mean
TRIED = 401  # intervals of the mean
SHOWN = 5e-4  # %, digits of what is 0 but for rounding
TOLERATED = 0.05  # -, V
WAYS = {"rounded": Interpolation.ROUNDED, "linear": Interpolation.LINEAR, "exact": Interpolation.EXACT}


def left(interval: float, way: Interpolation) -> float:
    """V of a ZV shaper whose impulses are put on a grid of this interval, in periods."""
    taps = discretise(zv(MODE), interval * MODE.damped_period, way, [MODE])
    return float(vibration(taps.shaper, MODE.omega, MODE.damping_ratio))


def mean_left(interval: float, way: Interpolation) -> float:
    """Root mean square of V where the interval varies by 10 %."""
    tried = interval * np.linspace(1.0 - JITTER, 1.0 + JITTER, TRIED)
    return float(np.sqrt(np.mean([left(one, way) ** 2 for one in tried.tolist()])))


def longest_interval(way: Interpolation) -> float:
    """Interval, in periods, up to which no more than 5 % are left at the worst place, by halving."""
    low, high = 0.0, 0.5
    for _ in range(50):
        middle = 0.5 * (low + high)
        fine = worst_residual(way, middle * MODE.damped_period, MODE) <= TOLERATED
        low, high = (middle, high) if fine else (low, middle)
    return low


def ramp_left(interval: float) -> float:
    """Vibration after a change of speed that takes the whole interval, over that of a sudden one."""
    ramp = StraightMotion(frozen([0.0, interval]), frozen([1.0 / interval, -1.0 / interval]))
    return ramp.ring(MODE) * MODE.omega


def interval_table() -> Table:
    """Section 2.2: impulses on the grid of a real-time command."""
    rows: list[Row] = []
    for interval in INTERVALS:
        at = f"interval {interval:g} T"
        for name, way in list(WAYS.items())[:2]:
            worst = 100.0 * worst_residual(way, interval * MODE.damped_period, MODE)
            rows.append(Row(f"{at}, {name}: at worst", "%", None, worst, 0.0,
                            "second impulse half-way between two samples; closed form"))  # fmt: skip
            rows.append(Row(f"{at}, {name}: root mean square", "%", None, 100.0 * mean_left(interval, way),
                            0.0, "V of the taps, interval varied by ±10 %"))  # fmt: skip
        worst = max(left(one, Interpolation.EXACT) for one in (0.93 * interval, interval, 1.07 * interval))
        rows.append(Row(f"{at}, exact: at worst", "%", None, 100.0 * worst, SHOWN,
                        "amplitudes solved again on the grid, at 0.93, 1 and 1.07 of the interval: "
                        "rounding is left"))  # fmt: skip
        rows.append(Row(f"{at}, ramp as long as the interval", "%", None, 100.0 * ramp_left(interval), 0.0,
                        "excitation over that of a sudden change: sinc(f τ)"))  # fmt: skip
    rows += [
        Row(f"longest interval for 5 %, {name}", "T", None, longest_interval(WAYS[name]), 0.0,
            "at the worst place; by halving")
        for name in ("rounded", "linear")
    ]  # fmt: skip
    return Table(
        "Section 2.2, Figs. 5 and 6: real-time shaping, ZV, undamped",
        tuple(rows),
        "The paper says that a small interval is better and a ramp close to the interval shakes less, "
        "without "
        "numbers. The first is right for rounded impulses, V = sin(πΔ/2T) at worst; dividing an impulse "
        "between its two neighbours leaves the square of that, solving for the amplitudes again leaves "
        "nothing. "
        "The second is weak: a ramp of the whole interval still excites 98 % at a tenth of a period.",
    )


def jog(interval: float, speeds: FloatArray, shaper: Shaper = NONE) -> StraightMotion:
    """Hand-driven motion: a speed for each interval, changed at once, through a shaper.

    Parameters
    ----------
    interval
        s.
    speeds
        (n,) mm/s.
    shaper
        As taps on the grid of the intervals, or as it is.
    """
    changes = np.diff(np.concatenate([[0.0], speeds, [0.0]]))
    ramp = 0.5 * interval
    starts = interval * np.arange(changes.size)
    times = np.concatenate([starts, starts + ramp])
    return StraightMotion(
        frozen(times), frozen(np.concatenate([changes, -changes]) / ramp)
    ).shaped(shaper)  # fmt: skip
