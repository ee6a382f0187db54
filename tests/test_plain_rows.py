"""The compiled way through a table reads what the readable way reads: the same bits, the same complaints."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from programs import from_memory

from cnc_shape.errors import ProgramError
from cnc_shape.readers import source
from cnc_shape.readers.source import ReadingLimits
from cnc_shape.readers.table import join_rows, read_header, read_rows

ALWAYS, NEVER = 0, 1 << 60  # compiled from a length that every text has, or none


def answer(text, compiled_from, rows=100, limits=None):
    """Rows that were handed on, and the complaint that came then, if any."""
    opened = from_memory(text, limits or ReadingLimits(), "path.csv")
    parts = []
    try:
        header = read_header(opened)
        # what came before an error stays
        parts.extend(read_rows(opened, header, rows=rows, compiled_from=compiled_from))
    except ProgramError as error:
        return parts, str(error)
    return parts, None


def assert_two_ways_agree(text, rows=100, limits=None):
    compiled, complaint = answer(text, ALWAYS, rows, limits)
    readable, other = answer(text, NEVER, rows, limits)
    assert complaint == other
    assert [part.line.tolist() for part in compiled] == [part.line.tolist() for part in readable]
    for one, two in zip(compiled, readable, strict=True):
        assert one.values.tobytes() == two.values.tobytes()


CELLS = st.sampled_from(
    ["1", "-2.5", " 3. ", "\t.5", "+1e-3", "1E2", "1e400", "", " ", "nan", "1 2", "-", "0.1234567890123456789", "1e6",
     "-0.0", "1000001", "0.30000000000000004", "1e", "--1", "1_0", "\0", "é", "1;", "1e-400"]
)  # fmt: skip
GOOD = st.floats(-1e5, 1e5).map(repr)
ROWS = st.lists(GOOD | GOOD | GOOD | CELLS, min_size=1, max_size=4).map(",".join)
PAIRS = st.tuples(GOOD, GOOD).map(",".join)
TABLES = st.lists(PAIRS | PAIRS | PAIRS | ROWS | st.sampled_from(["", "  ", "\t", ","]), max_size=12).map(
    "\n".join
)


@given(
    TABLES, st.sampled_from(["x_mm,y_in\n", "time_ms,a_deg\n", "\n \nx_mm,feed_mm_min\n"]), st.integers(1, 5)
)
@settings(max_examples=1000)
def test_random_tables(text, header, rows):
    assert_two_ways_agree(header + text, rows)


@given(st.text(alphabet="0123456789.,-+eE \t\n\r", max_size=60))
@settings(max_examples=600)
def test_any_text(text):
    assert_two_ways_agree("x_mm,y_mm\n1,2\n" + text)


@given(TABLES, st.integers(5, 30))
@settings(max_examples=200)
def test_limits_are_hit_at_the_same_line(text, line_bytes):
    assert_two_ways_agree("x_mm,y_mm\n" + text, limits=ReadingLimits(line_bytes=line_bytes, coordinate=50.0))


@pytest.mark.parametrize("line", [" " * 20, "1.00000000000000,2.0"])
def test_a_line_can_be_too_long(line):
    assert_two_ways_agree("x_mm,y_mm\n1,2\n" + line + "\n3,4", limits=ReadingLimits(line_bytes=15))


def test_pieces_of_any_size(monkeypatch):
    text = "x_mm,y_mm\n1,2\n\n 3.5 , 4e1\n5,6"
    for end in ("\n", "\r\n", "\r"):
        for size in range(1, len(text) + 2):
            monkeypatch.setattr(source, "BLOCK_BYTES", size)
            parts, complaint = answer(text.replace("\n", end), ALWAYS)
            assert complaint is None
            table = join_rows(parts)
            assert table.values.tolist() == [[1, 2], [3.5, 40], [5, 6]]
            assert table.line.tolist() == [2, 4, 5]


@pytest.mark.parametrize("rows", [1, 7, 1000, 10_000])
def test_chunks_of_any_size(rows):
    values = np.random.default_rng(5).normal(scale=100.0, size=(500, 3))
    text = "x_mm,y_mm,z_mm\n" + "".join(f"{x!r},{y:.4f},{z:.2e}\n" for x, y, z in values.tolist())
    parts, _ = answer(text, ALWAYS, rows)
    assert all(part.line.size == rows for part in parts[:-1])
    want = [[float(cell) for cell in line.split(",")] for line in text.splitlines()[1:]]
    np.testing.assert_array_equal(join_rows(parts).values, want)


def test_rows_before_an_error_are_handed_on_first():
    opened = from_memory("x_mm,y_mm\n1,2\n3,4\n5\n", name="path.csv")
    for compiled_from in (ALWAYS, NEVER):
        rows = read_rows(opened, read_header(opened), rows=100, compiled_from=compiled_from)
        assert next(rows).line.tolist() == [2, 3]
        with pytest.raises(ProgramError, match="1 cells, the header has 2"):
            next(rows)
