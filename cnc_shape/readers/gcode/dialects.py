"""Dialects of G-code, and a first look over a text that says which one it is written in."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum

from cnc_shape.program import ROTARY, XYZ
from cnc_shape.readers.source import Source, blocks, count_lines


class Dialect(Enum):
    """Whose rules a program follows."""

    RS274 = "rs274"
    GRBL = "grbl"
    MARLIN = "marlin"
    FANUC = "fanuc"


@dataclass(frozen=True, slots=True)
class Survey:
    """What a first look over the text tells before anything is interpreted."""

    dialect: Dialect
    evidence: str  # why this dialect
    axes: tuple[str, ...]  # x, y, z and the rotary axes whose letters occur as words
    lines: int


_COMMENT = re.compile(rb"\([^()\n]*\)|;[^\n]*")
_SLICERS = re.compile(
    rb"(?im)^[ \t]*;[^\n]*(?:prusaslicer|superslicer|orcaslicer|bambustudio|slic3r|cura_steamengine"
    rb"|simplify3d|ideamaker|kisslicer|kiri:moto|flavor:[ \t]*(?:marlin|reprap|klipper)|header_block_start)"
)
_PRINTER_CODES = re.compile(
    rb"(?im)^[ \t]*(?:N[ \t]*[0-9]+[ \t]*)?(M0*(?:8[23]|104|109|140|190|20[1-5])(?![0-9.])|SET_[A-Z_]+)"
)
_GRBL_SETTING = re.compile(rb"(?m)^[ \t]*\$")
_FANUC_HEAD = re.compile(rb"(?i)\A\s*%[^\n]*\s*[O:][ \t]*[0-9]+[ \t]*(?:\([^\n]*)?(?:\n|\Z)")
_ROTARY_WORD = {
    axis: re.compile(rb"(?m)(?:^|[^A-Z_<])%s[ \t]*[-+.0-9\[#]" % axis.upper().encode()) for axis in ROTARY
}
_ROTARY_MOVE = {  # the same on lines that do not begin with a printer's M code or macro
    axis: re.compile(
        rb"(?m)^(?![ \t]*(?:M[0-9]|[A-Z_]{2}))(?:[^\n]*?[^A-Z_<\n])??%s[ \t]*[-+.0-9]" % axis.upper().encode()
    )
    for axis in ROTARY
}


def survey(source: Source, dialect: Dialect | None) -> Survey:
    """Look over `source` once; `dialect` None decides it on evidence.

    The printers' dialect follows from a slicer's header or from codes that only printers have, never
    from E words alone; Fanuc's from a ``%`` followed by ``O1234``; grbl's from a line that starts with ``$``.
    """
    head = b""
    printer = None
    setting = False
    count = 0
    words_seen, moves_seen = set[str](), set[str]()
    for block in blocks(source):
        head = head or block[: 1 << 16]
        count += count_lines(block)
        words = _COMMENT.sub(b" ", block) if b"(" in block or b";" in block else block
        words = words.upper()
        # a search for one byte is far quicker than one for a pattern, and most answers are no
        if b"M" in words or b"SET_" in words:
            printer = printer or _PRINTER_CODES.search(words)
        if b"$" in words:
            setting = setting or _GRBL_SETTING.search(words) is not None
        letters = {axis for axis in ROTARY if axis.upper().encode() in words}
        words_seen |= {axis for axis in letters - words_seen if _ROTARY_WORD[axis].search(words)}
        moves_seen |= {axis for axis in letters & words_seen - moves_seen if _ROTARY_MOVE[axis].search(words)}
    if dialect is None:
        dialect, evidence = _judge(head, printer, setting)
    else:
        evidence = "as asked for"
    rotary = moves_seen if dialect is Dialect.MARLIN else words_seen
    return Survey(dialect, evidence, XYZ + tuple(axis for axis in ROTARY if axis in rotary), count)


def _judge(head: bytes, printer: re.Match[bytes] | None, setting: bool) -> tuple[Dialect, str]:
    if _SLICERS.search(head):
        return Dialect.MARLIN, "a slicer's header comment"
    if printer is not None:
        return Dialect.MARLIN, f"the printer code {printer[1].decode('ascii', 'replace').upper()}"
    if _FANUC_HEAD.match(head):
        return Dialect.FANUC, "a program number after %"
    if setting:
        return Dialect.GRBL, "a line that starts with $"
    return Dialect.RS274, "no evidence of another dialect"
