"""The Jacobian of a platform on rails by the theory of screws: from joint rates to the tool's twist.

Every leg is a chain of six screws from base to platform: one active, the slider, and five passive, the two
axes of the universal joint on the slider and the three of the ball joint on the platform. The twist S of
the platform is the same along every chain. With the active rates a (6,) and all passive rates b (30,),

    S = A a + B b           along the first leg,
    0 = C a + D b           the first leg less each of the five others,

so b = -D^-1 C a, and S = (A - B D^-1 C) a. The paper prints A + B D^-1 C, whose error is 2 A - 2 S.

All screws (v; omega) are referred to the tool centre point. Referred to the program's origin, S would be the
velocity of the platform's point that passes there, v + p x omega.
"""

from __future__ import annotations

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.kinematics.cubic_parallel import Rails, legs_on


def screw_jacobian(rails: Rails, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Twist (v of the tool centre point; omega) per joint rates, (6,6): A - B D^-1 C.

    position (3,) mm; rotation (3,3). All nan where a leg cannot reach.
    """
    A, B, C, D = _chains(rails, position, rotation, position)
    return A - B @ np.linalg.solve(D, C)


def screw_jacobian_as_printed(rails: Rails, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """The Jacobian with the sign of the paper's eq. 4, A + B D^-1 C, (6,6), for comparison."""
    A, B, C, D = _chains(rails, position, rotation, position)
    return A + B @ np.linalg.solve(D, C)


def origin_jacobian(rails: Rails, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Twist per joint rates with screws referred to the program's origin, (6,6), for comparison."""
    A, B, C, D = _chains(rails, position, rotation, np.zeros(3))
    return A - B @ np.linalg.solve(D, C)


def _chains(
    rails: Rails, position: FloatArray, rotation: FloatArray, reference: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """A (6,6), B (6,30), C (30,6) and D (30,30) of the loops that the legs close."""
    legs = legs_on(rails)
    arm = rotation @ legs.point.T
    A, B, C, D = np.zeros((6, 6)), np.zeros((6, 30)), np.zeros((30, 6)), np.zeros((30, 30))
    for i in range(6):
        d = legs.direction[i]
        end = position + arm[:, i]
        c = end - legs.origin[i]
        radicand = legs.length[i] ** 2 - c @ c + (c @ d) ** 2
        q = c @ d - np.sqrt(radicand if radicand > 0.0 else np.nan)
        active = np.concatenate([d, np.zeros(3)])
        passive = _passive(d, legs.origin[i] + q * d - reference, end - reference)
        own = slice(5 * i, 5 * i + 5)
        if i == 0:
            A[:, 0], B[:, own] = active, passive
            C[:, 0], D[:, own] = np.tile(active, 5), np.tile(passive, (5, 1))
        else:
            block = slice(6 * i - 6, 6 * i)
            C[block, i], D[block, own] = -active, -passive
    return A, B, C, D


def _passive(d: FloatArray, slider: FloatArray, end: FloatArray) -> FloatArray:
    """Screws (6,5) of the universal joint at `slider` and the ball joint at `end`, about the reference.

    The first axis of the universal joint is fixed on the slider, square to its rail; which one does not
    matter to the platform.
    """
    least_along: FloatArray = np.eye(3)[np.argmin(np.abs(d))]
    first = np.cross(d, least_along)
    second = np.cross(first, end - slider)
    axes = np.vstack([first / np.linalg.norm(first), second / np.linalg.norm(second), np.eye(3)])
    through = np.vstack([slider, slider, end, end, end])
    return np.hstack([np.cross(through, axes), axes]).T
