# pyright: basic
"""Plain rows of a table, straight from its bytes: numbers between commas."""

from cnc_shape.kernels import kernel
from cnc_shape.kernels.decimals import decimal, skip_blanks

LINE_END, COMMA = ord("\n"), ord(",")


@kernel
def plain_rows(text, at, line, line_bytes, scales, bounds, table, lines, count):
    """Take lines of `text` (n,) bytes from `at` on, as long as they are plain or blank and there is room.

    A row has one number for each of the columns; times `scales` (c,) it lies within +-`bounds` (c,). Rows go
    to `table` (r,c) and their lines to `lines` (r,) from `count` on; `line` lines came before.

    Returns the place of the first line that was not taken, how many lines were, and the rows filled by now.
    """
    size = text.size
    columns = scales.size
    taken = 0
    while at < size and count < table.shape[0]:
        stop = skip_blanks(text, at)
        blank = stop == size or text[stop] == LINE_END
        if not blank:
            plain = True
            for column in range(columns):
                value, stop, plain = decimal(text, skip_blanks(text, stop), False, True)
                if not plain:
                    break
                value *= scales[column]
                stop = skip_blanks(text, stop)
                last = column == columns - 1
                ended = stop == size or text[stop] == LINE_END
                if ended != last or (not last and text[stop] != COMMA) or not abs(value) <= bounds[column]:
                    plain = False
                    break
                table[count, column] = value
                if not last:
                    stop += 1
            if not plain or stop - at > line_bytes:
                break
            lines[count] = line + taken + 1
            count += 1
        elif stop - at > line_bytes:
            break
        taken += 1
        at = min(stop + 1, size)
    return at, taken, count
