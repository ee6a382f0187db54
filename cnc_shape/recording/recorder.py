"""Recorder: takes the samples of one case as they come, and keeps what its report is made of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cnc_shape.arrays import FloatArray, frozen, frozen_integers
from cnc_shape.contour import ContourError
from cnc_shape.kernels.extremes import sample_measures
from cnc_shape.recording.extremes import BUCKETS, Extremes
from cnc_shape.recording.signals import (
    ERRORS,
    MOTIONS,
    MOTORS,
    Samples,
    Signals,
    columns,
    picks,
    require_finite,
)
from cnc_shape.response import MotorSignals, Response
from cnc_shape.writers.spool import Spool

KEPT = 2_000_000  # samples of a case that are all kept, unless all are asked for


class Recorder:
    """Collects the signals of one case, block by block.

    Parameters
    ----------
    case
        Its name.
    axes
        Of its command; the first three are linear.
    sample_time
        s.
    motors
        Joints that have a servo motor. Rows are about twice as long with them, so there are half the buckets.
    all_signals
        Keep every sample, however many there are.
    kept, buckets
        Every sample is kept up to `kept`; `picks` times `buckets` of them in memory.
    """

    def __init__(
        self,
        case: str,
        axes: tuple[str, ...],
        sample_time: float,
        *,
        motors: tuple[str, ...] = (),
        all_signals: bool = False,
        kept: int = KEPT,
        buckets: int = BUCKETS,
    ) -> None:
        self._case, self._axes, self._sample_time = case, axes, sample_time
        self._kept = None if all_signals else kept
        self._motors = motors
        self._columns = columns(len(axes), len(motors))
        foot = self._columns["foot"]
        self._spool: Spool | None = Spool(foot.start)
        room = buckets // 2 if motors else buckets
        self._extremes: Extremes | None = Extremes(self._measure, picks(bool(motors)), foot.stop, room)
        self._waiting = np.zeros((0, foot.start))  # samples whose error is not decided yet
        self._count = 0

    def add(self, response: Response, errors: Sequence[ContourError]) -> None:
        """Take a block of samples, and the contour errors of those that are decided by now.

        errors: of the command, the drives and the tool.

        Raises
        ------
        InfeasibleError
            A sample that is not finite; it names signal, axis and time.
        OutputError
            The folder for temporary files is full.
        ValueError
            Signals of other motors than the recorder's.
        """
        if self._extremes is None:
            raise ValueError("the signals were asked for already")
        decided, places = errors[0].distance.size, self._columns
        waited = self._waiting.shape[0]
        table = np.empty((waited + len(response.command), places["foot"].stop))
        table[:waited, : self._waiting.shape[1]] = self._waiting
        command = response.command
        motions = (
            command.position, response.position, response.tool, command.velocity, command.acceleration,
        )  # fmt: skip
        for name, values in zip(MOTIONS, motions, strict=True):
            table[waited:, places[name]] = values
        motors = response.motors
        if len(command) and self._motors != (motors.joints if motors is not None else ()):
            raise ValueError(f"{self._motors=} and {motors=}")
        if len(command) and motors is not None:
            for name in MOTORS:
                table[waited:, places[name]] = getattr(motors, name)
        self._waiting = table[decided:, : self._waiting.shape[1]].copy()
        rows = table[:decided]
        for name, error in zip(ERRORS, errors, strict=True):
            rows[:, places[name].start] = error.distance
        rows[:, places["line"].start] = errors[-1].line
        rows[:, places["foot"]] = errors[-1].foot
        if not np.isfinite(rows).all():
            self._refuse(rows)
        self._extremes.add(rows)
        self._count += decided
        if self._spool is not None and self._kept is not None and self._count > self._kept:
            self._spool = None
        if self._spool is not None:
            self._spool.append(rows[:, : self._columns["foot"].start])

    def signals(self, settling: FloatArray) -> Signals:
        """What was kept, as one value; call it once, after the last block.

        settling: (m,d) tool minus drive, every sample from the end of the motion on.
        """
        if self._extremes is None:
            raise ValueError("the signals were asked for already")
        factor, (index, rows) = self._extremes.factor, self._extremes.rows()
        self._extremes = None  # before the next case makes its own copy
        kept = {name: frozen(rows[:, place]) for name, place in self._columns.items()}
        command_error, drive_error, tool_error, line = (kept[name].ravel() for name in (*ERRORS, "line"))
        time = frozen(np.arange(settling.shape[0], dtype=np.int64) * self._sample_time)
        require_finite("settling", settling, self._case, self._axes, time)
        samples = None
        if factor > 1 and self._spool is not None:
            samples = Samples(self._axes, self._sample_time, self._spool, self._motors)
        motors = MotorSignals(self._motors, *(kept[name] for name in MOTORS)) if self._motors else None
        return Signals(
            case=self._case, axes=self._axes, factor=factor,
            time=frozen(index * self._sample_time),
            command=kept["command"], position=kept["position"], tool=kept["tool"],
            velocity=kept["velocity"], acceleration=kept["acceleration"],
            command_error=command_error, drive_error=drive_error, tool_error=tool_error,
            foot=kept["foot"], line=frozen_integers(line),
            settling_time=time, settling=frozen(settling), samples=samples, motors=motors,
        )  # fmt: skip

    def _measure(self, rows: FloatArray) -> FloatArray:
        measures = sample_measures(rows, len(self._axes))
        if not self._motors:
            return measures
        torque, load, estimate, gain_ratio = (
            rows[:, self._columns[name]] for name in ("torque", "load", "estimate", "gain_ratio")
        )
        unseen = np.abs(estimate - load)
        return np.vstack([measures, np.abs(torque).max(axis=1), unseen.max(axis=1), gain_ratio.max(axis=1)])

    def _refuse(self, rows: FloatArray) -> None:
        """Name what is not finite first."""
        first = int(np.isfinite(rows).all(axis=1).argmin())
        row, time = rows[first : first + 1], np.array([(self._count + first) * self._sample_time])
        for name, place in self._columns.items():
            several = self._motors if name in MOTORS else self._axes
            values = row[:, place] if name in MOTIONS or name in MOTORS else row[:, place.start]
            require_finite(name, values, self._case, several, time)
