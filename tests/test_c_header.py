"""Shapers as a C header: it compiles, filters as we do, and reads back to the last bit."""

from __future__ import annotations

import re
import shutil
import subprocess

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cnc_shape.modes import Mode
from cnc_shape.shapers import NONE, cascade, umzv, zv, zvd
from cnc_shape.shapers.discretisation import Interpolation, discretise
from cnc_shape.shapers.live import filters, shape_samples
from cnc_shape.writers.c_header import c_header

MODES = {"x": (Mode(33.7, 0.02),), "y": (Mode(30.0, 0.02), Mode(100.0, 0.01))}
SHAPERS = {"x": zvd(MODES["x"][0]), "y": cascade(MODES["y"])}
T = 0.83e-3
PROGRAM = r"""
#include <stdio.h>
#include "shaper.h"
#include "shaper.h"

static void filter(const double *taps, int count, const double *in, int samples)
{
    for (int n = 0; n < samples + count - 1; n++) {
        double sum = 0.0;
        for (int k = 0; k < count; k++) {
            int at = n - k;
            sum += taps[k] * in[at < 0 ? 0 : at >= samples ? samples - 1 : at];
        }
        printf("%.17g\n", sum);
    }
}

int main(void)
{
    double in[4096];
    int samples = 0;
    while (samples < 4096 && scanf("%lf", &in[samples]) == 1)
        samples++;
    printf("%.17g\n", CNC_SHAPE_SAMPLE_TIME_S);
    filter(cnc_shape_x_taps, CNC_SHAPE_X_TAPS, in, samples);
    filter(cnc_shape_y_taps, CNC_SHAPE_Y_TAPS, in, samples);
    return (int)(sizeof cnc_shape_x_times_s / sizeof(double)) - CNC_SHAPE_X_IMPULSES;
}
"""


def header(way=Interpolation.EXACT) -> str:
    wanted = filters(SHAPERS, ("x", "y"), T, way, MODES)
    return c_header(SHAPERS, dict(zip(wanted.axes, wanted.taps, strict=True)), MODES)


def array(text: str, name: str) -> np.ndarray:
    """Numbers of an array of the header."""
    size, body = re.search(rf"static const double {name}\[(\w+)\] = \{{([^}}]*)\}};", text).groups()
    values = np.array(body.split(","), dtype=float)
    assert values.size == int(macro(text, size))
    return values


def macro(text: str, name: str) -> str:
    return re.search(rf"^#define {name} (\S+)$", text, re.MULTILINE)[1]


@pytest.mark.parametrize("way", Interpolation)
def test_reads_back_to_the_last_bit(way):
    text = header(way)
    wanted = filters(SHAPERS, ("x", "y"), T, way, MODES)
    for axis, taps in zip(wanted.axes, wanted.taps, strict=True):
        assert_array_equal(array(text, f"cnc_shape_{axis}_times_s"), SHAPERS[axis].times)
        assert_array_equal(array(text, f"cnc_shape_{axis}_amplitudes"), SHAPERS[axis].amplitudes)
        assert_array_equal(array(text, f"cnc_shape_{axis}_taps"), taps.weights)
        assert float(macro(text, f"CNC_SHAPE_{axis.upper()}_DURATION_S")) == SHAPERS[axis].duration
        assert float(macro(text, f"CNC_SHAPE_{axis.upper()}_DELAY_S")) == taps.delay
    assert float(macro(text, "CNC_SHAPE_SAMPLE_TIME_S")) == T


def test_a_program_that_includes_it_filters_as_we_do(tmp_path):
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("no C compiler (cc, gcc or clang) on this machine")
    (tmp_path / "shaper.h").write_text(header())
    (tmp_path / "main.c").write_text(PROGRAM)
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"]
    subprocess.run([compiler, *strict, "main.c", "-o", "main"], cwd=tmp_path, check=True)
    samples = np.random.default_rng(8).normal(size=200)
    done = subprocess.run(
        [tmp_path / "main"], input="\n".join(map(repr, samples.tolist())), capture_output=True, text=True, check=True
    )  # fmt: skip
    sample_time, *numbers = map(float, done.stdout.split())
    assert sample_time == T
    at = 0
    for axis in ("x", "y"):
        taps = filters(SHAPERS, ("x", "y"), T, Interpolation.EXACT, MODES).taps["xy".index(axis)]
        count = len(samples) + taps.weights.size - 1
        padded = np.pad(samples, taps.weights.size - 1, mode="edge")
        assert_allclose(numbers[at : at + count], np.convolve(padded, taps.weights, "valid"), atol=1e-14)
        at += count
    assert at == len(numbers)
    both = shape_samples(
        np.column_stack([samples, samples]), filters(SHAPERS, ("x", "y"), T, Interpolation.EXACT, MODES)
    )
    assert_allclose(numbers[: len(samples)], both[: len(samples), 0], atol=1e-14)


def test_comments_tell_duration_and_vibration():
    text = header()
    assert "Axis X: 3 impulses over 29.68 ms" in text
    assert re.search(r"V at 100 Hz, damping ratio 0.01: \S+e-1\d by the impulses, \S+e-1\d by the taps", text)
    rounded = header(Interpolation.ROUNDED)
    assert re.search(
        r"V at 100 Hz, damping ratio 0.01: \S+e-1\d by the impulses, 0\.\d+ by the taps", rounded
    )
    assert max(map(len, text.splitlines())) <= 104


def test_without_an_axis_and_without_modes():
    shaper = umzv(MODES["x"][0])
    text = c_header({None: shaper}, {None: discretise(shaper, T, Interpolation.LINEAR)}, {})
    assert_array_equal(array(text, "cnc_shape_amplitudes"), shaper.amplitudes)
    assert "All axes: 3 impulses" in text
    assert "Residual" not in text


def test_what_does_not_belong_together_is_a_bug():
    shaper = zv(MODES["x"][0])
    fine, coarse = (discretise(shaper, step, Interpolation.LINEAR) for step in (T, 2 * T))
    one = discretise(NONE, T, Interpolation.LINEAR)
    for shapers, taps in (
        ({}, {}),
        ({"x": shaper}, {"y": fine}),
        ({"x": shaper, "y": shaper}, {"x": fine, "y": coarse}),
    ):
        with pytest.raises(ValueError, match=r"shapers|intervals"):
            c_header(shapers, taps, {})
    assert "cnc_shape_z_taps" in c_header({"z": NONE}, {"z": one}, {})
