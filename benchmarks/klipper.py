"""Klipper's batch mode as a peer: it plans a printer's program and writes what its drives would be told.

Measured where an interpreter has it: this one, or the one that the environment variable CNC_SHAPE_KLIPPY
names. The package `kalico` brings Klippy, the host program of a Klipper fork; it wants a compiler at its
first run. Elsewhere the number is the recorded one.

Klippy computes with the limits of the bundled machine on three axes. A right-angled corner passes at the
speed at which an arc that leaves it by our path tolerance takes all the acceleration,
``sqrt(tolerance * acceleration / (sqrt(2) - 1))``. There is no extruder: E words are taken out, which
cnc-shape does not simulate either.
"""

from __future__ import annotations

import json
import math
import os
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path

from benchmarks.measuring import Usage, best_child, child, figures

VARIABLE = "CNC_SHAPE_KLIPPY"
RECORDED = 4.6  # s of processor time for 200 k lines, 250 times real time

# the bundled XY stage, mm and s; Klippy bounds the path's acceleration, and that of z apart
VELOCITY, ACCELERATION = 500.0, 5000.0
Z_VELOCITY, Z_ACCELERATION = 200.0, 2000.0
TOLERANCE = 0.01

TURN = {"x": 40, "y": 40, "z": 8}  # mm a turn of the motor, 200 full steps of 16: 80 and 400 steps/mm
TRAVEL = 1000  # mm, beyond whatever a program asks for
PINS = 9  # step, direction and end switch of three drives
CLOCK = 16_000_000  # Hz, of the controller that is not there

# What a controller of three drives understands and answers, as its protocol spells it.
COMMANDS = (
    "get_config",
    "allocate_oids count=%c",
    "finalize_config crc=%u",
    "emergency_stop",
    "config_stepper oid=%c step_pin=%c dir_pin=%c invert_step=%c step_pulse_ticks=%u",
    "reset_step_clock oid=%c clock=%u",
    "set_next_step_dir oid=%c dir=%c",
    "queue_step oid=%c interval=%u count=%hu add=%hi",
    "stepper_get_position oid=%c",
    "stepper_stop_on_trigger oid=%c trsync_oid=%c",
    "config_endstop oid=%c pin=%c pull_up=%c",
    "endstop_query_state oid=%c",
    "endstop_home oid=%c clock=%u sample_ticks=%u sample_count=%c rest_ticks=%u pin_value=%c trsync_oid=%c"
    " trigger_reason=%c",
    "config_trsync oid=%c",
    "trsync_start oid=%c report_clock=%u report_ticks=%u expire_reason=%c",
    "trsync_set_timeout oid=%c clock=%u",
    "trsync_trigger oid=%c reason=%c",
)
RESPONSES = (
    "config is_config=%c crc=%u is_shutdown=%c move_count=%hu",
    "stepper_position oid=%c pos=%i",
    "endstop_state oid=%c homing=%c next_clock=%u pin_value=%c",
    "trsync_state oid=%c can_trigger=%c trigger_reason=%c clock=%u",
)

HEAD = ("SET_KINEMATIC_POSITION X=0 Y=0 Z=0", "G21", "G90")  # stands where a printer would home
FILAMENT = re.compile(r" E[-+.\d]+")
END = re.compile(r"print time ([.\d]+)s")  # what Klippy says when it has planned everything
ASK = "import klippy.printer; from importlib.metadata import version; print(version('kalico'))"


@dataclass(frozen=True, slots=True)
class Peer:
    """What stands in the row of the whole chain."""

    name: str
    cpu: float  # s, of the whole process
    note: str


def dictionary() -> str:
    """Describe the controller: its messages by number, its pins, its clock."""
    numbers = count(2)  # 0 and 1 are how a real one sends this
    return json.dumps(
        {
            "commands": dict(zip(COMMANDS, numbers, strict=False)),
            "responses": dict(zip(RESPONSES, numbers, strict=False)),
            "enumerations": {"pin": {"P0": [0, PINS]}},
            "config": {"CLOCK_FREQ": CLOCK, "STATS_SUMSQ_BASE": 256},
        }
    )


def configuration() -> str:
    """Describe the machine."""
    corner = math.sqrt(TOLERANCE * ACCELERATION / (math.sqrt(2.0) - 1.0))
    sections: dict[str, dict[str, object]] = {
        "mcu": {"serial": os.devnull},
        "force_move": {"enable_force_move": True},
        "printer": {
            "kinematics": "cartesian",
            "max_velocity": VELOCITY,
            "max_accel": ACCELERATION,
            "max_z_velocity": Z_VELOCITY,
            "max_z_accel": Z_ACCELERATION,
            "square_corner_velocity": corner,
            "minimum_cruise_ratio": 0.0,  # plain trapezoids, as ours
        },
    }
    for index, (axis, turn) in enumerate(TURN.items()):
        step, direction, switch = (f"P{3 * index + pin}" for pin in range(3))
        sections[f"stepper_{axis}"] = {
            "step_pin": step,
            "dir_pin": direction,
            "endstop_pin": switch,
            "microsteps": 16,
            "rotation_distance": turn,
            "position_endstop": 0,
            "position_max": TRAVEL,
        }
    return "\n".join(
        f"[{name}]\n" + "".join(f"{key}: {value}\n" for key, value in options.items())
        for name, options in sections.items()
    )


def accepted(blocks: Iterable[str]) -> Iterator[str]:
    """Yield the moves of a printer's program without their filament, from a place that is known."""
    moves = (FILAMENT.sub("", block) for block in blocks if block.startswith(("G0 ", "G1 ")))
    return chain(HEAD, moves)


def batch(python: str, program: Path, folder: Path, rounds: int = 1) -> tuple[Usage, float]:
    """Run Klippy on a program; what it took and how long the motion lasts, s.

    Raises
    ------
    RuntimeError
        It did not end well.
    """
    moves, machine, controller = (folder / name for name in ("moves.gcode", "printer.cfg", "controller.json"))
    with program.open(encoding="ascii") as source, moves.open("w", encoding="ascii", newline="\n") as target:
        target.writelines(f"{block}\n" for block in accepted(line.rstrip("\n") for line in source))
    machine.write_text(configuration(), encoding="ascii")
    controller.write_text(dictionary(), encoding="ascii")
    options = ["-i", str(moves), "-o", str(folder / "drives.bin"), "-d", str(controller)]
    used = best_child(rounds, [python, "-m", "klippy", str(machine), *options], folder)
    told = END.search(used.complaints)
    if told is None:
        raise RuntimeError("Klippy did not say when the motion ends")
    return used, float(told[1])


def peer(program: Path, warm: Path, folder: Path, rounds: int) -> Peer:
    """Measure Klippy on a program, after a run that compiles; without Klippy return what was recorded."""
    python = os.environ.get(VARIABLE) or sys.executable
    try:
        version = child([python, "-c", ASK], folder).output.strip()
        batch(python, warm, folder)
        used, motion = batch(python, program, folder, rounds)
    except (OSError, RuntimeError) as error:
        told = error.strerror if isinstance(error, OSError) else str(error)
        reason = (told or "it says nothing").strip().splitlines()[-1]
        note = f"Klipper's number is recorded, on another program of as many lines: {reason}"
        return Peer("Klipper (recorded)", RECORDED, note)
    note = (
        f"version {version}, three axes, E words left out; {figures(used.peak)} MB at most;"
        f" a motion of {figures(motion)} s at {figures(motion / used.cpu)} times real time"
    )
    return Peer("Kalico (Klipper fork), measured", used.cpu, note)
