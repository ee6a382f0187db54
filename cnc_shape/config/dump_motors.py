"""Servo motors, what their controllers do about loads, and the loads, as keys of a machine file.

What has its default is left out, unless it is what one would look for.
"""

from __future__ import annotations

from typing import Any

from cnc_shape.config.spelling import to_degrees, to_micrometres
from cnc_shape.controllers import (
    Control,
    FrictionFeedforward,
    GainLaw,
    InertiaCompensation,
    InertiaIdentification,
)
from cnc_shape.disturbances import (
    Disturbances,
    LoadTorque,
    PathDirection,
    Profile,
    ProfileTable,
    Pulses,
    SineBurst,
)
from cnc_shape.machine import ServoMotor
from cnc_shape.program import ROTARY

Keys = dict[str, Any]


def motor_keys(motor: ServoMotor, moved: str) -> Keys:
    """Return the drive that moves the axis or joint called `moved`."""
    lead = (
        {"lead_deg_per_rev": to_degrees(motor.lead)} if moved in ROTARY else {"lead_mm_per_rev": motor.lead}
    )
    loop = motor.velocity_loop
    return {
        "type": "servo_motor",
        "inertia_kg_m2": motor.inertia,
        **_given(nominal_inertia_kg_m2=motor.nominal_inertia),
        "torque_limit_nm": motor.torque_limit,
        "viscous_nm_s": motor.viscous,
        "coulomb_nm": motor.coulomb,
        "current_time_constant_s": motor.current_time_constant,
        **lead,
        **_given(encoder_counts_per_rev=motor.encoder_counts or None),
        "velocity_loop": {
            "bandwidth_rad_s": loop.bandwidth,
            "integral_time_s": loop.integral_time,
            "sample_time_s": loop.sample_time,
        },
    }


def compensation_keys(control: Control) -> Keys:
    """Return the terms of the loop that act on servo motors."""
    keys: Keys = {}
    if watch := control.disturbance_observer:
        keys["disturbance_observer"] = {"bandwidth_rad_s": watch.bandwidth, "feedforward": watch.feedforward}
    if control.inertia_compensation:
        keys["inertia_compensation"] = _compensation(control.inertia_compensation)
    if control.friction_feedforward:
        keys["friction_feedforward"] = _friction(control.friction_feedforward)
    if control.inertia_identification:
        keys["inertia_identification"] = _identification(control.inertia_identification)
    return keys


def disturbance_list(disturbances: Disturbances) -> list[Keys]:
    """Return all that disturbs a machine."""
    items = [_load(load) for load in disturbances.loads]
    if noise := disturbances.noise:
        items.append(
            {
                "type": "encoder_noise",
                "standard_deviation_counts": noise.standard_deviation,
                "seed": noise.seed,
            }
        )
    return items


def _given(**keys: object) -> Keys:
    return {key: value for key, value in keys.items() if value is not None}


def _compensation(term: InertiaCompensation) -> Keys:
    keys: Keys = {
        "max_gain_ratio": term.max_gain_ratio,
        **_given(deadband_nm=term.deadband, regularisation_rad_s2=term.regularisation),
        "window_s": term.window,
        "attack_s": term.attack,
        "release_s": term.release,
        "forgetting": term.forgetting,
        "law": term.law.name.lower(),
        "scale_integral_time": term.scale_integral_time,
    }
    if term.law is GainLaw.TRIGGERED or term.threshold != InertiaCompensation().threshold:
        keys["threshold_um"] = to_micrometres(term.threshold)
    if term.torque_speed_slope != InertiaCompensation().torque_speed_slope:
        keys["torque_speed_slope_rad_s_nm"] = term.torque_speed_slope
    return keys


def _friction(term: FrictionFeedforward) -> Keys:
    return {"coulomb": term.coulomb, "viscous": term.viscous}


def _identification(term: InertiaIdentification) -> Keys:
    return {
        "forgetting_time_s": term.forgetting_time,
        "excitation_rad_s2": term.excitation,
        "smallest_ratio": term.smallest,
        "largest_ratio": term.largest,
    }


def _load(load: LoadTorque) -> Keys:
    direction = load.direction
    word = direction.value if isinstance(direction, PathDirection) else direction
    keys: Keys = {"type": "load_torque", "direction": word}
    if isinstance(load.profile, ProfileTable):
        return keys | _table(load.profile, load.peak)
    return {**keys, "peak_nm": load.peak, "profile": _profile(load.profile)}


def _table(table: ProfileTable, peak: float) -> Keys:
    """Torques as they are, or a peak and what its reader scales to it."""
    scaled = peak != 1.0 and max(map(abs, table.levels), default=0.0) == 1.0
    torques = list(table.levels) if scaled or peak == 1.0 else [peak * level for level in table.levels]
    profile = {"type": "table", "times_s": list(table.times), "torques_nm": torques}
    return {**_given(peak_nm=peak if scaled else None), "profile": profile}


def _profile(profile: Profile) -> Keys:
    if isinstance(profile, SineBurst):
        return {
            "type": "sine_burst",
            "frequency_hz": profile.frequency,
            "length_s": profile.length,
            "centre_s": profile.centre,
        }
    if isinstance(profile, Pulses):
        return {
            "type": "pulses",
            "start_s": profile.start,
            "rise_s": profile.rise,
            "hold_s": profile.hold,
            "gap_s": profile.gap,
            "peaks": list(profile.peaks),
        }
    return {"type": "steps", "times_s": list(profile.times), "levels": list(profile.levels)}
