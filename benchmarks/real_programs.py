"""Programs of real machines, simulated: how many times faster than they run.

Processor time of the whole process less that of a program of one line. The programs belong to others and lie
beside the project (CNC_SHAPE_SHARED names the folder); where they are missing, nothing is measured.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import (
    CNC_SHAPE,
    SHARED,
    Kind,
    Row,
    best_child,
    child,
    quantity,
    report,
    workshop,
    written,
)

PROGRAMS = (
    "camotics_tiger.nc",
    "ugs_rotation.ngc",
    "webgcode_pycam.ngc",
    "cncjs_tball_pocket_laser.gcode",
    "gp_screw.gcode",
)
CASES = {"one case": "shaped", "three cases": "unshaped,shaped,shaped+cross_coupled"}
ROUNDS = 1  # there are minutes of work in them
PEER = "the motion itself"


def rows() -> Iterator[Row]:
    """Measure."""
    budgets = {"one case": 500.0, "three cases": None}
    sources = [SHARED / "data" / "gcode" / "programs" / name for name in PROGRAMS]
    missing = [source.name for source in sources if not source.is_file()]
    if missing:
        for cases, budget in budgets.items():
            note = f"reference programs absent: {', '.join(missing)}"
            yield Row(f"real programs, {cases}", Kind.SPEED_UP, budget, PEER, note=note)
        return
    with workshop() as folder:
        tiny = written("raster", 1, folder)
        for cases, budget in budgets.items():
            command = [*CNC_SHAPE, "simulate", "--json", "--cases", CASES[cases]]
            child([*command, str(tiny)], folder)
            idle = best_child(3, [*command, str(tiny)], folder).cpu
            total = motion = 0.0
            for source in sources:
                used = best_child(ROUNDS, [*command, str(source)], folder)
                duration = json.loads(used.output)["cycle_time_s"]
                print(f"{source.name}, {cases}: {quantity(duration / (used.cpu - idle), '× real time')}")
                total, motion = total + used.cpu - idle, motion + duration
            yield Row(f"real programs, {cases}", Kind.SPEED_UP, budget, PEER, "s", total, motion)


if __name__ == "__main__":
    report(rows())
