# pyright: basic
"""Decimal numbers in bytes of text, to the nearest float64: bit for bit what ``float()`` says.

A number of up to 18 significant digits is a whole number m over a power of ten. Where m has at most 53 bits
and the power is at most 10^22, both are floats without error, and one division rounds right (W. D. Clinger,
How to read floating point numbers accurately, PLDI 1990, doi:10.1145/93542.93557). A longer m is divided bit
by bit, until 54 bits and the remainder tell which way to round. What is neither is left to ``float()``.
"""

import numpy as np

from cnc_shape.kernels import kernel

POWERS = np.array([float(f"1e{power}") for power in range(23)])  # exact
WHOLE_POWERS = np.array([10**power for power in range(19)], dtype=np.int64)
MOST = 10**17  # a whole number below it takes one digit more
TAB, SPACE, PLUS, MINUS, POINT, ZERO, NINE = (ord(sign) for sign in "\t +-.09")
CAPITAL_E, SMALL_E = ord("E"), ord("e")
EXACT = 1 << 53  # whole numbers up to it are floats; the 54th bit from below
LARGEST_EXPONENT = 9999


@kernel
def quotient(whole, power):
    """Divide ``whole / 10**power`` and round once, to the nearest, ties to even.

    whole above 2**53, power up to 18, the quotient below 2**53.
    """
    divisor = WHOLE_POWERS[power]
    bits = whole // divisor
    rest = whole % divisor
    exponent = 0
    while bits < EXACT:  # 54 bits: one more than a float holds
        rest *= 2
        bits *= 2
        if rest >= divisor:
            rest -= divisor
            bits += 1
        exponent += 1
    half = bits % 2
    bits //= 2
    if half == 1 and (rest > 0 or bits % 2 == 1):
        bits += 1
    return float(bits) * 0.5 ** (exponent - 1)


@kernel
def skip_blanks(text, at):
    """Return the place of the first byte from `at` on that is no space and no tab."""
    while at < text.size and (text[at] == SPACE or text[at] == TAB):
        at += 1
    return at


@kernel
def sign_at(text, at):
    """Return whether a minus stands at `at`, and the place behind the sign, if there is one."""
    if at < text.size and (text[at] == MINUS or text[at] == PLUS):
        return text[at] == MINUS, at + 1
    return False, at


@kernel
def decimal(text, at, blanks, exponents):
    """Read a number of `text` (n,) bytes from `at` on.

    Returns its value, the place of the first byte that does not belong to it, and whether it is one that can
    be told here. `blanks`: spaces and tabs may stand inside; `exponents`: ``e-3`` may follow.
    """
    size = text.size
    if blanks:
        at = skip_blanks(text, at)
    negative, at = sign_at(text, at)
    whole = 0
    places = 0  # behind the point
    step = 0  # of places, 1 behind the point
    digits = False
    while at < size:
        digit = text[at] - ZERO
        if 0 <= digit <= 9:
            digits = True
            if whole < MOST:
                whole = whole * 10 + digit
                places += step
            elif digit > 0 or step == 0:
                return 0.0, at, False  # more digits than fit
        elif text[at] == POINT and step == 0:
            step = 1
        elif not blanks or (text[at] != SPACE and text[at] != TAB):
            break
        at += 1
    if not digits:
        return 0.0, at, False
    if exponents and at < size and (text[at] == SMALL_E or text[at] == CAPITAL_E):
        down, at = sign_at(text, at + 1)
        exponent = 0
        digits = False
        while at < size and ZERO <= text[at] <= NINE:
            digits = True
            exponent = exponent * 10 + (text[at] - ZERO)
            at += 1
            if exponent > LARGEST_EXPONENT:
                return 0.0, at, False
        if not digits:
            return 0.0, at, False
        places += exponent if down else -exponent
    if whole <= EXACT:
        if 0 <= places <= 22:
            value = float(whole) / POWERS[places]
        elif -22 <= places < 0:
            value = float(whole) * POWERS[-places]
        else:
            return 0.0, at, False
    elif 0 <= places <= 18 and whole // WHOLE_POWERS[places] < EXACT:
        value = quotient(whole, places)
    else:
        return 0.0, at, False
    return -value if negative else value, at, True
