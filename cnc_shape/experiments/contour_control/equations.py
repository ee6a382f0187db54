"""Sections 2 to 4 of paper 004: the Jacobian, the estimate of the contour error, the drives."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.experiments.contour_control.rigs import CUBIC, PLANTS, RAILS, SHOWN
from cnc_shape.experiments.experiment import Row, Table
from cnc_shape.joints import joints_of
from cnc_shape.kinematics.cubic_parallel import reciprocal_jacobian
from cnc_shape.kinematics.cubic_parallel_screws import (
    origin_jacobian,
    screw_jacobian,
    screw_jacobian_as_printed,
)
from cnc_shape.plant import discretise

EXACT: Final = 1e-9  # what a closed form and a computed number that agree may differ by
PRINTED: Final = 5e-4  # what is shown of a number that cannot be rounding
POSES: Final = 50
REACH, TILT = 60.0, 0.25  # mm, rad: of the poses tried
SAMPLE_TIME: Final = 1e-3  # s


def jacobian_table() -> Table:
    """Section 2: eqs 1 to 5."""
    minus: list[float] = []
    plus: list[float] = []
    origin: list[float] = []
    for position, rotation in _poses():
        exact = np.linalg.inv(reciprocal_jacobian(RAILS, position, rotation))
        size = np.abs(exact).max()
        minus.append(np.abs(screw_jacobian(RAILS, position, rotation) - exact).max() / size)
        printed = screw_jacobian_as_printed(RAILS, position, rotation)
        plus.append(np.abs(printed - exact).max() / size)
        origin.append(np.abs(origin_jacobian(RAILS, position, rotation) - exact).max() / size)
    linear = [1e3 * _linear_error(lag) for lag in (0.2, 0.8)]
    at = f"largest over {POSES} poses within {REACH:g} mm and {TILT:g} rad of home, seeded"
    return Table(
        "Section 2, eqs (1)-(5): the Jacobian",
        (
            Row("eq 4, first line: A - B D⁻¹ C against the exact Jacobian", "-", 0.0, max(minus), EXACT,
                "relative to the largest element; exact: the inverse of the Jacobian by reciprocal "
                f"screws; {at}"),
            Row("eq 4, second line: A + B D⁻¹ C against the exact Jacobian", "-", 0.0, min(plus), PRINTED,
                "largest error relative to the largest element, at the best of the poses: the sign is "
                "wrong, b = -D⁻¹ C a follows from C a + D b = 0"),
            Row("eq 4 with screws about the program's origin", "-", None, max(origin), SHOWN,
                f"largest error relative to the largest element; {at}: that is the velocity of another "
                "point"),
            Row("eq 5 at a following error of 0.2 mm: e off by", "µm", None, linear[0], SHOWN,
                "largest |J φ - e| over directions and places of the fan's plane within 40 mm"),
            Row("eq 5 at a following error of 0.8 mm: e off by", "µm", None, linear[1], SHOWN,
                "the same; what a loop of 20 1/s lags behind at 16 mm/s"),
        ),
        "The machine of Fig. 3 is a sketch without measures. Ours has six sliders on rails along the "
        "normals of three faces of a cube, two a face; universal joints, links of 300 mm, ball joints 60 "
        "mm from the platform's centre, and the tool 60 mm below it. Which joints of a chain are active, "
        "and about which point the screws are taken, the paper leaves open; eq 5 needs the tool's tip. Its "
        "indices of eqs 1 and 2 mix chain and joint: what is meant is the same sum along every chain, the "
        "first less each other one. J takes joint rates to the tool's, the inverse of what most texts on "
        "parallel machines call so.",
    )  # fmt: skip


def _poses() -> list[tuple[FloatArray, FloatArray]]:
    random = np.random.default_rng(4)
    found: list[tuple[FloatArray, FloatArray]] = []
    for _ in range(POSES):
        position = random.uniform(-REACH, REACH, 3)
        found.append((position, Rotation.from_rotvec(random.uniform(-TILT, TILT, 3)).as_matrix()))
    return found


def _linear_error(lag: float) -> float:
    """Largest |J phi - e| (mm) of a tool that is `lag` mm off, moved without turning in the plane z = 0."""
    side = np.linspace(-40.0, 40.0, 5)
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    x, y, phi = (grid.ravel() for grid in np.meshgrid(side, side, angle))
    still = np.zeros((x.size, 4))
    told = frozen(np.column_stack([x, y, still]))
    off = np.column_stack([lag * np.cos(phi), lag * np.sin(phi), still])
    joints = CUBIC.kinematics.inverse(told) - CUBIC.kinematics.inverse(frozen(told - off))
    estimate = np.linalg.solve(CUBIC.kinematics.inverse_jacobian(told), joints[:, :, None])[:, :3, 0]
    return float(np.linalg.norm(estimate - off[:, :3], axis=1).max())


def estimate_table() -> Table:
    """Section 3: eqs 6 to 13."""
    random = np.random.default_rng(13)
    e = random.normal(size=(200, 3))
    t = random.normal(size=(200, 3))
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    along = (e * t).sum(axis=1)
    root = np.sqrt((e**2).sum(axis=1) - along**2)
    n = (-along / root)[:, None] * t + e / root[:, None]
    estimate = (n * e).sum(axis=1)[:, None] * n
    at = "largest over 200 pairs of e and t, seeded"
    return Table(
        "Section 3, eqs (6)-(13): the estimate of the contour error",
        (
            Row("eq 7, <n, t>", "-", 0.0, float(np.abs((n * t).sum(axis=1)).max()), EXACT,
                f"n by eqs 6 and 12; {at}"),
            Row("eq 8, ‖n‖ - 1", "-", 0.0, float(np.abs(np.linalg.norm(n, axis=1) - 1.0).max()), EXACT, at),
            Row("eq 11, pairs with <n, e> below 0", "-", 0.0,
                float(((n * e).sum(axis=1) < 0.0).sum()), 0.0, at),
            Row("eq 13 against e - <e, t> t", "-", 0.0,
                float(np.abs(estimate - (e - along[:, None] * t)).max()), EXACT,
                f"what the loop computes: the same, but not 0/0 where e lies along t; {at}"),
        ),
        "The equations are right. Two things about their use are not: the length of the estimate is fed to "
        "the controller, and a length has no sign, so an integral term would wind up (see the table of "
        "variants); and n has six components, mm and rad in one norm. Ours takes the three of position.",
    )  # fmt: skip


def drives_table() -> Table:
    """Section 4: Table 1."""
    plant = discretise(joints_of(CUBIC.machine, CUBIC.kinematics).drives, SAMPLE_TIME)
    decay, answer = plant.transition[:, 1, 1], plant.held[:, 1]
    rows: list[Row] = []
    for k, (drive, a, b) in enumerate(zip(PLANTS, decay.tolist(), answer.tolist(), strict=True), 1):
        rows += [
            Row(f"Plant{k}, τ", "s", drive.time_constant, -SAMPLE_TIME / float(np.log(a)), 5e-5,
                "back from the loop's discrete drive, 1 ms"),
            Row(f"Plant{k}, kv", "-", drive.gain, b / (1.0 - a), 5e-5,
                "velocity in the end over what was asked"),
        ]  # fmt: skip
    return Table(
        "Section 4, Table 1: the drives",
        tuple(rows),
        "The paper does not say whether k/(τs + 1) leads to a velocity or to a position. Only a velocity "
        "drive, with an integrator after it, makes sense: without one a proportional loop of 20 1/s would "
        "stand 5 % short of where it is told to be. The equation bears the number 2 a second time; it "
        "should be 14.",
    )
