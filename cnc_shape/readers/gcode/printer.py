"""What only 3D printers write: slicers' M codes, macros, homing without numbers, checksums."""

from __future__ import annotations

import re

from cnc_shape.readers.gcode.lexer import NUMBER, BlockError
from cnc_shape.readers.gcode.settings import Remark

_CHECKSUM = re.compile(r"\*[0-9]+$")
_MACRO = re.compile(r"[A-Z_]{2}")
_ENDS = re.compile(r"(?:N[0-9]+)?M0*(?:2|30)$")
_CODE = re.compile(r"(?:N[0-9]+)?(M[0-9]+|T)")
_RETRACT_AND_LEVEL = re.compile(r"(?:N[0-9]+)?(G(?:10|11|12|29|34))(?![0-9.])")
_HOME = re.compile(rf"(?:N[0-9]+)?G28((?:[A-Z](?:{NUMBER})?)*)$")
_ZERO_ALL = re.compile(r"(?:N[0-9]+)?G92$")
_LIMITS = ("M201", "M203", "M204", "M205", "SET_VELOCITY_LIMIT")


def without_checksum(text: str) -> str:
    """Take the checksum of a serial line away."""
    return _CHECKSUM.sub("", text) if "*" in text else text


def is_ignored(line: str, remark: Remark) -> bool:
    """Whether a line moves nothing: noted once per code; its arguments may be any text."""
    head = line.partition(";")[0].upper()
    text = head.replace(" ", "").replace("\t", "")
    if not text or _ENDS.match(text):
        return False
    if _MACRO.match(text):
        name = head.split()[0]
    elif found := _CODE.match(text) or _RETRACT_AND_LEVEL.match(text):
        name = found[1]
    else:
        return False
    if name in _LIMITS:
        remark("limits", f"{name}: limits set by the program are not applied yet")
    elif name == "T":
        remark("T", "tool changes of a printer are ignored")
    else:
        remark(name, f"{name} is ignored: it does not move the axes")
    return True


def home_axes(text: str) -> tuple[int, ...] | None:
    """Axes that a ``G28`` sends to zero, None if the line is no G28; axis letters select, none means all."""
    if "G28" not in text:
        return None
    found = _HOME.match(text)
    if found is None:
        raise BlockError("G28 stands alone on its line", hint="give axis letters only", letter="G28")
    chosen = tuple(axis for axis, letter in enumerate("XYZ") if letter in found[1])
    return chosen or (0, 1, 2)


def zeroes_all(text: str) -> bool:
    """Whether the line is a ``G92`` without words: the present point becomes zero on every axis."""
    return _ZERO_ALL.match(text) is not None
