"""Encoder noise: normal values that depend on seed, joint and tick alone."""

import naive
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import stats

from cnc_shape.kernels import kernel
from cnc_shape.kernels.noise import mixed, normal, word_at

COUNT = 100_000
WHOLE = st.integers(0, 2**62)


@kernel
def drawn(seed, joint, first, count):
    values = np.empty(count)
    for k in range(count):
        values[k] = normal(seed, joint, first + k)
    return values


@pytest.fixture(scope="module")
def noise():
    return drawn(7, 0, 0, COUNT)


def test_the_finaliser_is_that_of_splitmix64():
    # first outputs of SplitMix64 seeded with 1234567, as published with its reference implementation
    published = [6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431]
    golden = 0x9E3779B97F4A7C15
    states = [(1234567 + k * golden) % 2**64 for k in (1, 2, 3, 4)]
    assert [int(mixed(np.uint64(state))) for state in states] == published


@given(WHOLE, st.integers(0, 40), WHOLE)
def test_the_hash_is_that_of_whole_numbers(seed, joint, count):
    assert int(word_at(seed, joint, count)) == naive.random_word(seed, joint, count)


@given(WHOLE, st.integers(0, 40), WHOLE)
def test_the_normal_value_is_that_of_the_slow_twin(seed, joint, tick):
    assert_allclose(normal(seed, joint, tick), naive.normal_noise(seed, joint, tick), rtol=1e-15, atol=1e-15)


def unmixed(word):
    """What SplitMix64's finaliser makes `word` of: its steps undone, last first."""

    def unshifted(z, by):
        whole = z
        for _ in range(64 // by):
            whole = z ^ (whole >> by)
        return whole

    word = unshifted(word, 31) * pow(0x94D049BB133111EB, -1, 2**64) % 2**64
    word = unshifted(word, 27) * pow(0xBF58476D1CE4E5B9, -1, 2**64) % 2**64
    return unshifted(word, 30)


def test_the_rarest_word_has_a_finite_value_too():
    # only 0 is mixed to 0: a seed whose counter comes there at an even count, the radius of a tick
    joint, golden = 2, 0x9E3779B97F4A7C15
    for seed in range(20):
        stream = unmixed(int(word_at(seed, joint, -1)))  # a count of -1 adds nothing to it
        count = (-stream * pow(golden, -1, 2**64) - 1) % 2**64
        if count % 2 == 0:
            break
    assert int(word_at(seed, joint, np.uint64(count))) == 0
    turn = naive.random_word(seed, joint, count + 1) / 2**64
    largest = np.sqrt(-2.0 * np.log(2.0**-54))
    assert_allclose(normal(seed, joint, count // 2), largest * np.cos(2 * np.pi * turn), rtol=1e-12)


def test_no_value_depends_on_those_before_it(noise):
    np.testing.assert_array_equal(
        np.concatenate([drawn(7, 0, 0, 1234), drawn(7, 0, 1234, 500)]), noise[:1734]
    )


@pytest.mark.parametrize(("seed", "joint"), [(0, 0), (0, 1), (1, 0), (2**31, 5)])
def test_values_are_standard_normal(seed, joint):
    values = drawn(seed, joint, 0, COUNT)
    assert abs(values.mean()) < 4.0 / np.sqrt(COUNT)
    assert abs(values.var() - 1.0) < 4.0 * np.sqrt(2.0 / COUNT)
    assert abs(stats.skew(values)) < 4.0 * np.sqrt(6.0 / COUNT)
    assert abs(stats.kurtosis(values)) < 4.0 * np.sqrt(24.0 / COUNT)
    assert stats.kstest(values, "norm").pvalue > 1e-3


def test_values_are_white(noise):
    spectrum = np.abs(np.fft.fft(noise, 2 * COUNT)) ** 2
    correlation = np.fft.ifft(spectrum).real[1:1001] / COUNT
    assert np.abs(correlation).max() < 4.5 / np.sqrt(COUNT)
    squares = noise**2 - 1.0
    assert abs(np.mean(squares[1:] * squares[:-1])) < 4.0 * 2.0 / np.sqrt(COUNT)


def test_joints_and_seeds_are_independent(noise):
    others = [drawn(7, joint, 0, COUNT) for joint in range(1, 6)]
    others += [drawn(seed, 0, 0, COUNT) for seed in (6, 8, 7 + 2**20)]
    together = np.corrcoef(np.vstack([noise, *others]))
    assert np.abs(together - np.eye(len(together))).max() < 4.5 / np.sqrt(COUNT)
    for other in others:  # nor is one the other a few ticks late
        for late in (1, 2, 3):
            assert abs(np.mean(noise[late:] * other[:-late])) < 4.5 / np.sqrt(COUNT)
