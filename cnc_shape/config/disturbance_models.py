"""The keys of a disturbance."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from cnc_shape.config.bounds import Duration, Moment, SignedShare, Torque
from cnc_shape.config.strict import Strict, refuse_value

MAX_STEPS = 1000
MAX_ROWS = 10_000  # of the tables of a machine, which must fit into the file that a run leaves behind


def increasing(times: list[float]) -> list[float]:
    """Refuse times that do not increase, at the first that does not."""
    for index in range(1, len(times)):
        if times[index] <= times[index - 1]:
            reason = f"{times[index]:g} s is not after {times[index - 1]:g} s"
            refuse_value(reason, "list the times in increasing order", (index,))
    return times


class SineBurstModel(Strict):
    """Some periods of a sine under a cosine-squared window."""

    type: Literal["sine_burst"]
    frequency_hz: Annotated[float, Field(ge=1e-6, le=1e5)]
    length_s: Duration
    centre_s: Moment


class PulsesModel(Strict):
    """Pulses one after another."""

    type: Literal["pulses"]
    start_s: Moment
    rise_s: Duration
    hold_s: Annotated[float, Field(ge=0.0, le=1e6)]
    gap_s: Annotated[float, Field(ge=0.0, le=1e6)]
    peaks: Annotated[list[SignedShare], Field(min_length=1, max_length=MAX_STEPS)]


class StepsModel(Strict):
    """A level that holds from each time on until the next."""

    type: Literal["steps"]
    times_s: Annotated[list[Moment], Field(min_length=1, max_length=MAX_STEPS), AfterValidator(increasing)]
    levels: Annotated[list[SignedShare], Field(min_length=1, max_length=MAX_STEPS)]


class TableModel(Strict):
    """Measured torques: in a file of their own, or listed here."""

    type: Literal["table"]
    file: Annotated[str, Field(min_length=1, max_length=4096)] | None = None
    times_s: (
        Annotated[list[Moment], Field(min_length=2, max_length=MAX_ROWS), AfterValidator(increasing)] | None
    ) = None
    torques_nm: Annotated[list[Torque], Field(min_length=2, max_length=MAX_ROWS)] | None = None


AnyProfile = Annotated[SineBurstModel | PulsesModel | StepsModel | TableModel, Field(discriminator="type")]


class LoadTorqueModel(Strict):
    """A torque that the motors have to hold."""

    type: Literal["load_torque"]
    direction: Literal["path_normal", "path_tangent", "path_binormal", "x", "y", "z", "a", "b", "c"]
    peak_nm: Torque | None = None
    profile: AnyProfile


class EncoderNoiseModel(Strict):
    """Noise on every reading of every encoder."""

    type: Literal["encoder_noise"]
    standard_deviation_counts: Annotated[float, Field(ge=0.0, le=1e6)]
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0


AnyDisturbance = Annotated[LoadTorqueModel | EncoderNoiseModel, Field(discriminator="type")]
