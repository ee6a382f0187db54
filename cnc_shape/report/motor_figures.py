"""What the servo motors of a case did over time: torque, what their observers made of the load, and gains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cnc_shape.arrays import FloatArray
from cnc_shape.pipeline import Run
from cnc_shape.recording import Signals
from cnc_shape.report.figures import worst_rows
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, new_figure, styled
from cnc_shape.response import MotorSignals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DRAWN = 600  # buckets of a line
LOAD: dict[str, Any] = {"color": PATH_COLOUR, "linewidth": 2.4, "alpha": 0.6}
TORQUE: dict[str, Any] = {"color": COLOURS[4], "linewidth": 0.8}
ESTIMATE: dict[str, Any] = {"color": COLOURS[1], "linewidth": 1.1}
MOTORS: Sequence[dict[str, Any]] = tuple(
    {"color": COLOURS[k], "linestyle": dash, "linewidth": 1.1} for dash in ("-", "--") for k in (0, 2, 3, 5)
)


def motor_cases(run: Run) -> list[Signals]:
    """The cases whose motors are drawn: the disturbed ones; where there are none, the last."""
    moved = [signals for signals in run.signals if signals.motors is not None]
    disturbed = {case.name for case in run.summary.cases if case.disturbed}
    return [signals for signals in moved if signals.case in disturbed] or moved[-1:]


@styled
def motor_figure(signals: Signals) -> Figure:
    """Torque, load and its estimate of every motor, and below what the compensation made of them.

    Raises
    ------
    ValueError
        A case without servo motors.
    """
    motors = signals.motors
    if motors is None:
        raise ValueError(f"{signals.case=} has no servo motors")
    below = _below(motors)
    count = len(motors.joints)
    figure, axes = new_figure(WIDTH, 0.45 + 1.25 * (count + len(below)), count + len(below), 1, sharex=True)
    for k, (ax, joint) in enumerate(zip(axes, motors.joints, strict=False)):
        _draw(ax, signals.time, motors.load[:, k], "load, injected", LOAD)
        _draw(ax, signals.time, motors.torque[:, k], "torque", TORQUE)
        if motors.estimate.any():
            _draw(ax, signals.time, motors.estimate[:, k], "load, observed", ESTIMATE)
        ax.set_title(f"Motor {joint.upper()}")
        ax.set_ylabel("torque (N m)")
    for ax, (title, label, values) in zip(axes[count:], below, strict=True):
        for k, joint in enumerate(motors.joints):
            _draw(ax, signals.time, values[:, k], joint.upper(), MOTORS[k % len(MOTORS)])
        ax.set_title(title)
        ax.set_ylabel(label)
    for ax in axes:
        ax.margins(x=0.0)
    axes[-1].set_xlabel("time (s)")
    for ax in (axes[0], *axes[count : count + 1]):
        _legend(ax)
    return figure


def _below(motors: MotorSignals) -> list[tuple[str, str, FloatArray]]:
    """Title, label and values of what is worth a panel of its own: what does not stand still."""
    panels = [
        ("Velocity gain over the nominal one", "gain ratio (-)", motors.gain_ratio),
        ("Effective inertia of the load", "inertia (kg m²)", motors.effective_inertia),
        ("Identified inertia", "inertia (kg m²)", motors.inertia),
    ]
    return [panel for panel in panels if (panel[2] != panel[2][:1]).any()]


def _draw(ax: Axes, time: FloatArray, values: FloatArray, label: str, style: dict[str, Any]) -> None:
    rows = worst_rows(values, DRAWN)
    ax.plot(time[rows], values[rows], label=label, **style)


def _legend(ax: Axes) -> None:
    """Name the lines beside the panel's title."""
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=6, borderaxespad=0.0)
