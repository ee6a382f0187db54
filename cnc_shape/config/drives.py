"""Drive keys of a machine file -> Drive: the lead in the unit of what it moves, loops that tick together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from cnc_shape.config.complaints import KeyPath, refuse_at, refuse_key_at
from cnc_shape.config.drive_models import AnyDrive, FirstOrderLagModel, ServoMotorModel
from cnc_shape.config.yaml_tree import Tree, dotted
from cnc_shape.machine import Drive, FirstOrderLag, IdealDrive, Machine, ServoMotor, VelocityLoop
from cnc_shape.program import ROTARY
from cnc_shape.units import DEGREE

MOST_TICKS: Final = 1000  # of a velocity loop in one sample
TICK_TOLERANCE: Final = 1e-9  # -, by which a sample may miss whole ticks: decimals are no binary fractions

Drives = Mapping[KeyPath, Drive]  # by where they stand in the file

NO_MOTOR: Final = "acts on servo motors, and the machine has none"
GIVE_A_MOTOR: Final = "give a drive {type: servo_motor, ..}, or remove this"


def drive_of(source: str, tree: Tree, path: KeyPath, model: AnyDrive | None, moved: str) -> Drive:
    """Return the drive at `path`, which moves the axis or joint called `moved`; none is an ideal one.

    Raises
    ------
    ConfigError
        A motor without a lead, with the lead of another kind of axis, or with more friction than torque.
    """
    if isinstance(model, FirstOrderLagModel):
        return FirstOrderLag(model.time_constant_s, model.gain)
    if isinstance(model, ServoMotorModel):
        return _motor(source, tree, path, model, moved)
    return IdealDrive()


def motors_of(machine: Machine) -> tuple[ServoMotor, ...]:
    """The servo motors of a machine, of joints or axes."""
    drives = (*machine.joints, *(axis.drive for axis in machine.axes))
    return tuple(drive for drive in drives if isinstance(drive, ServoMotor))


def check_ticks(source: str, tree: Tree, drives: Drives, sample_time: float) -> None:
    """Refuse velocity loops that do not tick together, a whole number of times in every sample.

    Raises
    ------
    ConfigError
        At the sample time of the first loop that does not.
    """
    motors = [(path, drive) for path, drive in drives.items() if isinstance(drive, ServoMotor)]
    for path, motor in motors:
        tick, first = motor.velocity_loop.sample_time, motors[0][1].velocity_loop.sample_time
        ticks, own = sample_time / tick, (*path, "velocity_loop", "sample_time_s")
        if abs(ticks - round(ticks)) > TICK_TOLERANCE * ticks or round(ticks) < 1:
            reason = f"the sample time of {sample_time:g} s is not a whole number of ticks of {tick:g} s"
            hint = "make control.sample_time_s a multiple of velocity_loop.sample_time_s"
            refuse_at(source, tree, own, reason, hint)
        if ticks > MOST_TICKS:
            reason = f"{round(ticks)} ticks of {tick:g} s in a sample of {sample_time:g} s"
            refuse_at(source, tree, own, reason, f"have at most {MOST_TICKS}")
        if tick != first:
            reason = f"ticks every {tick:g} s, that of {dotted(motors[0][0])} every {first:g} s"
            refuse_at(source, tree, own, reason, "give all motors the same sample time")


def _motor(source: str, tree: Tree, path: KeyPath, model: ServoMotorModel, moved: str) -> ServoMotor:
    if model.coulomb_nm >= model.torque_limit_nm:
        reason = (
            f"friction of {model.coulomb_nm:g} N m holds a motor of {model.torque_limit_nm:g} N m for ever"
        )
        refuse_at(source, tree, (*path, "coulomb_nm"), reason, "check both, and their units")
    loop = model.velocity_loop
    return ServoMotor(
        inertia=model.inertia_kg_m2,
        torque_limit=model.torque_limit_nm,
        lead=_lead(source, tree, path, model, moved),
        viscous=model.viscous_nm_s,
        coulomb=model.coulomb_nm,
        current_time_constant=model.current_time_constant_s,
        encoder_counts=model.encoder_counts_per_rev,
        velocity_loop=VelocityLoop(loop.bandwidth_rad_s, loop.integral_time_s, loop.sample_time_s),
        nominal_inertia=model.nominal_inertia_kg_m2,
    )


def _lead(source: str, tree: Tree, path: KeyPath, model: ServoMotorModel, moved: str) -> float:
    """Lead in mm or rad a revolution."""
    keys = {"lead_mm_per_rev": model.lead_mm_per_rev, "lead_deg_per_rev": model.lead_deg_per_rev}
    wanted, other = list(keys)[:: -1 if moved in ROTARY else 1]
    if keys[other] is not None:
        unit = "degrees" if moved in ROTARY else "mm"
        refuse_key_at(source, tree, (*path, other), f"{moved} moves in {unit}", f"give {wanted}")
    lead = keys[wanted]
    if lead is None:
        refuse_at(source, tree, path, f"{wanted} is missing", f"add {wanted}: with its value")
    return lead * (DEGREE if moved in ROTARY else 1.0)
