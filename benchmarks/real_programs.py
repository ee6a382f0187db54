"""Programs of real machines, simulated: how many times faster than they run.

Processor time of the whole process less that of a program of one line. With a jerk limit the slowest of them
counts. The programs belong to others and lie
beside the project (CNC_SHAPE_SHARED names the folder); where they are missing, nothing is measured.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.machines import jerk_limited
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
MORE_PROGRAMS = (
    "lcnc_arcspiral.ngc",
    "lcnc_boat_xyzbc.ngc",
    "lcnc_cds.ngc",
    "lcnc_lathe_pawn.ngc",
    "ugs_communicator.nc",
    "ugs_no_spaces.gcode",
)
CASES = {"one case": "shaped", "three cases": "unshaped,shaped,shaped+cross_coupled"}
BUDGETS = {"one case": 500.0, "three cases": None}
SLOWEST = "the slowest real program with a jerk limit, one case"
SLOWEST_BUDGET = 300.0
ROUNDS = 1  # there are minutes of work in them
PEER = "the motion itself"


def rows() -> Iterator[Row]:
    """Measure."""
    folder = SHARED / "data" / "gcode" / "programs"
    missing = [name for name in (*PROGRAMS, *MORE_PROGRAMS) if not (folder / name).is_file()]
    if missing:
        note = f"reference programs absent: {', '.join(missing)}"
        for cases, budget in BUDGETS.items():
            yield Row(f"real programs, {cases}", Kind.SPEED_UP, budget, PEER, note=note)
        yield Row(SLOWEST, Kind.SPEED_UP, SLOWEST_BUDGET, PEER, note=note)
        return
    with workshop() as place:
        for cases, budget in BUDGETS.items():
            command = [*CNC_SHAPE, "simulate", "--json", "--cases", CASES[cases]]
            used = dict(_measured(command, [folder / name for name in PROGRAMS], cases, place))
            total, motion = (sum(values) for values in zip(*used.values(), strict=True))
            yield Row(f"real programs, {cases}", Kind.SPEED_UP, budget, PEER, "s", total, motion)
        command = [*CNC_SHAPE, "simulate", "--json", "--cases", "shaped", "-m", str(jerk_limited(place))]
        every = [folder / name for name in (*PROGRAMS, *MORE_PROGRAMS)]
        used = dict(_measured(command, every, "jerk limit", place))
        name, (ours, motion) = min(used.items(), key=lambda item: item[1][1] / item[1][0])
        yield Row(SLOWEST, Kind.SPEED_UP, SLOWEST_BUDGET, PEER, "s", ours, motion, name)


def _measured(
    command: list[str], sources: list[Path], variant: str, place: Path
) -> Iterator[tuple[str, tuple[float, float]]]:
    """Processor time (s) of each program, less that of one line, and how long its motion lasts (s)."""
    tiny = written("raster", 1, place)
    child([*command, str(tiny)], place)
    idle = best_child(3, [*command, str(tiny)], place).cpu
    for source in sources:
        used = best_child(ROUNDS, [*command, str(source)], place)
        duration = json.loads(used.output)["cycle_time_s"]
        print(f"{source.name}, {variant}: {quantity(duration / (used.cpu - idle), '× real time')}")
        yield source.name, (used.cpu - idle, duration)


if __name__ == "__main__":
    report(rows())
