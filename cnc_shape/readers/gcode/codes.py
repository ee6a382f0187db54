"""The codes of the language: which exist, which exclude each other, which are not built yet.

A G code is known by ten times its number: G5.1 is 51. Codes of one modal group exclude each other on a
line. The groups follow the RS274/NGC interpreter, version 3 (Kramer, Proctor, Messina, NISTIR 6556), table 4.
"""

from __future__ import annotations

RAPID, FEED, ARC_CW, ARC_CCW, DWELL = 0, 10, 20, 30, 40
DIAMETER, RADIUS = 70, 80
PLANE_XY, PLANE_ZX, PLANE_YZ = 170, 180, 190
INCH, MILLIMETRE = 200, 210
HOME = 280
COMPENSATION_OFF = 400
TOOL_LENGTH, TOOL_LENGTH_DYNAMIC, TOOL_LENGTH_ADD, TOOL_LENGTH_OFF = 430, 431, 432, 490
MACHINE_FRAME = 530
EXACT_PATH, EXACT_STOP, BLEND = 610, 611, 640
CANCEL_MOTION = 800
ABSOLUTE, INCREMENTAL, ARC_ABSOLUTE, ARC_INCREMENTAL = 900, 910, 901, 911
SET_POSITION, CLEAR_POSITION, SUSPEND_POSITION, RESTORE_POSITION = 920, 921, 922, 923
INVERSE_TIME, PER_MINUTE, PER_REVOLUTION = 930, 940, 950
SMOOTHNESS = 1870  # G187 of Haas

MOTION_GROUP, NON_MODAL = "motion", "non-modal"

_GROUPS: dict[str, tuple[int, ...]] = {
    MOTION_GROUP: (RAPID, FEED, ARC_CW, ARC_CCW, CANCEL_MOTION),
    NON_MODAL: (
        DWELL, HOME, MACHINE_FRAME, SMOOTHNESS,
        SET_POSITION, CLEAR_POSITION, SUSPEND_POSITION, RESTORE_POSITION,
    ),
    "plane": (PLANE_XY, PLANE_ZX, PLANE_YZ),
    "distance": (ABSOLUTE, INCREMENTAL),
    "arc centre": (ARC_ABSOLUTE, ARC_INCREMENTAL),
    "feed mode": (INVERSE_TIME, PER_MINUTE, PER_REVOLUTION),
    "units": (INCH, MILLIMETRE),
    "compensation": (COMPENSATION_OFF,),
    "tool length": (TOOL_LENGTH, TOOL_LENGTH_DYNAMIC, TOOL_LENGTH_ADD, TOOL_LENGTH_OFF),
    "return": (980, 990),
    "coordinate system": (540,),
    "path": (EXACT_PATH, EXACT_STOP, BLEND),
    "spindle mode": (970,),
    "lathe": (DIAMETER, RADIUS),
}  # fmt: skip
GROUP_OF = {code: group for group, codes in _GROUPS.items() for code in codes}

_SPLINES = "splines"
_OFFSETS = "coordinate systems G55 to G59.3"
_LATHE = "threading cycles"
_CYCLES = "canned drilling cycles"
_PROBING = "probing"
_COMPENSATION = "cutter compensation"
NOT_YET: dict[int, tuple[str, str]] = {
    **dict.fromkeys((50, 51, 52, 53), (_SPLINES, "approximate the curve by lines and arcs")),
    **dict.fromkeys((550, 560, 570, 580, 590, 591, 592, 593), (_OFFSETS, "use G54 alone")),
    **dict.fromkeys((330, 331, 760), (_LATHE, "expand the cycle into G1 moves")),
    **dict.fromkeys((730, *range(810, 900, 10)), (_CYCLES, "expand the cycle into G0 and G1 moves")),
    **dict.fromkeys((382, 383, 384, 385), (_PROBING, "replace the probing move by G1")),
    **dict.fromkeys((410, 411, 420, 421), (_COMPENSATION, "program the path of the tool's centre")),
    100: ("setting offsets", "use G54 without offsets"),
    280: ("homing", "replace it by G0 to the point"),
    281: ("storing the home point", "take it away"),
    300: ("homing", "replace it by G0 to the point"),
    301: ("storing the second home point", "take it away"),
    520: ("local offsets", "use G92"),
    960: ("constant surface speed", "give the spindle speed with G97 S"),
    **dict.fromkeys((171, 181, 191), ("planes of U, V and W", "use G17, G18 or G19")),
}
REFUSED: dict[int, tuple[str, str]] = dict.fromkeys(
    (700, 710, 711, 712, 720, 721, 722),
    ("lathe profile cycles (G70 to G72) are not supported", "expand the cycle"),
)

PROGRAM_STOPS, PROGRAM_ENDS = (0, 1, 60), (2, 30)
CHANGE_TOOL, SET_TOOL = 6, 61
_STOPS = "program stops"
_SPINDLE = "spindle and coolant"
_OVERRIDES = "feed and speed overrides"
_OUTPUTS = "digital and analogue outputs"
_USER = "user-defined M codes"
IGNORED: dict[int, str] = {
    **dict.fromkeys(PROGRAM_STOPS, _STOPS),
    **dict.fromkeys((3, 4, 5, 7, 8, 9, 19), _SPINDLE),
    **dict.fromkeys((48, 49, 50, 51, 52, 53), _OVERRIDES),
    **dict.fromkeys((62, 63, 64, 65, 66, 67, 68), _OUTPUTS),
    **dict.fromkeys(range(100, 200), _USER),
    **dict.fromkeys((428, 429, 430), "kinematics switches"),
}
M_NOT_YET: dict[int, tuple[str, str]] = {
    **dict.fromkeys((70, 71, 72, 73), ("saving the modal state", "write the modes out")),
    **dict.fromkeys((97, 98, 99), ("subroutines", "unroll the program")),
}
M_WORDS: dict[int, str] = {  # words that belong to an M code
    19: "PQR",
    **dict.fromkeys((50, 51, 52, 53, 62, 63, 64, 65), "P"),
    66: "PELQ",
    **dict.fromkeys((67, 68), "EQ"),
    **dict.fromkeys(range(100, 200), "PQ"),
}
_M_GROUPS = (
    (0, 1, 2, 30, 60, 99), (6, 61), (3, 4, 5, 19), (7, 8), (9,), (48, 49), (62, 63, 64, 65, 66, 67, 68),
)  # fmt: skip
M_GROUP_OF = {code: group for group, codes in enumerate(_M_GROUPS) for code in codes}


def name_of(code: int) -> str:
    """Return the code as one writes it: 51 is G5.1."""
    whole, tenth = divmod(code, 10)
    return f"G{whole}.{tenth}" if tenth else f"G{whole}"
