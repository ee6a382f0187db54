"""Shaping while the samples come: a ring of the last of them, and the taps that hark back into it.

An operator's hand, a joystick or another controller gives one position every sample time, and wants the
shaped one at once (paper 000, section 2.2). `Filters` says what is done to the samples, `LiveShaper` does
it: one call for one sample, a multiplication for every tap.

Before its first sample the command rests there, and after its last it rests there for as long as the last
tap needs. Sample by sample, in blocks or as a whole: the answer is the same, bit for bit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.kernels.ring import push_samples
from cnc_shape.modes import Mode
from cnc_shape.shapers.discretisation import Interpolation, Taps, discretise
from cnc_shape.shapers.shaper import NONE, Shaper
from cnc_shape.shapers.shaping import common_delay

SPARE_CELLS = 2  # of the ring, beyond the latest tap


@dataclass(frozen=True, eq=False, slots=True)
class Filters:
    """What is done to the samples of every axis."""

    axes: tuple[str, ...]
    taps: tuple[Taps, ...]  # of each axis
    late: IntArray  # (d,k) samples, the taps that are not zero
    weight: FloatArray  # (d,k)
    count: IntArray  # (d,) taps of each axis

    @property
    def sample_time(self) -> float:
        """Interval of the samples, s."""
        return self.taps[0].sample_time

    @property
    def tail(self) -> int:
        """Samples that are still to come when the command has come to its end."""
        return int(self.late.max(initial=0))

    @property
    def delay(self) -> float:
        """How late the output is on steady motion, s: that of the latest axis."""
        return max(taps.delay for taps in self.taps)


def filters(
    shapers: Mapping[str, Shaper],
    axes: Sequence[str],
    sample_time: float,
    interpolation: Interpolation,
    modes: Mapping[str, Sequence[Mode]],
    *,
    aligned: bool = True,
) -> Filters:
    """Put the shapers of all axes on the sample grid.

    Parameters
    ----------
    shapers
        One shaper per axis name; an axis without one is only delayed.
    axes
        The columns of the samples.
    sample_time
        Interval of the samples, s.
    interpolation
        What becomes of an impulse between two samples.
    modes
        The modes of each axis, for `Interpolation.EXACT`.
    aligned
        Delay every axis to the largest centroid of all shapers, those of axes that are not streamed, too: on
        steady motion all axes of a machine are late alike, and no path is bent. Otherwise each axis is as
        early as its shaper lets it be, which suits axes that move one at a time.

    Raises
    ------
    OptionError, InfeasibleError
        As `discretise`.
    ValueError
        No axes.
    """
    if not axes:
        raise ValueError(f"{axes=}")
    delay = common_delay(shapers) if aligned else None
    taps: list[Taps] = []
    for axis in axes:
        shaper = shapers.get(axis, NONE)
        known = modes.get(axis, ()) if axis in shapers else ()
        taps.append(discretise(shaper, sample_time, interpolation, known, delay=delay))
    latest = max(tap.latency for tap in taps)
    if aligned:
        taps = [_later(tap, latest - tap.latency) for tap in taps]
    return _packed(tuple(axes), tuple(taps))


def _later(taps: Taps, samples: int) -> Taps:
    weights = np.concatenate([np.zeros(samples), taps.weights])
    return Taps(frozen(weights), taps.sample_time, taps.latency + samples)


def _packed(axes: tuple[str, ...], taps: tuple[Taps, ...]) -> Filters:
    most = max(tap.used.size for tap in taps)
    late, weight = np.zeros((len(taps), most), dtype=np.int64), np.zeros((len(taps), most))
    for row, tap in enumerate(taps):
        used = tap.used
        late[row, : used.size], weight[row, : used.size] = used, tap.weights[used]
    count = frozen_integers([tap.used.size for tap in taps])
    return Filters(axes, taps, frozen_integers(late), frozen(weight), count)


@dataclass(frozen=True, eq=False, slots=True)
class Ring:
    """What a live shaper remembers: the last samples of every axis."""

    cells: FloatArray  # (c,d)
    newest: int  # row of the last sample


class LiveShaper:
    """Shapes samples as they come.

    Parameters
    ----------
    filters
        What is done to them.
    ring
        What another live shaper of the same filters remembered, to go on from there. None: the first sample
        is still to come, and the command has been resting there.
    """

    def __init__(self, filters: Filters, ring: Ring | None = None) -> None:
        self.filters = filters
        self._cells: FloatArray = np.zeros((filters.tail + SPARE_CELLS, len(filters.axes)))
        self._newest = 0
        self._started = ring is not None
        if ring is not None:
            if ring.cells.shape != self._cells.shape:
                raise ValueError(f"{ring.cells.shape=}, not {self._cells.shape}")
            self._cells[:] = ring.cells
            self._newest = ring.newest

    @property
    def ring(self) -> Ring | None:
        """What it remembers now, as a value; None before the first sample."""
        return Ring(frozen(self._cells.copy()), self._newest) if self._started else None

    def push(self, sample: FloatArray) -> FloatArray:
        """Take the next sample (d,) and return the shaped one (d,)."""
        return self.push_many(sample[np.newaxis])[0]

    def push_many(self, samples: FloatArray) -> FloatArray:
        """Take the next samples (n,d) and return as many shaped ones (n,d)."""
        if samples.ndim != 2 or samples.shape[1] != self._cells.shape[1]:
            raise ValueError(f"{samples.shape=}, with {self._cells.shape[1]} axes")
        signal = np.array(samples, dtype=np.float64, order="C")
        if not self._started and len(signal):
            self._cells[:] = signal[0]
            self._started = True
        wanted = self.filters
        self._newest = push_samples(
            self._cells, self._newest, signal, wanted.late, wanted.weight, wanted.count
        )
        return signal

    def flush(self) -> FloatArray:
        """End the command at its last sample and return what is still to come (`Filters.tail`, d).

        Afterwards the shaper is as new.
        """
        if not self._started:
            return np.empty((0, self._cells.shape[1]))
        rest = self.push_many(np.tile(self._cells[self._newest], (self.filters.tail, 1)))
        self._started = False
        return rest


def shape_samples(positions: FloatArray, filters: Filters) -> FloatArray:
    """Shape all samples of a command, from rest to rest.

    Parameters
    ----------
    positions
        (n,d), one row every sample time, in any unit.
    filters
        What is done to them.

    Returns
    -------
    FloatArray
        (n + `Filters.tail`, d); nothing where there is nothing. A live shaper says the same, bit for bit.
    """
    shaper = LiveShaper(filters)
    return np.concatenate([shaper.push_many(positions), shaper.flush()])
