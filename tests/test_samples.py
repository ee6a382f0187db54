"""What is written as samples reads back to the same bits, and is published only then."""

from __future__ import annotations

import io
import os
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_array_equal

from cnc_shape.arrays import frozen
from cnc_shape.errors import InfeasibleError, OutputError
from cnc_shape.trajectory import Trajectory
from cnc_shape.units import DEGREE
from cnc_shape.writers import samples
from cnc_shape.writers.samples import degrees, sample_times, stream_csv, stream_npz, write_csv, write_npz


def trajectory(n: int = 500, axes: tuple[str, ...] = ("x", "y", "z", "a"), seed: int = 1) -> Trajectory:
    random = np.random.default_rng(seed)
    motion = [frozen(random.normal(scale=100.0, size=(n, len(axes)))) for _ in range(3)]
    return Trajectory(axes, 1e-3, frozen(np.arange(n)), *motion)


def cut(whole: Trajectory, at: list[int]) -> list[Trajectory]:
    edges = [0, *sorted(at), len(whole)]
    names = ("arc_length", "position", "velocity", "acceleration")
    return [
        replace(whole, **{name: getattr(whole, name)[low:high] for name in names})
        for low, high in pairwise(edges)
    ]


def read_csv(path) -> tuple[str, np.ndarray]:
    header, *lines = path.read_text("ascii").splitlines()
    return header, np.array([[float(cell) for cell in line.split(",")] for line in lines])


def test_csv_names_units_and_keeps_every_bit(tmp_path):
    command = trajectory()
    assert write_csv(tmp_path / "out.csv", [command]) == 500
    header, table = read_csv(tmp_path / "out.csv")
    assert header == "time_s,x_mm,y_mm,z_mm,a_deg"
    assert_array_equal(table[:, 1:4], command.position[:, :3])
    np.testing.assert_allclose(table[:, 4] * DEGREE, command.position[:, 3], rtol=1e-15, atol=0.0)
    np.testing.assert_allclose(table[:, 0], np.arange(500) * 1e-3, rtol=1e-15, atol=0.0)


def test_times_are_the_decimals_a_reader_expects():
    assert [repr(t) for t in sample_times(9, 3, 1e-3).tolist()] == ["0.009", "0.01", "0.011"]
    third = sample_times(0, 1000, 1.0 / 3000.0)
    assert_array_equal(third[1::3], (np.arange(1000) * (1.0 / 3000.0))[1::3])
    assert repr(float(third[204])) == "0.068"


@given(arrays(np.float64, 20, elements=st.floats(-1e4, 1e4)))
def test_degrees_come_back_to_the_same_radians_where_a_number_does(angles):
    back = degrees(angles) * DEGREE
    np.testing.assert_allclose(back, angles, rtol=2.3e-16, atol=1e-300)
    for wanted, got in zip(angles.tolist(), degrees(angles).tolist(), strict=True):
        near = [got, np.nextafter(got, np.inf), np.nextafter(got, -np.inf)]
        assert got * DEGREE == wanted or all(value * DEGREE != wanted for value in near)


def test_npz_names_units_time_first(tmp_path):
    command = trajectory()
    assert write_npz(tmp_path / "out.npz", [command]) == 500
    with np.load(tmp_path / "out.npz") as archive:
        assert archive["time_s"].shape == (500,)
        assert archive["linear_axes"].tolist() == ["x", "y", "z"]
        assert archive["rotary_axes"].tolist() == ["a"]
        assert_array_equal(archive["position_mm"], command.position[:, :3])
        assert_array_equal(archive["velocity_mm_s"], command.velocity[:, :3])
        assert_array_equal(archive["acceleration_mm_s2"], command.acceleration[:, :3])
        np.testing.assert_allclose(archive["position_deg"] * DEGREE, command.position[:, 3:], rtol=1e-15)
        assert sorted(archive.files) == sorted(
            ["time_s", "linear_axes", "rotary_axes"]
            + [f"{name}_{unit}" for name, units in samples.MOTION_UNITS.items() for unit in units]
        )


def test_a_machine_without_rotary_axes_writes_none(tmp_path):
    write_npz(tmp_path / "out.npz", [trajectory(axes=("x", "y", "z"))])
    with np.load(tmp_path / "out.npz") as archive:
        assert not [name for name in archive.files if "deg" in name or "rotary" in name]


@pytest.mark.parametrize("write", [write_csv, write_npz])
@pytest.mark.parametrize("at", [[1, 2, 3], [0, 0, 250, 500], list(range(500))])
def test_bytes_do_not_depend_on_the_blocks_or_the_hour(tmp_path, write, at, monkeypatch):
    command = trajectory()
    write(tmp_path / "whole", [command])
    monkeypatch.setattr("time.time", lambda: 2e9)
    write(tmp_path / "blocks", iter(cut(command, at)))
    assert (tmp_path / "whole").read_bytes() == (tmp_path / "blocks").read_bytes()


@pytest.mark.parametrize(("write", "signal"), [(write_csv, "position"), (write_npz, "acceleration")])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_value_that_is_not_finite_is_named_and_nothing_is_written(tmp_path, write, signal, value):
    command = trajectory()
    values = getattr(command, signal).copy()
    values[123, 1] = value
    with pytest.raises(InfeasibleError, match=rf"{signal} of Y is {value} at t = 0\.123 s"):
        write(tmp_path / "out", cut(replace(command, **{signal: values}), [100]))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("write", [write_csv, write_npz])
def test_a_bit_that_flips_on_the_disk_is_seen_before_anybody_reads_it(tmp_path, write, monkeypatch):
    original = os.write

    def flip(descriptor, data):
        wrong = bytearray(data)
        if len(wrong) > 4000:
            wrong[3000] ^= 1
        return original(descriptor, wrong)

    monkeypatch.setattr(os, "write", flip)
    with pytest.raises(OutputError, match="read back"):
        write(tmp_path / "out", [trajectory()])
    assert list(tmp_path.iterdir()) == []


def test_standard_output_gets_the_same_bytes(tmp_path):
    command = trajectory()
    write_csv(tmp_path / "out.csv", [command])
    write_npz(tmp_path / "out.npz", [command])
    text, archive = io.BytesIO(), io.BytesIO()
    stream_csv(text.write, [command])
    stream_npz(archive, [command])
    assert text.getvalue() == (tmp_path / "out.csv").read_bytes()
    assert archive.getvalue() == (tmp_path / "out.npz").read_bytes()
