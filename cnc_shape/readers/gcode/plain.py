"""The quick way: a line that is one straight move and nothing else, in one match."""

from __future__ import annotations

import re
from math import inf

from cnc_shape.program import Motion
from cnc_shape.readers.gcode.codes import FEED, PER_MINUTE, RAPID
from cnc_shape.readers.gcode.modal import Modal
from cnc_shape.readers.gcode.rows import PER_TIME, Rows
from cnc_shape.readers.gcode.settings import SLOWEST
from cnc_shape.units import PER_MIN

_NUMBER = r"([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))"
_PLAIN_MOVE = re.compile(
    rf"(?:G0?([01]))?(?:F([0-9]+\.?[0-9]*))?(?:X{_NUMBER})?(?:Y{_NUMBER})?(?:Z{_NUMBER})?(?:A{_NUMBER})?"
    rf"(?:E{_NUMBER})?(?:F([0-9]+\.?[0-9]*))?"
)
_RAPID, _FEED = int(Motion.RAPID), int(Motion.FEED)


def take_plain_move(line: str, number: int, modal: Modal, rows: Rows, printer: bool, limit: float) -> bool:
    """Carry out `line` if it is a plain straight move; otherwise leave everything as it is.

    Parameters
    ----------
    line, number
        The text as it stands in the file, and its number.
    modal, rows
        Updated if the answer is true.
    printer
        Whether E words are allowed and G0 runs at its F.
    limit
        Of the coordinates, mm and degrees.
    """
    match = _PLAIN_MOVE.fullmatch(line.replace(" ", ""))
    if match is None or not modal.absolute or modal.feed_mode != PER_MINUTE or modal.diameter:
        return False
    code, early_feed, x, y, z, a, e, late_feed = match.groups()
    motion = modal.motion if code is None else RAPID if code == "0" else FEED
    if (motion != FEED and motion != RAPID) or (e is not None and not printer):
        return False
    scale, offset = modal.millimetres, modal.offset
    feed, angular = modal.feed, modal.feed_angular
    if early_feed is not None or late_feed is not None:
        if early_feed is not None and late_feed is not None:
            return False
        angular = float(early_feed or late_feed)  # pyright: ignore[reportArgumentType]  # one of them is there
        feed = angular * scale
        if not SLOWEST <= angular < limit:
            return False
    if x is None and y is None and z is None and a is None and e is None:
        return False
    if motion == FEED and feed == 0.0:
        return False
    end = modal.position.copy()
    if x is not None:
        end[0] = float(x) * scale + offset[0]
    if y is not None:
        end[1] = float(y) * scale + offset[1]
    if z is not None:
        end[2] = float(z) * scale + offset[2]
    if a is not None:
        end[3] = float(a) + offset[3]
    if max(end) > limit or min(end) < -limit:
        return False
    modal.motion, modal.feed, modal.feed_angular, modal.position = motion, feed, angular, end
    fast = motion == RAPID and not (printer and feed > 0.0)
    rows.rows.append(
        (
            _RAPID if motion == RAPID else _FEED,
            number,
            end[0],
            end[1],
            end[2],
            end[3],
            end[4],
            end[5],
            inf if fast else feed * PER_MIN,
            inf if fast else angular * PER_MIN,
            PER_TIME,
            0.0,
            modal.path_mode,
            modal.path_tolerance,
            modal.merge_tolerance,
        )
    )
    return True
