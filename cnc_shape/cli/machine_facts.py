"""What ``cnc-shape check`` says of a machine file, for the eye."""

from __future__ import annotations

from typing import Any


def machine_facts(result: dict[str, Any]) -> list[tuple[str, str]]:
    """Names and values of the table."""
    modes = ", ".join(f"{axis.upper()} {count}" for axis, count in result["modes"].items())
    shapers = ", ".join(f"{axis.upper()} {entry['type']}" for axis, entry in result["shapers"].items())
    kinds: dict[str, list[str]] = {}
    for joint, drive in result["joints"].items():
        kinds.setdefault(drive, []).append(joint)
    joints = ", ".join(f"{' '.join(names)} {drive}" for drive, names in kinds.items())
    return [
        ("machine", result["name"]),
        ("kinematics", result["kinematics"]),
        ("joints", joints),
        ("modes", modes or "none"),
        *(("", f"{mode['axis'].upper()}: {mode['summary']}") for mode in result["position_modes"]),
        ("shapers", shapers or "none"),
        ("loop", _loop(result["loop"])),
        *([("velocity loops", told)] if (told := _velocity_loops(result["loop"])) else []),
        *([("motors", ", ".join(result["motor_terms"]))] if result["motor_terms"] else []),
        *(
            [("disturbed", "; ".join(map(_disturbance, result["disturbances"])))]
            if result["disturbances"]
            else []
        ),
    ]


def _loop(loop: dict[str, float | None]) -> str:
    """Say the margins of a loop in one line."""
    if loop["max_sensitivity"] is None:
        return "none"
    told = {
        "gain margin {:.3g}": loop["gain_margin"],
        "phase margin {:.3g}°": loop["phase_margin_deg"],
        "Ms {:.3g}": loop["max_sensitivity"],
        "cross-coupling stable below {:.4g} 1/s": loop["largest_stable_cross_coupling_per_s"],
    }
    return _told(told)


def _velocity_loops(loop: dict[str, float | None]) -> str:
    """Say the margins of servo motors' velocity loops in one line."""
    return _told(
        {
            "gain margin {:.3g} dB": loop["velocity_loop_gain_margin_db"],
            "phase margin {:.3g}°": loop["velocity_loop_phase_margin_deg"],
            "Ms {:.3g}": loop["velocity_loop_max_sensitivity"],
        }
    )


def _told(numbers: dict[str, float | None]) -> str:
    return ", ".join(text.format(number) for text, number in numbers.items() if number is not None)


def _disturbance(entry: dict[str, Any]) -> str:
    if entry["type"] == "encoder_noise":
        return f"encoder_noise {entry['standard_deviation_counts']:g} counts"
    return f"{entry['direction']} {entry['largest_torque_nm']:g} N m {entry['profile']}"
