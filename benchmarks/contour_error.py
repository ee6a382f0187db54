"""Contour error, windowed and exact, against a k-d tree's query for the nearest vertex.

Prints ns per sample of both, for windows of several lengths, and their ratio, from one run. The paths
are a dense polyline, 0.02 mm a segment, as a CAM program is, and a chain of short arcs.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np
from scipy.spatial import cKDTree

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from paths import arc, line, toolpath

from benchmarks.measuring import Kind, Row, report
from cnc_shape.arrays import FloatArray
from cnc_shape.contour import contour_error
from cnc_shape.toolpath import Toolpath

SEGMENT = 0.02  # mm
SPEED = 0.05  # mm a sample: 50 mm/s at 1 kHz
ERROR = 0.005  # mm, amplitude of a vibration about the path
PASSES = 8  # over the path, so that laying it out weighs little
WINDOWS = (1.0, 5.0, 20.0, 50.0)  # mm


def dense(count: int) -> tuple[Toolpath, FloatArray, FloatArray]:
    """A wavy spiral in about SEGMENT a segment; points of it, and where they lie along it."""
    angle = np.sqrt(2.0 * SEGMENT * np.arange(count + 1) / 0.2 + 400.0)
    radius = 0.2 * angle + 0.5 * np.sin(7.0 * angle)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.01 * angle], axis=1)
    path = toolpath(*[line(*p) for p in points[1:]], start=tuple(points[0]))
    return path, points, path.arc_length


def scallops(count: int) -> tuple[Toolpath, FloatArray, FloatArray]:
    """Half circles of 1 mm in a row; points SEGMENT apart on them, and where they lie along them."""
    moves = [
        arc((2.0 * k + 2.0, 0.0, 0.0), (2.0 * k + 1.0, 0.0, 0.0), np.pi * (-1) ** k) for k in range(count)
    ]
    place = np.arange(0.0, count * np.pi, SEGMENT)
    k = np.floor(place / np.pi)
    angle = np.pi + (place - k * np.pi) * (-1.0) ** k
    points = np.stack([2.0 * k + 1.0 + np.cos(angle), np.sin(angle), 0.0 * k], axis=1)
    return toolpath(*moves), points, place


def samples_along(vertices: FloatArray, along: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Places SPEED apart on the path, and positions about ERROR beside them."""
    place = np.arange(0.0, along[-1], SPEED)
    on_path = np.stack([np.interp(place, along, vertices[:, axis]) for axis in range(3)], axis=1)
    time = np.arange(place.size) * 1e-3
    vibration = [np.sin(2.0 * np.pi * frequency * time) for frequency in (31.0, 37.0, 53.0)]
    return place, on_path + ERROR * np.stack(vibration, axis=1)


def best_of(rounds: int, call) -> float:
    """Least time of `rounds` calls, s."""
    times = []
    for _ in range(rounds):
        start = perf_counter()
        call()
        times.append(perf_counter() - start)
    return min(times)


def main() -> None:
    """Print one line a path and window."""
    for name, (path, vertices, along) in {
        "dense polyline": dense(200_000),
        "chain of arcs": scallops(2_000),
    }.items():
        place, position = samples_along(vertices, along)
        place, position = np.tile(place, PASSES), np.tile(position, (PASSES, 1))
        tree = cKDTree(vertices)
        peer = best_of(3, lambda: tree.query(position)) / place.size  # noqa: B023
        empty = position[:1], place[:1], place[:1]
        lay_out = best_of(3, lambda: contour_error(empty[0], path, *empty[1:]))  # noqa: B023
        print(f"{name}: {len(path)} segments, {place.size} samples")
        print(f"  cKDTree, nearest vertex   {peer * 1e9:7.0f} ns/sample")
        print(f"  laying the path out       {lay_out / len(path) * 1e9:7.0f} ns/segment")
        for window in WINDOWS:
            lower, upper = place - 0.7 * window, place + 0.3 * window
            ours = best_of(5, lambda: contour_error(position, path, lower, upper)) - lay_out  # noqa: B023
            print(
                f"  window {window:4.0f} mm            {ours / place.size * 1e9:7.0f} ns/sample"
                f"   {ours / place.size / peer:5.2f} of the peer"
            )
            stage, unit = f"contour error, {name}, window {window:g} mm", "ns/sample"
            ours_each, peer_each = ours / place.size * 1e9, peer * 1e9
            report([Row(stage, Kind.SHARE, 0.25, "cKDTree, vertices only", unit, ours_each, peer_each)])


if __name__ == "__main__":
    main()
