"""Recording: what a report keeps of a case does not depend on chunks, and holds every worst place."""

from __future__ import annotations

import errno
import gc
import tempfile

import naive
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from paths import line, rows, toolpath

from cnc_shape.arrays import frozen, frozen_integers
from cnc_shape.contour import ContourError
from cnc_shape.errors import InfeasibleError, OutputError
from cnc_shape.kernels.extremes import sample_measures
from cnc_shape.recording import MOTORS, PICKS, Outline, Recorder, Signals, picks
from cnc_shape.recording.extremes import Extremes
from cnc_shape.response import MotorSignals, Response
from cnc_shape.trajectory import Trajectory
from cnc_shape.writers import spool

SAMPLE_TIME = 1e-3
AXES = ("x", "y", "z", "a")
COUNT = 12_345
JOINTS = ("x", "z")  # those that have a servo motor
BUCKETS = 32  # so that 256 samples are kept as they are
SETTLING = np.ones((3, 4))


class Motion:
    """Signals that are rough, rounded so that equals occur, and all unlike."""

    def __init__(self, count: int, joints: tuple[str, ...] = ()) -> None:
        draw = np.random.default_rng(count)
        self.motions = [np.round(draw.normal(size=(count, 4)), 2) for _ in range(5)]
        self.errors = [np.round(draw.uniform(size=count), 2) for _ in range(3)]
        self.foot = draw.normal(size=(count, 3))
        self.line = np.arange(count) // 3
        self.joints = joints
        self.motors = {name: np.round(draw.normal(size=(count, len(joints))), 2) for name in MOTORS}

    def record(self, chunk: int, wait: int = 0, announced=None, **limits) -> Signals:
        """Feed a recorder chunk by chunk, the errors `wait` samples late."""
        motors = self.joints if announced is None else announced
        recorder = Recorder("shaped", AXES, SAMPLE_TIME, motors=motors, buckets=BUCKETS, **limits)
        count, decided = self.line.size, 0
        for low in range(0, count, chunk):
            high = min(low + chunk, count)
            known = slice(decided, count if high == count else max(high - wait, decided))
            decided = known.stop
            command, position, tool, velocity, acceleration = (frozen(m[low:high]) for m in self.motions)
            place = frozen(np.arange(low, high))
            trajectory = Trajectory(AXES, SAMPLE_TIME, place, command, velocity, acceleration)
            errors = [
                ContourError(
                    frozen(e[known]), frozen(self.foot[known]), frozen(e[known]), frozen_integers(self.line[known])
                )
                for e in self.errors
            ]  # fmt: skip
            told = {name: frozen(values[low:high]) for name, values in self.motors.items()}
            motors = MotorSignals(self.joints, **told) if self.joints else None
            recorder.add(
                Response(trajectory, position, position, position, tool, position, position[:0, 0], motors),
                errors,
            )
        return recorder.signals(SETTLING)


MOTION = Motion(COUNT)
DRIVEN = Motion(COUNT, JOINTS)


def same(first: Signals, second: Signals) -> None:
    for name in Signals.__slots__:
        if name not in ("samples", "motors"):
            assert_array_equal(getattr(first, name), getattr(second, name))
    assert (first.motors is None) == (second.motors is None)
    if first.motors is not None and second.motors is not None:
        for name in ("joints", *MOTORS):
            assert_array_equal(getattr(first.motors, name), getattr(second.motors, name))
    assert (first.samples is None) == (second.samples is None)
    for name in ("time", "tool", "tool_error", "line"):
        if first.samples is not None and second.samples is not None:
            assert_array_equal(first.samples.read(name), second.samples.read(name))


@pytest.mark.parametrize("count", [1, 100, PICKS * BUCKETS])
def test_a_short_motion_is_kept_whole(count):
    motion = Motion(count)
    signals = motion.record(64)
    assert (signals.factor, signals.bucket, signals.samples) == (1, 1, None)
    assert signals.source is signals
    assert_array_equal(signals.tool_error, motion.errors[2])
    assert_array_equal(signals.acceleration, motion.motions[4])
    assert_array_equal(signals.foot, motion.foot)
    assert_array_equal(signals.time, np.arange(count) * SAMPLE_TIME)


@pytest.mark.parametrize(("chunk", "wait"), [(1, 0), (1, 5), (7, 3), (256, 0), (257, 300), (4096, 1000)])
@pytest.mark.parametrize("limits", [{"kept": 2000}, {"kept": COUNT}, {"kept": 2000, "all_signals": True}])
def test_what_is_kept_does_not_depend_on_chunks(chunk, wait, limits):
    same(MOTION.record(chunk, wait, **limits), MOTION.record(COUNT, **limits))


def test_a_long_motion_keeps_the_extremes_of_every_bucket():
    signals = MOTION.record(1000, kept=2000)
    rows = np.column_stack([*MOTION.motions, *MOTION.errors])
    width = PICKS * signals.factor
    assert (signals.bucket, signals.samples) == (width, None)
    assert COUNT / width <= BUCKETS < 2 * COUNT / width
    kept = naive.extremes(naive.sample_measures(rows, 4), width)
    assert_array_equal(signals.time, kept * SAMPLE_TIME)
    assert_array_equal(signals.tool, MOTION.motions[2][kept])
    assert_array_equal(signals.foot, MOTION.foot[kept])
    assert_array_equal(signals.line, MOTION.line[kept])


def test_every_worst_place_stays():
    signals = MOTION.record(1000, kept=2000)
    for name, errors in zip(("command_error", "drive_error", "tool_error"), MOTION.errors, strict=True):
        assert getattr(signals, name).max() == errors.max()
        assert signals.line[getattr(signals, name).argmax()] == MOTION.line[errors.argmax()]
    following = np.linalg.norm((MOTION.motions[0] - MOTION.motions[1])[:, :3], axis=1)
    assert np.linalg.norm((signals.command - signals.position)[:, :3], axis=1).max() == following.max()


@pytest.mark.parametrize("limits", [{"kept": COUNT}, {"kept": 10, "all_signals": True}])
def test_every_sample_is_there_for_the_archive(limits, monkeypatch):
    monkeypatch.setattr(spool.Spool.__init__, "__defaults__", (1000,))
    signals = MOTION.record(777, **limits)
    assert signals.factor > 1
    assert signals.samples is not None
    assert signals.source is signals.samples
    assert len(signals.samples) == COUNT
    assert [piece.size for piece in signals.samples.pieces("line")] == [1000] * 12 + [345]
    assert_array_equal(signals.samples.read("time"), np.arange(COUNT) * SAMPLE_TIME)
    assert_array_equal(signals.samples.read("acceleration", 3), MOTION.motions[4][:, 3])
    assert_array_equal(signals.samples.read("drive_error"), MOTION.errors[1])
    assert_array_equal(signals.samples.read("line"), MOTION.line)


# --- servo motors ---------------------------------------------------------------------------------


def test_what_the_motors_of_a_short_motion_did_is_kept_whole():
    motion = Motion(150, JOINTS)
    signals = motion.record(64, 10)
    assert (signals.factor, signals.motors.joints) == (1, JOINTS)
    for name in MOTORS:
        assert_array_equal(getattr(signals.motors, name), motion.motors[name])
        assert_array_equal(*signals.pieces(name, 1), motion.motors[name][:, 1])
    assert Motion(150).record(64, 10).motors is None


@pytest.mark.parametrize(("chunk", "wait"), [(1, 5), (257, 300), (4096, 1000)])
@pytest.mark.parametrize("limits", [{"kept": 2000}, {"kept": COUNT}])
def test_nor_does_what_is_kept_of_motors_depend_on_chunks(chunk, wait, limits):
    first, second = DRIVEN.record(chunk, wait, **limits), DRIVEN.record(COUNT, **limits)
    same(first, second)
    if first.samples is not None:
        for name in MOTORS:
            assert_array_equal(first.samples.read(name, 1), DRIVEN.motors[name][:, 1])
        assert_array_equal(first.samples.read("line"), DRIVEN.line)


def test_a_long_motion_keeps_the_extremes_of_torque_gain_and_what_the_observer_misses():
    signals = DRIVEN.record(1000, kept=2000)
    motors = DRIVEN.motors
    measures = [
        *naive.sample_measures(np.column_stack([*DRIVEN.motions, *DRIVEN.errors]), 4),
        np.abs(motors["torque"]).max(axis=1),
        np.abs(motors["estimate"] - motors["load"]).max(axis=1),
        motors["gain_ratio"].max(axis=1),
    ]
    assert signals.bucket == picks(True) * signals.factor
    kept = naive.extremes(np.array(measures), signals.bucket)
    assert kept.size <= picks(True) * BUCKETS // 2
    assert_array_equal(signals.time, kept * SAMPLE_TIME)
    assert_array_equal(signals.tool, DRIVEN.motions[2][kept])
    for name in MOTORS:
        assert_array_equal(getattr(signals.motors, name), motors[name][kept])


def test_a_torque_that_is_not_finite_stops_the_run_and_is_named():
    motion = Motion(1000, JOINTS)
    motion.motors["estimate"][700, 1] = np.nan
    with pytest.raises(InfeasibleError, match=r"estimate of Z of the case shaped is nan at t = 0.7 s"):
        motion.record(64, 10)


@pytest.mark.parametrize(("told", "announced"), [(JOINTS, ("x", "y")), ((), JOINTS), (JOINTS, ())])
def test_motors_other_than_those_announced_are_our_own_bug(told, announced):
    with pytest.raises(ValueError, match="motors"):
        Motion(10, told).record(10, announced=announced)


# --- the archive ----------------------------------------------------------------------------------


def test_one_sample_more_than_are_kept_thins_the_archive():
    assert MOTION.record(1000, kept=COUNT).samples is not None
    assert MOTION.record(1000, kept=COUNT - 1).samples is None


@pytest.mark.parametrize(("signal", "name"), [(1, "position of Y"), (4, "acceleration of Y")])
def test_a_sample_that_is_not_finite_stops_the_run_and_is_named(signal, name):
    motion = Motion(1000)
    motion.motions[signal][700, 1] = np.inf
    motion.motions[0][701, 0] = np.nan
    with pytest.raises(InfeasibleError, match=rf"{name} of the case shaped is inf at t = 0.7 s"):
        motion.record(64, 10)


def test_a_full_disk_is_told_with_a_hint(monkeypatch):
    class Full:
        def write(self, data):
            raise OSError(errno.ENOSPC, "No space left on device")

        def close(self):
            pass

    monkeypatch.setattr(tempfile, "TemporaryFile", lambda **options: Full())
    monkeypatch.setattr(spool.Spool.__init__, "__defaults__", (1000,))
    with pytest.raises(OutputError, match="temporary files: no space left") as caught:
        MOTION.record(777)
    assert "TMPDIR" in str(caught.value.hint)


def test_the_nameless_file_goes_with_the_signals(monkeypatch):
    files, original = [], tempfile.TemporaryFile
    monkeypatch.setattr(
        tempfile, "TemporaryFile", lambda **options: files.append(original(**options)) or files[-1]
    )
    monkeypatch.setattr(spool.Spool.__init__, "__defaults__", (1000,))
    signals = MOTION.record(777, kept=COUNT)
    assert not files[0].closed
    del signals
    gc.collect()
    assert files[0].closed
    MOTION.record(777, kept=5000)
    assert files[1].closed


# --- thinning -------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 7, 8, 9, 63, 64, 65, 1000])
@pytest.mark.parametrize("chunk", [1, 3, 64, 1000])
def test_extremes_are_their_definition(count, chunk):
    rows = np.round(np.random.default_rng(count).normal(size=(count, 2)), 1)  # with equals
    thinned = Extremes(lambda part: part.T.copy(), 2, 2, buckets=4)
    for low in range(0, count, chunk):
        thinned.add(rows[low : low + chunk])
    index, kept = thinned.rows()
    width = 2 * thinned.factor
    expected = np.arange(count) if thinned.factor == 1 else naive.extremes(rows.T, width)
    assert_array_equal(index, expected)
    assert_array_equal(kept, rows[expected])
    assert (thinned.factor == 1) == (count <= 8)


def test_measures_are_their_definition():
    rows = np.random.default_rng(0).normal(size=(50, 27))
    assert_allclose(sample_measures(frozen(rows), 4), naive.sample_measures(rows, 4), rtol=1e-14)


@pytest.mark.parametrize("chunk", [1, 7, 500])
def test_a_long_outline_is_bounded_and_reaches_as_far(chunk):
    angle = np.linspace(0.0, 20.0, 501)
    corners = np.column_stack([angle * np.cos(angle), angle * np.sin(angle), angle])
    whole = toolpath(*(line(*corner) for corner in corners[1:]))
    outline = Outline(buckets=8)
    for low in range(0, len(whole), chunk):
        outline.add(rows(whole, low, min(low + chunk, len(whole))))
    points = outline.points()
    kept = naive.extremes(np.vstack([corners.T, -corners.T]), 96)
    assert_allclose(points, corners[kept], atol=1e-14)
    assert len(points) <= 48
    assert_allclose(np.ptp(points, axis=0), np.ptp(corners, axis=0))


def test_a_short_outline_is_the_path():
    corners = np.random.default_rng(3).normal(size=(9, 3))
    outline = Outline(buckets=8)
    outline.add(toolpath(*(line(*corner) for corner in corners)))
    assert_allclose(outline.points(), np.vstack([np.zeros(3), corners]), atol=1e-14)
    assert Outline().points().shape == (0, 3)
