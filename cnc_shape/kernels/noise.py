# pyright: basic
"""Normal noise that is a function of where it falls: no state, the same for any chunks and on any machine.

A counter of 64 bits goes through the finaliser of SplitMix64 (Steele, Lea and Flood, "Fast splittable
pseudorandom number generators", OOPSLA 2014), two such words through the transform of Box and Muller
("A note on the generation of random normal deviates", 1958). All integers are unsigned: numba takes a signed
one beside them for a reason to go on in floats.
"""

import numpy as np

from cnc_shape.kernels import kernel

GOLDEN = np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio, odd: the step of the counter
FIRST = np.uint64(0xBF58476D1CE4E5B9)
SECOND = np.uint64(0x94D049BB133111EB)
ONE = np.uint64(1)
UNIT = 2.0**-53  # a word's upper 53 bits as a share of 1


@kernel
def mixed(word):
    """Finaliser of SplitMix64: every bit of a uint64 affects every bit of the result."""
    word = (word ^ (word >> np.uint64(30))) * FIRST
    word = (word ^ (word >> np.uint64(27))) * SECOND
    return word ^ (word >> np.uint64(31))


@kernel
def word_at(seed, joint, count):
    """Random word, uint64, of a seed, a joint and a count (any integers)."""
    stream = mixed(mixed(np.uint64(seed) + GOLDEN) + (np.uint64(joint) + ONE) * GOLDEN)
    return mixed(stream + (np.uint64(count) + ONE) * GOLDEN)


@kernel
def normal(seed, joint, tick):
    """Standard normal value of a seed, a joint and a tick (any integers)."""
    count = np.uint64(tick) << ONE
    radius = (np.float64(word_at(seed, joint, count) >> np.uint64(11)) + 0.5) * UNIT
    turn = np.float64(word_at(seed, joint, count | ONE) >> np.uint64(11)) * UNIT
    return np.sqrt(-2.0 * np.log(radius)) * np.cos(2.0 * np.pi * turn)
