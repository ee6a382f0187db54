"""Disturbances of a machine file -> Disturbances: what there is for them to act on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NoReturn

from cnc_shape.config.complaints import KeyPath, locate, refuse_at, refuse_key_at
from cnc_shape.config.disturbance_models import (
    MAX_ROWS,
    AnyDisturbance,
    EncoderNoiseModel,
    LoadTorqueModel,
    PulsesModel,
    SineBurstModel,
    StepsModel,
    TableModel,
)
from cnc_shape.config.drives import GIVE_A_MOTOR, NO_MOTOR, motors_of
from cnc_shape.config.load_table import read_load_table
from cnc_shape.config.yaml_tree import Tree, dotted
from cnc_shape.disturbances import (
    Direction,
    Disturbances,
    EncoderNoise,
    LoadTorque,
    PathDirection,
    Profile,
    ProfileTable,
    Pulses,
    SineBurst,
    Steps,
)
from cnc_shape.kinematics import Kinematics
from cnc_shape.machine import Machine, ServoMotor


def read_disturbances(
    source: str, tree: Tree, models: Sequence[AnyDisturbance], machine: Machine, kinematics: Kinematics
) -> Disturbances:
    """Return what disturbs the machine.

    Raises
    ------
    ConfigError
        A disturbance that nothing of this machine would feel, a second noise, or a profile that is none; a
        faulty file of a table is named at its own line.
    """
    reader = _Reader(source, tree, machine, kinematics)
    for index, model in enumerate(models):
        reader.add(("disturbances", index), model)
    return Disturbances(tuple(reader.loads), reader.noise)


class _Reader:
    """The disturbances of one file."""

    def __init__(self, source: str, tree: Tree, machine: Machine, kinematics: Kinematics) -> None:
        self._source, self._tree = source, tree
        self._machine, self._kinematics = machine, kinematics
        self._motors = motors_of(machine)
        self._rows = 0  # of all tables
        self.loads: list[LoadTorque] = []
        self.noise: EncoderNoise | None = None

    def add(self, path: KeyPath, model: AnyDisturbance) -> None:
        if not self._motors:
            self._refuse(path, f"{model.type} {NO_MOTOR}", GIVE_A_MOTOR)
        if isinstance(model, EncoderNoiseModel):
            self._add_noise(path, model)
        else:
            self.loads.append(self._load(path, model))

    def _add_noise(self, path: KeyPath, model: EncoderNoiseModel) -> None:
        if self.noise is not None:
            self._refuse(path, "a second encoder_noise", "one acts on every encoder: keep one")
        if not any(motor.encoder_counts for motor in self._motors):
            reason = "noise in counts, and no motor has an encoder that counts"
            self._refuse(path, reason, "add encoder_counts_per_rev: to the motors")
        self.noise = EncoderNoise(model.standard_deviation_counts, model.seed)

    def _load(self, path: KeyPath, model: LoadTorqueModel) -> LoadTorque:
        direction = self._direction((*path, "direction"), model.direction)
        if isinstance(model.profile, TableModel):
            return self._table(path, model.profile, direction, model.peak_nm)
        if model.peak_nm is None:
            self._refuse(path, "peak_nm is missing", "add peak_nm: the largest torque of the profile")
        return LoadTorque(direction, model.peak_nm, self._profile((*path, "profile"), model.profile))

    def _direction(self, path: KeyPath, word: str) -> Direction:
        for direction in PathDirection:
            if word == direction.value:
                return direction
        names = [axis.name for axis in self._machine.axes]
        if word not in names:
            self._refuse(path, f"the machine has no axis {word}", "name one of " + ", ".join(names))
        axis = self._machine.axis(word)
        if word not in self._moved_by_joints() and not isinstance(axis.drive, ServoMotor):
            self._refuse(path, f"axis {word} has no servo motor to feel it", GIVE_A_MOTOR)
        return word

    def _moved_by_joints(self) -> tuple[str, ...]:
        return self._kinematics.axes if self._machine.joints else ()

    def _profile(self, path: KeyPath, model: SineBurstModel | PulsesModel | StepsModel) -> Profile:
        if isinstance(model, SineBurstModel):
            return SineBurst(model.frequency_hz, model.length_s, model.centre_s)
        if isinstance(model, PulsesModel):
            return Pulses(model.start_s, model.rise_s, model.hold_s, model.gap_s, tuple(model.peaks))
        self._check_lengths((*path, "levels"), len(model.times_s), len(model.levels))
        return Steps(tuple(model.times_s), tuple(model.levels))

    def _table(
        self, path: KeyPath, model: TableModel, direction: Direction, peak: float | None
    ) -> LoadTorque:
        """Torques as measured, or scaled so that the largest is the peak."""
        times, torques = self._columns((*path, "profile"), model)
        self._rows += len(times)
        if self._rows > MAX_ROWS:
            reason = f"the tables of a machine have at most {MAX_ROWS} rows together, not {self._rows}"
            self._refuse((*path, "profile"), reason, "leave rows out: between them the torque is linear")
        if peak is None:
            return LoadTorque(direction, 1.0, ProfileTable(times, torques))
        largest = max(map(abs, torques))
        if largest == 0.0:
            reason = "a table of zeros has no peak to be scaled"
            self._refuse((*path, "peak_nm"), reason, "remove peak_nm, or give torques")
        return LoadTorque(direction, peak, ProfileTable(times, tuple(torque / largest for torque in torques)))

    def _columns(self, path: KeyPath, model: TableModel) -> tuple[tuple[float, ...], tuple[float, ...]]:
        if model.file is not None:
            for key, given in (("times_s", model.times_s), ("torques_nm", model.torques_nm)):
                if given is not None:
                    hint = "keep either file:, or times_s: and torques_nm:"
                    refuse_key_at(self._source, self._tree, (*path, key), "the table is in a file", hint)
            place, _ = locate(self._tree, (*path, "file"))
            return read_load_table(self._source, place, dotted((*path, "file")), model.file)
        if model.times_s is None or model.torques_nm is None:
            missing = "times_s" if model.times_s is None else "torques_nm"
            reason = "file is missing" if model.times_s is model.torques_nm else f"{missing} is missing"
            self._refuse(path, reason, "add file: with the name of a CSV, or times_s: and torques_nm:")
        self._check_lengths((*path, "torques_nm"), len(model.times_s), len(model.torques_nm))
        return tuple(model.times_s), tuple(model.torques_nm)

    def _check_lengths(self, path: KeyPath, times: int, values: int) -> None:
        if values != times:
            self._refuse(path, f"{values} values at {times} times", "give every time its value")

    def _refuse(self, path: KeyPath, reason: str, hint: str) -> NoReturn:
        refuse_at(self._source, self._tree, path, reason, hint)
