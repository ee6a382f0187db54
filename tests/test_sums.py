"""Running sums: row after row, so that no cut changes a bit."""

import naive
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from cnc_shape.arrays import frozen
from cnc_shape.kernels.sums import add_squares, largest_ratio


@given(seed=st.integers(0, 10**6), rows=st.integers(0, 40), cut=st.integers(0, 40))
def test_sums_equal_their_slow_twins_wherever_they_are_cut(seed, rows, cut):
    values = np.random.default_rng(seed).normal(size=(rows, 3)) * [1.0, 1e6, 1e-6]
    limit = frozen([2.0, 1e5, 1e-7])
    total, worst = np.zeros(3), np.zeros(1)
    for part in (values[:cut], values[cut:]):
        add_squares(frozen(part), total)
        largest_ratio(frozen(part), limit, worst)
    assert_array_equal(total, naive.squares(values))
    assert worst[0] == naive.largest_ratio(values, limit)


def test_what_is_no_number_is_the_largest_ratio():
    worst = np.zeros(1)
    largest_ratio(frozen([[1.0], [np.nan]]), frozen([1.0]), worst)
    assert np.isnan(worst[0])
