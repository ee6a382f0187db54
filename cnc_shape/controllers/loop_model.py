"""The closed loop near a pose, linearised: what its stability and its margins are read from.

One tick of the servo loop (`controllers.loop`) is linear in the joint errors once pose and tangent are held:

    e = J phi,  eps = (1 - t t') e,  w = Kc eps + Ki I + Kd (eps - eps_before) / T
    u = Kp phi + J^-1 (w; Ko e_w),  I+ = (1 - t t') (I + T eps)

with joint errors phi, e_w the rotary part of e, and J^-1 the inverse Jacobian. The integral that acts is the
one before this tick's error is added.

Three parts of the loop are no loop, and are left out: joints of ideal drives, which have no error; what of
the integral lies along the path; and what of it lies where no drive of this machine can make an error. Each
would leave a pole at z = 1 that nothing ever moves.

Whatever the estimator, next to a straight path its contour error is the tangent's; what the path's curvature
adds is left out, as is that pose and tangent change.

Of the scalar form, which is not linear, the proportional part is taken: it acts as that of the vector form.

A servo motor runs several ticks of its velocity loop in one tick of the loop; see `servo_model`. Its velocity
gain is the one it starts with: `servo_model.at_ratio` holds it elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cnc_shape.arrays import FloatArray, IntArray
from cnc_shape.controllers.control import Control
from cnc_shape.controllers.cross_coupling import CrossCoupling, Form
from cnc_shape.controllers.servo_model import LinearDrive, lifted
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, Drive, IdealDrive, ServoMotor
from cnc_shape.plant import discretise

NO_REACH = 1e-9  # -, share of the largest contour error below which the drives cannot make one that way
UNBOUNDED = Limits(np.inf, np.inf)


@dataclass(frozen=True, eq=False, slots=True)
class LoopModel:
    """The loop of j drives, none ideal, of up to s states each, at n pairs of pose and tangent."""

    sample_time: float  # s
    delay_samples: int
    coupling: CrossCoupling  # in vector form
    gains: FloatArray  # (j,) 1/s, of the position loops
    drives: FloatArray  # (j,s,s) transition of position and all else; the position moves nothing but itself
    held: FloatArray  # (j,s) answer to a command held over the sample
    orders: IntArray  # (j,) states in use
    across: FloatArray  # (n,3,j) contour error per joint error
    back: FloatArray  # (n,j,3) joint velocity per Cartesian velocity
    turn: FloatArray  # (n,j,j) joint velocity of the orientation term per joint error
    lever: FloatArray  # (n,j) mm that the tool moves per unit of a joint; 1 where a joint does not move it
    reach: FloatArray  # (n,3,3) projection onto the contour errors that the drives can make

    def __len__(self) -> int:
        return len(self.across)

    @property
    def states(self) -> int:
        """Of the closed loop."""
        remembered = 3 * (self.coupling.integral != 0.0) + 3 * (self.coupling.derivative != 0.0)
        return int(self.orders.sum()) + self.delay_samples * self.gains.size + remembered


def loop_model(
    drives: Sequence[Drive], control: Control, inverse_jacobians: FloatArray, tangents: FloatArray
) -> LoopModel:
    """Linearise a loop at pairs of pose and tangent.

    Parameters
    ----------
    drives
        Those of all joints. Joints beyond the columns of the Jacobians are axes by themselves.
    control
        The loop.
    inverse_jacobians
        Joint rates per axis rates at every pose, (n,c,c), invertible; x, y and z first.
    tangents
        Unit vectors along the path, (n,3).
    """
    rows, size = inverse_jacobians.shape[:2]
    linear, joints = min(3, size), len(drives)
    forward = np.linalg.inv(inverse_jacobians)
    made, back = np.zeros((rows, 3, joints)), np.zeros((rows, joints, 3))
    made[:, :linear, :size] = forward[:, :linear]
    back[:, :size, :linear] = inverse_jacobians[:, :, :linear]
    coupling = _in_vector_form(control.cross_coupling)
    turn = np.zeros((rows, joints, joints))
    turn[:, :size, :size] = coupling.orientation * inverse_jacobians[:, :, linear:] @ forward[:, linear:]
    lagging = np.array([lags(drive) for drive in drives], dtype=bool)
    across = (made - tangents[:, :, None] * (tangents[:, None, :] @ made))[:, :, lagging]
    moved = np.sqrt((made[:, :, lagging] ** 2).sum(axis=1))
    gains = np.array(control.gains(joints), dtype=np.float64)
    known = {drive: _linear(drive, control) for drive in drives if lags(drive)}
    linears = [known[drive] for drive in drives if lags(drive)]
    orders = [drive.held.size for drive in linears]
    most = max(orders, default=1)
    transition, held = np.zeros((len(linears), most, most)), np.zeros((len(linears), most))
    for row, (order, drive) in enumerate(zip(orders, linears, strict=True)):
        transition[row, :order, :order], held[row, :order] = drive
    return LoopModel(
        control.sample_time,
        control.delay_samples,
        coupling,
        gains[lagging],
        transition,
        held,
        np.array(orders, dtype=np.int64),
        across,
        back[:, lagging],
        turn[:, lagging][:, :, lagging],
        np.where(moved > NO_REACH, moved, 1.0),
        _reach(across),
    )


def open_loop(model: LoopModel) -> tuple[FloatArray, FloatArray, FloatArray]:
    """State space from the drives' input to the command that comes back: ``x+ = A x + B u, u = C x``.

    States: positions of the drives (j), their second states (j: of a lag the velocity), the third of those
    that have one, and so on; where the controller has them, the integral (3) and the contour error before
    (3); the commands on their way, oldest first (j each).
    Returns A (n,s,s), B (s,j) and C (n,j,s).
    """
    rows, joints, late = len(model), model.gains.size, model.delay_samples
    coupling, period = model.coupling, model.sample_time
    size = model.states
    A, B, told = np.zeros((rows, size, size)), np.zeros((size, joints)), np.zeros((rows, joints, size))
    j = np.arange(joints)
    for joint, order in enumerate(model.orders):
        own = np.array([_place(model.orders, joint, row) for row in range(order)])
        B[own, joint] = model.held[joint, : own.size]
        A[:, own[:, None], own] = model.drives[joint, : own.size, : own.size]
    differential = coupling.derivative / period
    told[:, :, :joints] = -model.turn - (coupling.proportional + differential) * model.back @ model.across
    told[:, j, j] -= model.gains
    place = int(model.orders.sum())
    if coupling.integral != 0.0:
        integral = slice(place, place + 3)
        told[:, :, integral] = coupling.integral * model.back
        A[:, integral, integral] = model.reach
        A[:, integral, :joints] = -period * model.across
        place += 3
    if coupling.derivative != 0.0:
        before = slice(place, place + 3)
        told[:, :, before] = -differential * model.back
        A[:, before, :joints] = -model.across
        place += 3
    if not late:
        return A, B, told
    A[:, size - joints :] = told
    A[:, place + np.arange((late - 1) * joints), place + joints + np.arange((late - 1) * joints)] = 1.0
    heard = np.zeros((rows, joints, size))
    heard[:, j, place + j] = 1.0
    return A, B, heard


def loop_transfer(model: LoopModel, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Loop transfer matrices L(z) at the drives' inputs, (n,f,j,j): ``u = -L u`` closes the loop.

    z (f,), off the poles of the loop.
    """
    coupling, period = model.coupling, model.sample_time
    controller = (
        coupling.proportional
        + coupling.integral * period / (z - 1.0)
        + coupling.derivative * (1.0 - 1.0 / z) / period
    )
    # position per command of a drive, whose transition is [[1, be], [0, al]], be a row where al is a matrix
    if model.held.shape[1] == 2:
        moving = model.held[:, 1:] / (z[:, None, None] - model.drives[:, 1, 1:])
    else:
        inner = z[:, None, None, None] * np.eye(model.held.shape[1] - 1) - model.drives[:, 1:, 1:]
        moving = np.linalg.solve(inner, model.held[:, 1:, None])[..., 0]
    drive = (model.held[:, 0] + (model.drives[:, 0, 1:] * moving).sum(axis=-1)) / (z[:, None] - 1.0)
    answer = (model.back @ model.across)[:, None] * controller[:, None, None]
    answer = answer + (np.diag(model.gains) + model.turn)[:, None]
    return answer * (drive / z[:, None] ** model.delay_samples)[:, None, :]


def closed_loop(model: LoopModel) -> FloatArray:
    """Transition of the closed loop from tick to tick, (n,s,s)."""
    A, B, C = open_loop(model)
    return A + B @ C


def loop_matrix(
    drives: Sequence[Drive], control: Control, inverse_jacobian: FloatArray, tangent: FloatArray
) -> FloatArray:
    """Transition of the closed loop at a pose and a tangent, (s,s); arguments as `loop_model`, one row."""
    return closed_loop(loop_model(drives, control, inverse_jacobian[None], tangent[None]))[0]


def poles(
    drives: Sequence[Drive], control: Control, inverse_jacobian: FloatArray, tangent: FloatArray
) -> NDArray[np.complex128]:
    """Poles in z of the closed loop at a pose and a tangent, (s,); arguments as `loop_model`, one row."""
    found = np.linalg.eigvals(loop_matrix(drives, control, inverse_jacobian, tangent))
    return found.astype(np.complex128)


def pole_radius(model: LoopModel) -> FloatArray:
    """Largest |z| of the poles, (n,); 0 without a loop."""
    if not model.gains.size:
        return np.zeros(len(model))
    return np.abs(np.linalg.eigvals(closed_loop(model))).max(axis=1)


def with_coupling(model: LoopModel, factor: float) -> LoopModel:
    """Return the model with the gains of the controller across the path times `factor`, -."""
    coupling = model.coupling
    grown = replace(
        coupling,
        proportional=factor * coupling.proportional,
        integral=factor * coupling.integral,
        derivative=factor * coupling.derivative,
    )
    return replace(model, coupling=grown)


def joint_of(model: LoopModel, joint: int, gain: float) -> LoopModel:
    """Return the loop of one joint by itself, under a position gain in 1/s."""
    return replace(
        model,
        coupling=CrossCoupling(0.0),
        gains=np.array([gain]),
        drives=model.drives[joint : joint + 1],
        held=model.held[joint : joint + 1],
        orders=model.orders[joint : joint + 1],
        across=np.zeros((1, 3, 1)),
        back=np.zeros((1, 1, 3)),
        turn=np.zeros((1, 1, 1)),
        lever=np.ones((1, 1)),
        reach=np.zeros((1, 3, 3)),
    )


def without_turn(model: LoopModel) -> LoopModel:
    """Return the model without the orientation term."""
    return replace(model, turn=np.zeros_like(model.turn))


def rows_of(model: LoopModel, rows: NDArray[np.intp]) -> LoopModel:
    """Return the model at some of its pairs of pose and tangent."""
    return replace(
        model,
        across=model.across[rows],
        back=model.back[rows],
        turn=model.turn[rows],
        lever=model.lever[rows],
        reach=model.reach[rows],
    )


def _place(orders: IntArray, joint: int, row: int) -> int:
    """Where among the states of all drives one of a joint stands."""
    return int(np.minimum(orders, row).sum() + (orders[:joint] > row).sum())


def lags(drive: Drive) -> bool:
    """Whether a drive is ever elsewhere than it is told to be."""
    return not isinstance(drive, IdealDrive)


def _linear(drive: Drive, control: Control) -> LinearDrive:
    """A drive from sample to sample."""
    if isinstance(drive, ServoMotor):
        return lifted(drive, control)
    plant = discretise([Axis("", UNBOUNDED, drive)], control.sample_time)
    return LinearDrive(plant.transition[0], plant.held[0])


def _in_vector_form(coupling: CrossCoupling | None) -> CrossCoupling:
    if coupling is None:
        return CrossCoupling(0.0)
    if coupling.form is Form.SCALAR:
        return replace(coupling, form=Form.VECTOR, integral=0.0, derivative=0.0)
    return coupling


def _reach(across: FloatArray) -> FloatArray:
    """Projection onto the span of the columns of `across`, (n,3,3)."""
    if not across.shape[2]:
        return np.zeros((len(across), 3, 3))
    left, size, _ = np.linalg.svd(across, full_matrices=False)
    left = left * (size > NO_REACH * size[:, :1])[:, None, :]
    return left @ left.transpose(0, 2, 1)
