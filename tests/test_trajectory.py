"""Trajectory: analytic samples of the time law."""

import naive
import numpy as np
import pytest
from motions import MILL, PRINTER, lines, wander
from numpy.testing import assert_allclose, assert_array_equal
from paths import arc, dwell, line, toolpath

from cnc_shape.planning import plan
from cnc_shape.smoothing import Smoothing, smooth
from cnc_shape.trajectory import sample, sampling


def profile_of(whole, limits=MILL, tolerance=0.01):
    return plan(smooth(whole, Smoothing(tolerance)), limits)


MIXED = toolpath(
    line(10, 0), arc((15, 5, 0), (10, 5, 0), np.pi / 2), dwell(0.1), line(15, 9), line(11, 9.5), line(2, 1, 3)
)


def test_first_and_last_sample():
    profile = profile_of(MIXED)
    command = sample(profile, 1e-3)
    assert_array_equal(command.position[0], MIXED.start[0])
    assert_array_equal(command.velocity[0], 0.0)
    assert_array_equal(command.position[-1], MIXED.end[-1])
    assert_array_equal(command.velocity[-1], 0.0)
    assert_array_equal(command.acceleration[-1], 0.0)
    assert len(command) == int(np.ceil(profile.end_time / 1e-3 - 1e-6)) + 1
    assert_allclose(command.arc_length[-1], MIXED.arc_length[-1], rtol=1e-15)


def test_a_motion_of_a_whole_number_of_samples_ends_with_the_last_of_them():
    profile = profile_of(lines([[0, 0], [100, 0]]))
    assert_allclose(profile.end_time, 1.05, rtol=1e-12)
    assert len(sample(profile, 1e-3)) == 1051


def test_samples_are_those_of_plain_powers():
    profile = profile_of(MIXED)
    command = sample(profile, 3.7e-4)
    times = 3.7e-4 * np.arange(len(command) - 1)
    position, velocity, acceleration = naive.samples(profile, times)
    assert_allclose(command.position[:-1], position, rtol=0, atol=1e-12)
    assert_allclose(command.velocity[:-1], velocity, rtol=0, atol=1e-9)
    assert_allclose(command.acceleration[:-1], acceleration, rtol=0, atol=1e-7)


def test_at_a_kink_the_sample_takes_the_later_piece():
    command = sample(profile_of(lines([[0, 0], [100, 0]])), 0.05)  # rises for 0.05 s
    assert_allclose(command.acceleration[:3, 0], [2000.0, 0.0, 0.0])


@pytest.mark.parametrize("limits", [MILL, PRINTER])
def test_differences_of_samples_are_the_analytic_derivatives(limits):
    command = sample(profile_of(wander(np.random.default_rng(6), 400), limits), 2e-5)
    dt = command.sample_time
    # acceleration jumps by 2 A at most, in at most one place of each difference
    most = 2 * max(limit.acceleration for limit in limits)
    velocity = (command.position[1:] - command.position[:-1]) / dt
    middle = 0.5 * (command.velocity[1:] + command.velocity[:-1])
    assert np.abs(velocity - middle).max() <= 0.5 * most * dt
    assert np.median(np.abs(velocity - middle)) <= 1e-5
    acceleration = (command.velocity[1:] - command.velocity[:-1]) / dt
    assert np.abs(acceleration).max() <= 0.5 * most * (1 + 1e-6)
    assert (
        np.median(np.abs(acceleration - 0.5 * (command.acceleration[1:] + command.acceleration[:-1]))) <= 1.0
    )


def test_sampled_travel_adds_up_to_the_length_of_the_path():
    command = sample(profile_of(MIXED, tolerance=1e-3), 1e-4)
    travel = np.linalg.norm(np.diff(command.position, axis=0), axis=1).sum()
    assert_allclose(travel, MIXED.arc_length[-1], atol=0.02)
    assert travel <= MIXED.arc_length[-1]
    assert (np.diff(command.arc_length) >= 0.0).all()


def test_places_are_where_the_samples_are():
    command = sample(profile_of(MIXED), 1e-3)
    assert naive.deviations(MIXED, command.position, command.arc_length, 0.1).max() <= 0.01


def test_a_dwell_is_at_rest():
    profile = profile_of(toolpath(line(10, 0), dwell(0.5), line(20, 0)))
    command = sample(profile, 1e-3)
    still = np.abs(command.velocity).max(axis=1) == 0.0
    assert 500 <= still[1:-1].sum() <= 501


@pytest.mark.parametrize("block", [1, 7, 1000])
def test_blocks_are_bounded_and_tell_the_cycle_time(block):
    profile = profile_of(lines([[0, 0], [3, 0], [3, 1]]))
    yields = list(sampling(1e-3, block)(None, profile, True))
    assert max(len(trajectory) for _, trajectory in yields) <= block
    assert_array_equal(np.concatenate([t.position for _, t in yields]), sample(profile, 1e-3).position)
    assert yields[-1][0].end_time == profile.end_time
    assert yields[-1][0].sample == len(sample(profile, 1e-3))


def test_nothing_has_no_samples():
    assert len(sample(profile_of(toolpath()), 1e-3)) == 0
    assert len(sample(profile_of(toolpath(dwell(0.0))), 1e-3)) == 1
