# pyright: basic
"""Plain lines of a program, straight from its bytes: straight moves, and lines that only set a feed."""

import numpy as np

from cnc_shape.kernels import kernel
from cnc_shape.kernels.decimals import decimal

NUL, LINE_END, LEFT_PARENTHESIS, RIGHT_PARENTHESIS = 0, ord("\n"), ord("("), ord(")")
# what a byte may be
FOREIGN, BLANK, REMARK, OPENING, FIRST_WORD = 0, 1, 2, 3, 4
# words, counted from FIRST_WORD: six axes, then
AXES, MOTION_WORD, FEED_WORD, SPEED_WORD, FILAMENT_WORD, NUMBER_WORD, WORDS = 6, 6, 7, 8, 9, 10, 11
# registers
MOTION, FEED, ANGULAR, SPEED = 0, 1, 2, 3
NO_MOTION, RAPID, STRAIGHT, CURVED = -1.0, 0.0, 1.0, 2.0  # of the register MOTION


@kernel
def words_of(text, at, roles, largest, present, value):
    """Read the words of one line into `present` and `value`, (WORDS,) each.

    Returns the place of the line's end, how many words there are, and whether all of it is plain.
    """
    size = text.size
    count = 0
    for word in range(WORDS):
        present[word] = False
    while at < size and text[at] != LINE_END:
        role = roles[text[at]]
        if role >= FIRST_WORD:
            word = role - FIRST_WORD
            if present[word] or (word == NUMBER_WORD and count > 0):
                return at, count, False
            number, at, good = decimal(text, at + 1, True, False)
            if not good or not -largest < number < largest:
                return at, count, False
            present[word] = True
            value[word] = number
            count += 1
        elif role == BLANK:
            at += 1
        elif role == REMARK:
            while at < size and text[at] != LINE_END:
                if text[at] == NUL:
                    return at, count, False
                at += 1
        elif role == OPENING:
            at += 1
            while at < size and text[at] != RIGHT_PARENTHESIS:
                if text[at] == LINE_END or text[at] == LEFT_PARENTHESIS or text[at] == NUL:
                    return at, count, False
                at += 1
            if at == size:
                return at, count, False
            at += 1
        else:
            return at, count, False
    return at, count, True


@kernel
def plain_moves(text, at, line, roles, modes, registers, position, offset, columns, count, rows, blocks):
    """Take lines of `text` (n,) bytes from `at` on, as long as they are plain and there is room.

    A line is plain if it holds words of the axes, G0 or G1, F, S, E and N alone, each at most once, and
    comments; and if nothing about it has to be refused. `roles` (256,) says what each byte is. `registers`
    (4,) and `position` (6,) mm and degrees are updated; `columns` are filled from row `count` on, up to
    `rows` rows; no more than `blocks` lines with words are taken.

    Returns the place of the first line that was not taken, how many lines were, the rows filled by now, and
    the lines with words among those taken.
    """
    size = text.size
    present = np.zeros(WORDS, dtype=np.bool_)
    value = np.zeros(WORDS)
    end = np.zeros(AXES)
    taken = 0
    executed = 0
    while at < size and count < rows and executed < blocks:
        stop, words, plain = words_of(text, at, roles, modes.largest, present, value)
        if not plain or stop - at > modes.line_bytes:
            break
        motion = registers[MOTION]
        if present[MOTION_WORD]:
            motion = value[MOTION_WORD]
            if motion != RAPID and motion != STRAIGHT:
                break
        feed = registers[FEED]
        angular = registers[ANGULAR]
        if present[FEED_WORD]:
            angular = value[FEED_WORD]
            feed = angular if modes.per_move else angular * modes.millimetres
        if (
            (present[FEED_WORD] and value[FEED_WORD] < modes.slowest)
            or (present[SPEED_WORD] and value[SPEED_WORD] < 0.0)
            or (present[NUMBER_WORD] and value[NUMBER_WORD] < 0.0)
            or (present[FILAMENT_WORD] and not modes.printer)
        ):
            break
        travels = present[FILAMENT_WORD]
        beyond = False
        for axis in range(AXES):
            end[axis] = position[axis]
            if present[axis]:
                travels = True
                step = value[axis] * modes.millimetres if axis < 3 else value[axis]
                end[axis] = step + offset[axis] if modes.absolute else end[axis] + step
                beyond = beyond or not -modes.coordinate <= end[axis] <= modes.coordinate
        fed = present[FEED_WORD] if modes.per_move else feed > 0.0
        if travels and (beyond or not (motion == RAPID or (motion == STRAIGHT and fed))):
            break
        registers[MOTION] = motion
        registers[FEED] = feed
        registers[ANGULAR] = angular
        if present[SPEED_WORD]:
            registers[SPEED] = value[SPEED_WORD]
        if words > 0:
            executed += 1
        if travels:
            fast = motion == RAPID and not (modes.printer and feed > 0.0)
            columns.motion[count] = int(motion)
            columns.line[count] = line + taken + 1
            for axis in range(AXES):
                position[axis] = end[axis]
                columns.target[count, axis] = end[axis]
            columns.feed[count] = np.inf if fast else feed * modes.per_second
            columns.angular[count] = np.inf if fast else angular * modes.per_second
            columns.per_move[count] = modes.per_move and motion == STRAIGHT
            columns.dwell[count] = 0.0
            columns.path_mode[count] = modes.path_mode
            columns.path_tolerance[count] = modes.path_tolerance
            columns.merge_tolerance[count] = modes.merge_tolerance
            count += 1
        taken += 1
        at = min(stop + 1, size)
    return at, taken, count, executed
