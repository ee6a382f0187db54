"""Peak memory of ``check`` and ``simulate``, one case, on a million blocks; with ``--long`` on ten million.

The kernels are warm and there is no report. Flat means: ten times the program, the same memory.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.machines import jerk_limited
from benchmarks.measuring import CNC_SHAPE, Kind, Row, child, quantity, report, workshop, written

SIZES = (100_000, 1_000_000)
LONG_SIZES = (1_000_000, 10_000_000)
SIMULATE = ("simulate", "--json", "--cases", "shaped")
COMMANDS = {"check": ("check", "--json"), "simulate": SIMULATE, "simulate with a jerk limit": SIMULATE}
MOST = 300.0  # MB


def rows(sizes: tuple[int, int]) -> Iterator[Row]:
    """Measure: one row a command, of the longer program, beside the shorter one."""
    with workshop() as folder:
        programs = [written("raster", blocks, folder) for blocks in sizes]
        for name, words in COMMANDS.items():
            machine = ("-m", str(jerk_limited(folder))) if "jerk" in name else ()
            command = [*CNC_SHAPE, *words, *machine]
            child([*command, str(written("raster", 10, folder))], folder)
            short, long = (child([*command, str(program)], folder) for program in programs)
            beside = f"{name}, {sizes[0] / 1e6:g} M blocks"
            note = f"{quantity(long.cpu, 's')} of processor time"
            stage = f"memory of {name}, {sizes[1] / 1e6:g} M blocks"
            yield Row(stage, Kind.LIMIT, MOST, beside, "MB", long.peak, short.peak, note)


if __name__ == "__main__":
    report(rows(LONG_SIZES if "--long" in sys.argv else SIZES))
