"""Check of a machine file: what it says, in numbers."""

from __future__ import annotations

from pathlib import Path

from cnc_shape.config.complaints import locate
from cnc_shape.config.control import MOTOR_TERMS
from cnc_shape.config.loop_check import check_loop
from cnc_shape.config.machine_file import read_content, read_machine
from cnc_shape.config.position_notes import position_facts
from cnc_shape.config.yaml_tree import refuse
from cnc_shape.disturbances import (
    EncoderNoise,
    LoadTorque,
    PathDirection,
    ProfileTable,
    Pulses,
    SineBurst,
    Steps,
)
from cnc_shape.errors import InfeasibleError
from cnc_shape.joints import joints_of
from cnc_shape.machine import FirstOrderLag, IdealDrive, ServoMotor

DRIVES = {IdealDrive: "ideal", FirstOrderLag: "first_order_lag", ServoMotor: "servo_motor"}
PROFILES = {SineBurst: "sine_burst", Pulses: "pulses", Steps: "steps", ProfileTable: "table"}


def check_machine(path: Path | str) -> dict[str, object]:
    """Read a machine file and return what it describes, ready for JSON.

    A loop that would oscillate without end is refused here, before anybody simulates it.

    Raises
    ------
    ConfigError
        As `load_machine`, or an unstable loop.
    """
    source, data = read_content(path)
    setup, notes, tree = read_machine(data, source)
    joints = joints_of(setup.machine, setup.kinematics)
    try:
        loop = check_loop(setup)
    except InfeasibleError as error:
        refuse(source, locate(tree, ("control",))[0], f"control: {error.reason}", error.hint)
    return {
        "file": source,
        "dialect": "machine",
        "name": setup.machine.name,
        "kinematics": setup.kinematics.name,
        "joints": {drive.name: DRIVES[type(drive.drive)] for drive in joints.drives},
        "axes": [axis.name for axis in setup.machine.axes],
        "modes": {axis.name: len(axis.modes) for axis in setup.machine.axes},
        "position_modes": position_facts(setup),
        "shapers": {
            name: {"type": setup.choices[name].type, "duration_s": shaper.duration, "delay_s": shaper.delay}
            for name, shaper in setup.shapers.items()
        },
        "sample_time_s": setup.control.sample_time,
        "loop": loop,
        "motor_terms": [term for term in MOTOR_TERMS if getattr(setup.control, term) is not None],
        "disturbances": [*map(_load, setup.disturbances.loads), *_noise(setup.disturbances.noise)],
        "tools": len(setup.tools),
        "warnings": [{"line": note.line, "message": note.message} for note in notes],
    }


def _load(load: LoadTorque) -> dict[str, object]:
    direction, profile = load.direction, load.profile
    levels: tuple[float, ...] = (1.0,)
    if isinstance(profile, Pulses):
        levels = profile.peaks
    elif isinstance(profile, Steps | ProfileTable):
        levels = profile.levels
    return {
        "type": "load_torque",
        "direction": direction.value if isinstance(direction, PathDirection) else direction,
        "largest_torque_nm": abs(load.peak) * max(map(abs, levels)),
        "profile": PROFILES[type(profile)],
    }


def _noise(noise: EncoderNoise | None) -> list[dict[str, object]]:
    if noise is None:
        return []
    return [{"type": "encoder_noise", "standard_deviation_counts": noise.standard_deviation}]
