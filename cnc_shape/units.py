"""Units at the door: inside, everything is mm, s, rad and Hz.

Multiply to come in, divide to go out: ``feed_rate = word_f * MM_PER_MIN``.
"""

from math import pi

MM_PER_INCH = 25.4  # mm
MM_PER_MIN = 1.0 / 60.0  # mm/s
PER_MIN = 1.0 / 60.0  # 1/s
DEGREE = pi / 180.0  # rad
MICROMETRE = 1e-3  # mm
MILLISECOND = 1e-3  # s
TWO_PI = 2.0 * pi  # rad
