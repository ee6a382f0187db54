# pyright: basic
"""Running sums whose bits do not depend on how a signal is cut into chunks."""

from cnc_shape.kernels import kernel


@kernel
def add_squares(values, total):
    """Add the square of every row to `total` (d,), in place, row after row. values (n,d)."""
    for k in range(values.shape[0]):
        for a in range(values.shape[1]):
            total[a] += values[k, a] * values[k, a]


@kernel
def largest_ratio(values, limit, worst):
    """Raise `worst` (1,), in place, to the largest ``|values[k, a]| / limit[a]``; (n,d) and (d,)."""
    for k in range(values.shape[0]):
        for a in range(values.shape[1]):
            ratio = abs(values[k, a]) / limit[a]
            if not ratio <= worst[0]:
                worst[0] = ratio
