"""Reading way-points from CSV, against pandas; where that is missing, against numpy's own reader."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial
from itertools import islice
from pathlib import Path
from random import Random

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import Kind, Row, best_of, report, workshop
from benchmarks.programs import SEED, mm
from cnc_shape.readers import read_chunks

ROWS = 2_000_000
ROUNDS = 2
RECORDED = 0.61 / 1.18  # pandas over numpy.loadtxt


def points(random: Random) -> Iterator[str]:
    """A wandering path: three positions and a feed a row."""
    place = [0, 0, 0]
    while True:
        place = [old + int(random.random() * 401.0) - 200 for old in place]
        yield f"{mm(place[0])},{mm(place[1])},{mm(place[2])},{1200 + place[0] % 7 * 100}"


def read(path: Path) -> int:
    """Read a table as the commands do, chunk by chunk."""
    return sum(len(chunk) for chunk in read_chunks(path))


def rows() -> Iterator[Row]:
    """Measure."""
    with workshop() as folder:
        path = folder / "points.csv"
        with path.open("w", encoding="ascii") as file:
            file.write("x_mm,y_mm,z_mm,feed_mm_min\n")
            file.writelines(f"{line}\n" for line in islice(points(Random(SEED)), ROWS))
        ours = best_of(ROUNDS, partial(read, path))
        numpy_time = best_of(ROUNDS, partial(np.loadtxt, path, delimiter=",", skiprows=1))
        stage = f"read CSV, {ROWS / 1e6:g} M × 4"
        yield Row(stage, Kind.SHARE, None, "numpy.loadtxt", "s", ours, numpy_time)
        try:
            import pandas as pd
        except ImportError:
            note = "pandas is not installed: reckoned from numpy.loadtxt by the recorded ratio"
            name, peer = "pandas (reckoned)", numpy_time * RECORDED
        else:
            name, peer, note = "pandas", best_of(ROUNDS, partial(pd.read_csv, path)), ""
        yield Row(stage, Kind.SHARE, 1.2, name, "s", ours, peer, note)


if __name__ == "__main__":
    report(rows())
