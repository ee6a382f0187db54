"""Extremes: rows thinned in buckets while they come, in memory that is fixed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen
from cnc_shape.kernels.extremes import join_buckets, keep_largest

BUCKETS = 16_384  # a power of two
PIECE = 4096  # rows that are moved at once


class Extremes:
    """The rows where one of several measures is largest in its bucket; all rows while there is room.

    Parameters
    ----------
    measure
        Rows (n,columns) to measures (picks,n), finite, row by row.
    picks
        How many measures there are.
    columns
        Of a row.
    buckets
        How many at most, a power of two; ``picks * buckets`` rows are kept as they are.
    """

    def __init__(
        self, measure: Callable[[FloatArray], FloatArray], picks: int, columns: int, buckets: int = BUCKETS
    ) -> None:
        self._measure = measure
        self._picks = picks
        self._best = np.full((buckets, picks), -np.inf)
        self._index = np.zeros((buckets, picks), np.int64)
        self._kept = np.empty((buckets, picks, columns))
        self._width = picks  # rows a bucket
        self._count = 0

    @property
    def factor(self) -> int:
        """1: every row is there; n: at most one of n."""
        return self._width // self._picks

    def add(self, rows: FloatArray) -> None:
        """Take the next rows."""
        if self._width == self._picks:
            slots = self._slots()
            if self._count + rows.shape[0] <= slots.shape[0]:
                slots[self._count : self._count + rows.shape[0]] = rows
                self._count += rows.shape[0]
                return
            self._begin_buckets(slots)
        self._fold(rows)

    def rows(self) -> tuple[IntArray, FloatArray]:
        """What is kept, in order: indices (m,) and rows (m,columns)."""
        if self._width == self._picks:
            return np.arange(self._count, dtype=np.int64), self._slots()[: self._count]
        used = -(-self._count // self._width)
        index, first = np.unique(self._index[:used], return_index=True)
        return index, self._slots()[first]

    def _slots(self) -> FloatArray:
        return self._kept.reshape(-1, self._kept.shape[2])

    def _begin_buckets(self, slots: FloatArray) -> None:
        """Fold the rows that are there where they are: a bucket has half as many slots as rows."""
        count, self._count = self._count, 0
        self._width *= 2
        for low in range(0, count, PIECE):
            self._fold(slots[low : min(low + PIECE, count)].copy())

    def _fold(self, rows: FloatArray) -> None:
        while rows.shape[0]:
            room = self._width * self._best.shape[0] - self._count
            if room == 0:
                join_buckets(self._best, self._index, self._kept)
                self._width *= 2
                continue
            part, rows = frozen(rows[:room]), rows[room:]
            measures = frozen(self._measure(part))
            keep_largest(measures, part, self._count, self._width, self._best, self._index, self._kept)
            self._count += part.shape[0]
