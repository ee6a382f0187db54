"""Decimal numbers from bytes: every bit as `float` has it, or left to it."""

from __future__ import annotations

import re
import struct
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cnc_shape.kernels.decimals import decimal

NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")


def kernel(text: str, *, blanks: bool = False, exponents: bool = False) -> tuple[float, int, bool]:
    return decimal(np.frombuffer(text.encode(), dtype=np.uint8), 0, blanks, exponents)


def bits(value: float) -> bytes:
    return struct.pack("<d", value)


digits = st.text(alphabet="0123456789", max_size=12)
plain = st.tuples(st.sampled_from(["", "-", "+"]), digits, st.sampled_from(["", "."]), digits).map("".join)


@given(plain)
@settings(max_examples=1500)
def test_short_numbers_are_what_float_makes_of_them(text):
    value, end, good = kernel(text)
    if NUMBER.fullmatch(text) is None:
        assert not good
    elif good:
        assert end == len(text)
        assert bits(value) == bits(float(text))
    else:
        assert len(text.lstrip("+-0.").replace(".", "")) > 15


@given(st.floats(min_value=-1e15, max_value=1e15).filter(lambda value: abs(value) > 1e-3))
@settings(max_examples=1500)
def test_the_shortest_text_of_any_float_comes_back(value):
    text = repr(value)
    read, end, good = kernel(text)
    assert good
    assert (end, bits(read)) == (len(text), bits(value))


@given(st.integers((1 << 53) + 1, 10**18 - 1), st.integers(0, 18))
@settings(max_examples=1500)
def test_long_numbers_round_once(whole, places):
    text = f"{whole:019d}"
    text = text[: 19 - places] + "." + text[19 - places :]
    value, _, good = kernel(text)
    assert good == (whole // 10**places < 1 << 53)
    if good:
        assert bits(value) == bits(float(text)) == bits(float(Fraction(whole, 10**places)))


@pytest.mark.parametrize(
    "text",
    [
        "1.00000000000000011",  # beside the middle between 1 and the next float
        "1.00000000000000012",
        "4503599627370497.5",  # a tie: to even
        "4503599627370498.5",
        "0.50000000000000006",
        "9007199254740992",
        "9007199254740991.9",
        "-0.0",
        "000000000000000000000000000001.5",
        "1.50000000000000000000000000000",
    ],
)
def test_numbers_on_the_edge(text):
    value, end, good = kernel(text)
    assert good
    assert (end, bits(value)) == (len(text), bits(float(text)))


@pytest.mark.parametrize(
    "text",
    [
        "", "-", ".", "+.", "e5", "--1", "+-1", "1.0000000000000000001", "12345678901234567890",
        "0." + "0" * 22 + "1", "9007199254740993",
    ],
)  # fmt: skip
def test_what_is_no_number_or_too_long_is_left_alone(text):
    assert not kernel(text)[2]


def test_a_number_ends_where_it_ends():
    assert kernel("1.2.3") == (1.2, 3, True)
    assert kernel("1.5Y2") == (1.5, 3, True)
    assert kernel(" - 1 2\t. 5 Y", blanks=True) == (-12.5, 11, True)
    assert kernel("1 2") == (1.0, 1, True)


@given(st.integers(0, 10**18 - 1), st.integers(-30, 30), st.sampled_from("eE"))
@settings(max_examples=800)
def test_exponents(whole, exponent, letter):
    text = f"{whole}{letter}{exponent:+d}"
    value, end, good = kernel(text, exponents=True)
    if good:
        assert (end, bits(value)) == (len(text), bits(float(text)))
    else:
        assert abs(exponent) > 22 or whole > 1 << 53
    assert kernel(text)[1] == text.index(letter)


@pytest.mark.parametrize("text", ["1e", "1e+", "1e99999", "1e400"])
def test_exponents_that_are_none_or_too_large(text):
    assert not kernel(text, exponents=True)[2]
