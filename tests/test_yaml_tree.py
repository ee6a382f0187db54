"""YAML 1.2 to plain data with places; what is dangerous or meaningless is refused while it is read."""

from __future__ import annotations

import time
from math import inf, isnan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cnc_shape.config.yaml_tree import MAX_BYTES, Place, read_tree, scalar
from cnc_shape.errors import ConfigError


def refusal(text: str | bytes) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        read_tree("m.yaml", text.encode() if isinstance(text, str) else text)
    assert caught.value.hint
    return caught.value


# YAML 1.2.2, section 10.3.2; the comments say what PyYAML makes of them
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001),  # text
        ("1E+2", 100.0),
        (".5", 0.5),
        ("5.", 5.0),
        ("-0.25", -0.25),
        ("010", 10),  # 8
        ("0o10", 8),
        ("0x1F", 31),
        ("true", True),
        ("False", False),
        ("yes", "yes"),  # True
        ("off", "off"),  # False
        ("y", "y"),
        ("1:30", "1:30"),  # 90
        ("1_000", "1_000"),  # 1000
        ("2026-11-25", "2026-11-25"),  # a date
        ("١٢", "١٢"),  # Arabic digits, which float() reads
        ("infinity", "infinity"),  # which float() reads
        ("1e999", inf),
        ("-.inf", -inf),
        ("~", None),
        ("", None),
    ],
)
def test_plain_scalars_follow_the_core_schema(text: str, value: object) -> None:
    found = scalar(text)
    assert found == value
    assert type(found) is type(value)


def test_not_a_number_is_read_as_one() -> None:
    found = scalar(".nan")
    assert isinstance(found, float)
    assert isnan(found)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_float_that_python_writes_is_read_back(value: float) -> None:
    assert scalar(repr(value)) == value


def test_quotes_make_text() -> None:
    assert read_tree("m", b"""{a: "1", b: '1e-3', c: 1}""").value == {"a": "1", "b": "1e-3", "c": 1}


def test_every_key_and_value_has_its_place() -> None:
    tree = read_tree("m", b"axes:\n  y:\n    modes: [{frequency_hz: 30}, {frequency_hz: 100}]\n")
    axis = tree.children["axes"].children["y"]
    second = axis.children["modes"].children[1]
    assert axis.keys["modes"] == Place(3, 5)
    assert second.keys["frequency_hz"] == Place(3, 34)
    assert second.children["frequency_hz"].place == Place(3, 48)


def test_a_byte_order_mark_is_no_part_of_the_text() -> None:
    assert read_tree("m", b"\xef\xbb\xbfname: stage\n").value == {"name": "stage"}


@pytest.mark.parametrize(
    ("text", "line", "column", "reason"),
    [
        ("", 1, 1, "the file is empty"),
        ("# only a comment\n", 2, 1, "the file is empty"),
        ("name: a\nname: b\n", 2, 1, "name is given twice"),
        ("axes: {x: {}, x: {}}", 1, 15, "axes.x is given twice"),
        ("a: &b 1\nc: *b\n", 1, 4, "&b is an anchor"),
        ("a: *b\n", 1, 4, "*b is an alias"),
        ("a: !!python/object:os.system 1\n", 1, 4, "tag:yaml.org,2002:python/object:os.system is a tag"),
        ("a: !!float 1\n", 1, 4, "is a tag"),
        ("? [a, b]\n: 1\n", 1, 3, "a key must be a word"),
        ("a:\nb: 1\n", 1, 3, "a has no value"),
        ("a: [1, ~]\n", 1, 8, "a[1] has no value"),
        ("a: 1\n---\nb: 1\n", 2, 1, "a second document"),
        ("a: 1\n\tb: 2\n", 2, 1, "not valid YAML"),
        ("a: [1, 2\n", 2, 1, "not valid YAML"),
        ('a: "\\UFFFFFFFF"\n', 1, 1, "not valid YAML"),
        ("%YAML 1." + "9" * 5000 + "\n--- 1\n", 1, 1, "not valid YAML"),
        ("a: x\0y\n", 1, 5, "U+0000"),
        ("a: \x1b[31m\n", 1, 4, "U+001B"),
    ],
)
def test_what_is_no_machine_file_is_refused_at_its_place(
    text: str, line: int, column: int, reason: str
) -> None:
    error = refusal(text)
    assert reason in error.reason
    assert (error.line, error.column) == (line, column)


def test_bytes_that_are_no_text_are_refused_at_their_place() -> None:
    error = refusal(b"name: a\naxes: \xff\xfe\n")
    assert "0xff is not UTF-8" in error.reason
    assert (error.line, error.column) == (2, 7)


@pytest.mark.parametrize(
    "text",
    [
        "[" * 200_000,
        "{a: " * 200_000,
        "- " * 200_000,
        "? " * 200_000,
        "[" * 200_000 + "]" * 200_000,
        "\n".join(" " * i + "a:" for i in range(1000)),
        "[" + "1, " * 300_000 + "]",
        "".join(f"k{i}: 1\n" for i in range(100_000)),
        "a" * MAX_BYTES,
        "#" * MAX_BYTES,
        " " * MAX_BYTES,
        "a: '" + "x" * (MAX_BYTES - 10),
    ],
)
def test_no_text_takes_long_to_refuse(text: str) -> None:
    began = time.perf_counter()
    refusal_or_text(text)
    assert time.perf_counter() - began < 2.0  # s


def refusal_or_text(text: str) -> None:
    try:
        tree = read_tree("m.yaml", text.encode())
    except ConfigError as error:
        assert error.hint  # noqa: PT017  # either outcome will do
    else:
        assert isinstance(tree.value, str)


def test_more_than_a_mebibyte_is_not_even_decoded() -> None:
    assert "larger than 1048576 bytes" in refusal(b"\xff" * (MAX_BYTES + 1)).reason


def test_depth_is_counted() -> None:
    assert read_tree("m", b"[" * 16 + b"]" * 16).value
    assert "nested more than 16 deep" in refusal("[" * 18 + "]" * 18).reason
