"""Shapers as a C header: constant arrays for one's own controller, with taps at its sample rate.

The header is C99, needs nothing else and does nothing: impulses for who places them himself, and taps that a
FIR filter takes as they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap

from cnc_shape.arrays import FloatArray
from cnc_shape.modes import Mode
from cnc_shape.shapers.analysis import residual_vibration
from cnc_shape.shapers.discretisation import Taps
from cnc_shape.shapers.shaper import Shaper

GUARD = "CNC_SHAPE_SHAPER_H"
WIDTH = 100  # columns


def c_header(
    shapers: Mapping[str | None, Shaper],
    taps: Mapping[str | None, Taps],
    modes: Mapping[str | None, Sequence[Mode]],
) -> str:
    """Write shapers and their taps as a C99 header.

    Parameters
    ----------
    shapers
        One shaper per axis name, or one under None for all axes.
    taps
        The same shapers on a sample grid, all on the same.
    modes
        The modes of each, for the comments.

    Returns
    -------
    str
        The header. Names begin with ``cnc_shape_x_`` for axis x, and with ``cnc_shape_`` without an axis;
        numbers read back to the last bit.

    Raises
    ------
    ValueError
        Shapers and taps of unlike axes or unlike sample times, or none.
    """
    if not shapers or shapers.keys() != taps.keys():
        raise ValueError(f"{list(shapers)=}, {list(taps)=}")
    intervals = {tap.sample_time for tap in taps.values()}
    if len(intervals) != 1:
        raise ValueError(f"{intervals=}")
    head = [
        *_comment(
            "Input shapers by cnc-shape. At every sample n, for each axis:",
            "",
            "    out[n] = taps[0] * in[n] + taps[1] * in[n - 1] + ... + taps[TAPS - 1] * in[n - TAPS + 1]",
            "",
            "with in[n] = in[0] for n < 0: keep the last TAPS samples in a ring and fill it with the first. "
            "The taps are for the sample time below and no other, and they make the delays between samples, "
            "too. They add up to 1: what rests stays where it is, and TAPS - 1 samples after the input has "
            "come to rest the output has.",
        ),
        f"#ifndef {GUARD}",
        f"#define {GUARD}",
        "",
        f"#define CNC_SHAPE_SAMPLE_TIME_S {intervals.pop()!r}",
        "",
    ]
    parts = [line for axis in shapers for line in _axis(axis, shapers[axis], taps[axis], modes.get(axis, ()))]
    return "\n".join([*head, *parts, f"#endif /* {GUARD} */", ""])


def _axis(axis: str | None, shaper: Shaper, taps: Taps, modes: Sequence[Mode]) -> list[str]:
    name = "cnc_shape_" if axis is None else f"cnc_shape_{axis.lower()}_"
    macro = name.upper()
    told = [
        f"{'All axes' if axis is None else f'Axis {axis.upper()}'}: {shaper.times.size} impulses over "
        f"{1e3 * shaper.duration:.4g} ms, on steady motion {1e3 * shaper.delay:.4g} ms late; as taps "
        f"{1e3 * taps.delay:.4g} ms."
    ]
    for mode in modes:
        ideal, real = (float(residual_vibration(each, mode)) for each in (shaper, taps.shaper))
        told.append(
            f"Residual vibration V at {mode.natural_frequency:.6g} Hz, damping ratio "
            f"{mode.damping_ratio:.4g}: {ideal:.2g} by the impulses, {real:.2g} by the taps."
        )
    return [
        *_comment(*told),
        f"#define {macro}IMPULSES {shaper.times.size}",
        f"#define {macro}TAPS {taps.weights.size}",
        f"#define {macro}DURATION_S {shaper.duration!r}",
        f"#define {macro}DELAY_S {taps.delay!r}",
        "",
        *_array(f"{name}times_s", f"{macro}IMPULSES", shaper.times),
        *_array(f"{name}amplitudes", f"{macro}IMPULSES", shaper.amplitudes),
        *_array(f"{name}taps", f"{macro}TAPS", taps.weights),
        "",
    ]


def _comment(*paragraphs: str) -> list[str]:
    lines: list[str] = []
    for text in paragraphs:
        indent = " " * (len(text) - len(text.lstrip()))
        lines += wrap(text.lstrip(), WIDTH - 3, initial_indent=indent, subsequent_indent=indent) or [""]
    return [f"{' *' if k else '/*'} {line}".rstrip() for k, line in enumerate(lines)] + [" */"]


def _array(name: str, size: str, values: FloatArray) -> list[str]:
    numbers = ", ".join(map(repr, values.tolist()))
    body = wrap(numbers, WIDTH, initial_indent="    ", subsequent_indent="    ")
    return [f"static const double {name}[{size}] = {{", *body, "};"]
