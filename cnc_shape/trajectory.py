"""Trajectory: the command of every axis at the servo period."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import FloatArray, frozen, frozen_integers
from cnc_shape.feedrate import Profile
from cnc_shape.kernels.sampling import sample_pieces

BLOCK = 16384  # samples in a chunk at most
END_MARGIN = 1e-6  # -, of a sample: a motion that ends within it after a sample ends at it


@dataclass(frozen=True, eq=False, slots=True)
class Trajectory:
    """A chunk of samples of the axis commands, analytic in position, velocity and acceleration.

    The first sample of a motion is at t = 0; the last is the first at or after its end, at rest. A replayed
    command was given by its positions alone: velocity and acceleration are differences of them. Once shaped
    it is a sum of interpolants, which know their velocity, and replayed no more; but rounded it stays.
    """

    axes: tuple[str, ...]
    sample_time: float  # s
    arc_length: FloatArray  # (n,) mm, place on the toolpath that the sample belongs to
    position: FloatArray  # (n,d) mm or rad
    velocity: FloatArray  # (n,d) mm/s or rad/s
    acceleration: FloatArray  # (n,d) mm/s^2 or rad/s^2
    replayed: bool = field(default=False, kw_only=True)  # positions are all that was given
    rounded: bool = field(default=False, kw_only=True)  # and given to some digits: differences carry noise

    def __len__(self) -> int:
        return self.arc_length.size

    def cut(self, rows: slice) -> Trajectory:
        """Some of the samples."""
        return Trajectory(
            self.axes,
            self.sample_time,
            self.arc_length[rows],
            self.position[rows],
            self.velocity[rows],
            self.acceleration[rows],
            replayed=self.replayed,
            rounded=self.rounded,
        )

    def resting(self, row: int, samples: int) -> Trajectory:
        """A command that rests for `samples` where this one is at `row`."""
        position = self.position[row]
        still = frozen(np.zeros((samples, position.size)))
        place = frozen(np.full(samples, self.arc_length[row]))
        return Trajectory(
            self.axes, self.sample_time, place, frozen(still + position), still, still,
            replayed=self.replayed, rounded=self.rounded,
        )  # fmt: skip

    def late_arc_length(self, first: int, delay: float) -> FloatArray:
        """The place from sample `first` on, `delay` samples ago, linear between samples."""
        whole = int(np.floor(delay))
        share = delay - whole
        right = self.arc_length[first - whole : len(self) - whole]
        left = self.arc_length[first - whole - 1 : len(self) - whole - 1]
        return right + share * (left - right)

    def summary(self) -> str:
        """Length in time and place, in one line."""
        axes = ", ".join(axis.upper() for axis in self.axes)
        travel = float(self.arc_length[-1] - self.arc_length[0]) if len(self) else 0.0
        return f"{len(self)} samples of {axes} every {self.sample_time * 1e3:g} ms along {travel:.3f} mm"


@dataclass(frozen=True, eq=False, slots=True)
class SamplingState:
    """Between two chunks: the next sample, and the piece it may lie in."""

    sample: int  # number of the next sample
    held: Profile  # the last piece, which ends where the next chunk begins; or none
    end_time: float  # s, end of the motion so far: the cycle time, after the last chunk


SamplingStep: TypeAlias = Callable[
    [SamplingState | None, Profile, bool], Iterator[tuple[SamplingState, Trajectory]]
]


def sampling(sample_time: float, block: int = BLOCK) -> SamplingStep:
    """Return the resumable step from Profile to Trajectory.

    A long piece spans many blocks, so the step is an iterator: ``for state, trajectory in step(state, chunk,
    last)`` runs at least once, with at most `block` samples a time, maybe none. The state that came last
    goes into the next call; after the last chunk it tells the cycle time. Which samples come together
    depends on the chunks, the samples do not.

    Parameters
    ----------
    sample_time
        Period, s.
    block
        Most samples in one yield.
    """

    def step(
        state: SamplingState | None, profile: Profile, last: bool
    ) -> Iterator[tuple[SamplingState, Trajectory]]:
        now = state or SamplingState(0, _pieces(profile, 0, 0), 0.0)
        if len(profile):
            for trajectory in _blocks(now.held, float(profile.time[0]), now.sample, sample_time, block):
                now = SamplingState(now.sample + len(trajectory), now.held, now.end_time)
                yield now, trajectory
            moving = _pieces(profile, 0, len(profile) - 1)
            held = _pieces(profile, len(profile) - 1, len(profile))
            now = SamplingState(now.sample, held, profile.end_time)
            for trajectory in _blocks(moving, float(profile.time[-1]), now.sample, sample_time, block):
                now = SamplingState(now.sample + len(trajectory), held, now.end_time)
                yield now, trajectory
        if last and len(now.held):
            until = now.end_time - END_MARGIN * sample_time
            for trajectory in _blocks(now.held, until, now.sample, sample_time, block):
                now = SamplingState(now.sample + len(trajectory), now.held, now.end_time)
                yield now, trajectory
            yield (
                SamplingState(now.sample + 1, _pieces(now.held, 0, 0), now.end_time),
                _rest(now.held, sample_time),
            )
        else:
            yield now, next(iter(_blocks(_pieces(profile, 0, 0), 0.0, 0, sample_time, 1)))

    return step


def join_trajectories(parts: Sequence[Trajectory]) -> Trajectory:
    """Consecutive chunks of one command, at least one, as one."""
    return Trajectory(
        parts[0].axes,
        parts[0].sample_time,
        frozen(np.concatenate([part.arc_length for part in parts])),
        frozen(np.concatenate([part.position for part in parts])),
        frozen(np.concatenate([part.velocity for part in parts])),
        frozen(np.concatenate([part.acceleration for part in parts])),
        replayed=parts[-1].replayed,
        rounded=parts[-1].rounded,
    )


def with_past(
    history: Trajectory | None, command: Trajectory, kept: int, rest: int
) -> tuple[Trajectory, int]:
    """Return a chunk between what came before and `rest` samples of rest after it, and where it begins.

    What came before is `history`, or, at the start of a motion, `kept` samples of rest.
    """
    history = command.resting(0, kept) if history is None else history
    whole = join_trajectories([history, command])
    if rest:
        whole = join_trajectories([whole, whole.resting(-1, rest)])
    return whole, len(history)


def sample(profile: Profile, sample_time: float) -> Trajectory:
    """Sample a whole profile at a period of `sample_time` s."""
    return join_trajectories([trajectory for _, trajectory in sampling(sample_time)(None, profile, True)])


def _pieces(profile: Profile, begin: int, end: int) -> Profile:
    """Return a view of some pieces; of one piece with its cell alone, so that it can outlive its chunk."""
    path, cell = profile.path, profile.cell[begin:end]
    if end - begin == 1:
        k = int(cell[0])
        path, cell = path.cut(slice(k, k + 1)), frozen_integers(np.zeros(1))
    cut = slice(begin, end)
    return Profile(
        path=path,
        time=profile.time[cut],
        duration=profile.duration[cut],
        u=profile.u[cut],
        velocity=profile.velocity[cut],
        acceleration=profile.acceleration[cut],
        jerk=profile.jerk[cut],
        cell=cell,
    )


def _blocks(
    profile: Profile, until: float, first: int, sample_time: float, block: int
) -> Iterator[Trajectory]:
    """Yield the samples from number `first` on that lie before `until` s; at least one block."""
    path = profile.path
    piece = 0
    while True:
        left = max(0.0, until / sample_time - first) + 2.0
        place, position, velocity, acceleration, piece = sample_pieces(
            profile.time, profile.u, profile.velocity, profile.acceleration, profile.jerk, profile.cell,
            path.coefficients, path.arc_length, path.stretch, until, piece, first, sample_time,
            int(min(block, left)),
        )  # fmt: skip
        first += place.size
        yield Trajectory(
            path.axes, sample_time, frozen(place), frozen(position), frozen(velocity), frozen(acceleration)
        )
        if piece >= len(profile):
            return


def _rest(held: Profile, sample_time: float) -> Trajectory:
    """Return the one sample at the end of a motion, at rest."""
    path = held.path
    e = path.length[-1:]
    powers = np.stack([np.ones(1), e, e**2, e**3], axis=1)
    position = (powers[:, :, None] * path.coefficients[-1:]).sum(axis=1)
    still = frozen(np.zeros_like(position))
    place = path.arc_length[-1:] + path.stretch[-1:] * e
    return Trajectory(path.axes, sample_time, frozen(place), frozen(position), still, still)
