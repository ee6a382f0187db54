"""The first run after an install: the kernels compile, and one line says so."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import CNC_SHAPE, Kind, Row, child, report, workshop, written

MOST = {"check": 15.0, "simulate": 40.0}  # s


def rows() -> Iterator[Row]:
    """Measure, each command with an empty cache."""
    with workshop() as folder:
        tiny = str(written("raster", 1, folder))
        for command, most in MOST.items():
            cache = folder / f"{command}-cache"
            cache.mkdir()
            empty = {"XDG_CACHE_HOME": str(cache), "NUMBA_CACHE_DIR": None}
            used = child([*CNC_SHAPE, command, tiny], folder, environment=empty)
            compiled = any(cache.rglob("*.nbc"))
            note = "compiles nothing" if not compiled else _announced(used.complaints)
            yield Row(f"first run, {command}", Kind.LIMIT, most, unit="s", ours=used.cpu, note=note)


def _announced(complaints: str) -> str:
    told = [line for line in complaints.splitlines() if "compiling" in line]
    return "says so in one line" if len(told) == 1 else f"{len(told)} lines say so"


if __name__ == "__main__":
    report(rows())
