"""Outline: the programmed path as a polyline to draw."""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import FloatArray, frozen, frozen_integers
from cnc_shape.kernels.foot_point import points_at
from cnc_shape.recording.extremes import BUCKETS, Extremes
from cnc_shape.segments import path_table, segments
from cnc_shape.toolpath import Toolpath

OUTLINE_ANGLE = 0.05  # rad, of a chord that stands for an arc in a drawing


class Outline:
    """Collects the programmed path as a polyline to draw, bucket by bucket its outermost points."""

    def __init__(self, buckets: int = BUCKETS) -> None:
        self._points = Extremes(_outermost, 6, 3, buckets)
        self._begun = False

    def add(self, toolpath: Toolpath) -> None:
        """Take the next chunk of the path; arcs are chopped into chords."""
        path = segments(toolpath, first=not self._begun)
        if path.low.size == 0:
            return
        chords = np.ones(path.low.size, dtype=np.int64)
        turns = path.arc >= 0
        chords[turns] = np.ceil(path.arcs[:, 15] / OUTLINE_ANGLE).astype(np.int64)
        row = np.repeat(np.arange(chords.size), chords)
        share = (np.arange(row.size) - np.repeat(np.cumsum(chords) - chords, chords) + 1) / chords[row]
        place = path.low[row] + share * (path.high[row] - path.low[row])
        points = points_at(frozen(place), frozen_integers(row), path_table(path))
        if not self._begun:
            self._points.add(path.start[:1])
        self._points.add(points)
        self._begun = True

    def points(self) -> FloatArray:
        """The polyline, (p,3) mm."""
        return frozen(self._points.rows()[1])


def _outermost(points: FloatArray) -> FloatArray:
    return np.vstack([points.T, -points.T])
