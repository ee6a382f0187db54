"""Archives: the same bytes for the same arrays, however they come."""

from __future__ import annotations

import io
import tracemalloc
import zipfile

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from cnc_shape.writers.archive import NO_TIME, Stream, write_archive

VALUES = np.cumsum(np.random.default_rng(0).normal(size=50_000))


def archive(**arrays) -> bytes:
    file = io.BytesIO()
    write_archive(file, arrays)
    return file.getvalue()


@pytest.mark.parametrize("piece", [1000, 16_384, 16_385, 50_000])
def test_a_stream_gives_the_bytes_of_its_array(piece):
    pieces = (VALUES[k : k + piece] for k in range(0, VALUES.size, piece))
    assert archive(a=Stream(VALUES.size, np.float64, pieces)) == archive(a=VALUES)


def test_arrays_read_back_in_their_order_and_without_a_date(monkeypatch):
    monkeypatch.setattr("time.time", lambda: 2e9)
    table, lines = VALUES.reshape(-1, 5), np.arange(7)
    empty = Stream(0, np.float64, iter(()))
    whole = Stream(3, np.int64, iter([np.array([1.0, 2.0]), np.array([3.0])]))
    data = archive(table=table, lines=lines, none=empty, whole=whole)
    with np.load(io.BytesIO(data)) as back:
        assert back.files == ["table", "lines", "none", "whole"]
        assert_array_equal(back["table"], table)
        assert_array_equal(back["lines"], lines)
        assert back["none"].shape == (0,)
        assert back["whole"].dtype == np.int64
        assert_array_equal(back["whole"], [1, 2, 3])
    with zipfile.ZipFile(io.BytesIO(data)) as file:
        assert {entry.date_time for entry in file.infolist()} == {NO_TIME}


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(value):
    pieces = iter([VALUES[:10], np.array([value])])
    with pytest.raises(ValueError, match="speed holds a value that is not a number"):
        archive(speed=Stream(11, np.float64, pieces))
    with pytest.raises(ValueError, match="speed holds"):
        archive(speed=np.array([1.0, value]))


def test_a_stream_of_another_length_is_refused():
    with pytest.raises(ValueError, match="speed has 10 values, not 11"):
        archive(speed=Stream(11, np.float64, iter([VALUES[:10]])))


def test_a_long_stream_takes_the_memory_of_a_piece():
    piece = np.zeros(16_384)
    stream = Stream(piece.size * 100, np.float64, (piece for _ in range(100)))
    tracemalloc.start()
    try:
        archive(a=stream)
        assert tracemalloc.get_traced_memory()[1] < 2_000_000  # of 13 million bytes
    finally:
        tracemalloc.stop()
