"""One control step of a gimbal, compiled.

The joints follow the demand (the command seen from the vehicle) with a first-order lag and a rate limit. What
the vehicle's own motion changes of the demand is fed forward, as the gyros of a gimbal do it, so that
steadying lags only where the rate limit or a stop is reached.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import (
    euler_from_quaternion,
    integrate,
    multiply,
    quaternion_from_euler,
    rotate_inverse,
    wrap_pi,
)

Array = NDArray[np.float64]

# constants
INTERVAL_S: Final = 0
GAIN: Final = 1
AXES: Final = 2
LOW: Final = slice(3, 6)  # roll, pitch, yaw
HIGH: Final = slice(6, 9)
ENDLESS: Final = 9
MAX_STEP: Final = 10
JITTER: Final = 11
ENCODER: Final = 12
ATTITUDE_NOISE: Final = 13
GYRO_NOISE: Final = 14
DECAY: Final = 15
DRIVE: Final = slice(16, 19)  # tilt about north and east, heading
CONSTANTS: Final = 19

# state
SETPOINT: Final = slice(0, 3)  # roll, pitch, yaw
SETPOINT_RATES: Final = slice(3, 5)  # pitch, yaw
LEVELLED: Final = 5
YAW_LOCKED: Final = 6
PARKED: Final = 7
ERROR: Final = slice(8, 11)  # of the attitude reference: rotation vector in NED
BODY: Final = slice(11, 15)  # vehicle's attitude at the last step, by the attitude reference
STARTED: Final = 15
HELD: Final = slice(16, 19)  # joints without jitter: roll, pitch, yaw
STATE: Final = 19

NORMALS: Final = 15  # jitter, error, encoders, attitude, gyros

# out
JOINTS: Final = slice(0, 3)
Q_FRD_FROM_GIMBAL: Final = slice(3, 7)
Q_NED_FROM_GIMBAL: Final = slice(7, 11)
RATES: Final = slice(11, 14)
MEASURED_JOINTS: Final = slice(14, 17)
MEASURED_Q_NED: Final = slice(17, 21)
MEASURED_Q_HEADING: Final = slice(21, 25)
MEASURED_RATES: Final = slice(25, 28)
AT_LIMIT: Final = slice(28, 31)
OUT: Final = 31

_ROLL: Final = 0
_PITCH: Final = 1
_YAW: Final = 2
_LOW: Final = LOW.start
_HIGH: Final = HIGH.start
_SETPOINT: Final = SETPOINT.start
_RATES: Final = SETPOINT_RATES.start
_HELD: Final = HELD.start
_ERROR: Final = ERROR.start
_DRIVE: Final = DRIVE.start


@kernel
def _tilted(q: Array, rotation: Array, out: Array) -> None:
    """out = exp(rotation / 2) (x) q: q as a reference with a rotation error in the outer frame has it."""
    error = np.zeros(4)
    error[0] = 1.0
    integrate(error, rotation[0], rotation[1], rotation[2])
    multiply(error, q, out)


@kernel
def body_euler(truth: Array, state: Array, out: Array) -> None:
    """out = roll, pitch, yaw of the vehicle by the gimbal's attitude reference."""
    q = np.zeros(4)
    _tilted(truth[t.Q_NED_FROM_FRD], state[ERROR], q)
    euler_from_quaternion(q, out)


@kernel
def quaternion_from_joints(roll: float, pitch: float, yaw: float, out: Array) -> None:
    """out = q_frd_from_gimbal of Rz(yaw) Rx(roll) Ry(pitch)."""
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    cy, sy = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    # Rx(roll) Ry(pitch), then Rz(yaw) from the left
    w, x, y, z = cr * cp, sr * cp, cr * sp, sr * sp
    out[0] = cy * w - sy * z
    out[1] = cy * x - sy * y
    out[2] = cy * y + sy * x
    out[3] = cy * z + sy * w


@kernel
def joints_from_quaternion(q: Array, axes: float, yaw_now: float, out: Array) -> None:
    """out = joint angles roll, pitch, yaw that give the attitude `q` (frd from gimbal).

    A gimbal of two axes matches only the direction of the optical axis. Where yaw has no effect (two axes:
    straight up or down; three: rolled by 90 degrees) it is not changed.
    """
    w, x, y, z = q[0], q[1], q[2], q[3]
    if axes < 3.0:
        forward = 1.0 - 2.0 * (y * y + z * z)
        right = 2.0 * (x * y + w * z)
        down = 2.0 * (x * z - w * y)
        out[_ROLL] = 0.0
        out[_PITCH] = -math.asin(min(1.0, max(-1.0, down)))
        out[_YAW] = math.atan2(right, forward) if math.hypot(right, forward) > 1e-6 else yaw_now
        return
    out[_ROLL] = math.asin(min(1.0, max(-1.0, 2.0 * (y * z + w * x))))
    sine, cosine = -2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z)
    if math.hypot(sine, cosine) > 1e-6:
        out[_PITCH] = math.atan2(-2.0 * (x * z - w * y), 1.0 - 2.0 * (x * x + y * y))
        out[_YAW] = math.atan2(sine, cosine)
    else:
        out[_PITCH] = 0.0
        out[_YAW] = yaw_now


@kernel
def _demand(body: Array, constants: Array, state: Array, out: Array) -> None:
    """out = joint angles of the command on a vehicle of attitude `body`; without limits."""
    if state[PARKED] > 0.0:
        out[:] = 0.0
        return
    euler = np.zeros(3)
    euler_from_quaternion(body, euler)
    roll, pitch, yaw = state[_SETPOINT], state[_SETPOINT + 1], state[_SETPOINT + 2]
    wanted, relative, inverse = np.zeros(4), np.zeros(4), np.zeros(4)
    if state[LEVELLED] > 0.0:
        if state[YAW_LOCKED] <= 0.0:
            yaw += euler[2]
        quaternion_from_euler(roll, pitch, yaw, wanted)
        inverse[0], inverse[1], inverse[2], inverse[3] = body[0], -body[1], -body[2], -body[3]
        multiply(inverse, wanted, relative)
    else:
        if state[YAW_LOCKED] > 0.0:
            yaw -= euler[2]
        quaternion_from_euler(roll, pitch, yaw, relative)
    joints_from_quaternion(relative, constants[AXES], state[_HELD + _YAW], out)


@kernel
def _limited(joints: Array, constants: Array, near: float, out: Array) -> None:
    """Keep joints within their stops, in place; yaw without end is taken next to `near`. `out`: which."""
    for axis in range(3):
        out[axis] = 0.0
        if axis == _YAW and constants[ENDLESS] > 0.0:
            joints[axis] = near + wrap_pi(joints[axis] - near)
        elif not constants[_LOW + axis] <= joints[axis] <= constants[_HIGH + axis]:
            joints[axis] = min(constants[_HIGH + axis], max(constants[_LOW + axis], joints[axis]))
            out[axis] = 1.0


@kernel
def advance(truth: Array, constants: Array, state: Array, normals: Array, row: int, out: Array) -> None:
    """One control step; the layouts are this module's constants."""
    interval_s = constants[INTERVAL_S]
    body, before, demand = np.zeros(4), np.zeros(3), np.zeros(3)
    held, at_limit = state[HELD], out[AT_LIMIT]
    _tilted(truth[t.Q_NED_FROM_FRD], state[ERROR], body)
    if state[STARTED] <= 0.0:
        for i in range(4):
            state[BODY.start + i] = body[i]
        state[STARTED] = 1.0

    # The joint angles for the old command and the old attitude, then the change since.
    _demand(state[BODY], constants, state, before)
    _limited(before, constants, held[_YAW], at_limit)
    steer = np.zeros(3)
    for axis in range(3):
        steer[axis] = constants[GAIN] * (before[axis] - held[axis])
    state[_SETPOINT + _PITCH] += state[_RATES] * interval_s
    if state[_RATES] != 0.0:
        state[_SETPOINT + _PITCH] = min(
            constants[_HIGH + _PITCH], max(constants[_LOW + _PITCH], state[_SETPOINT + _PITCH])
        )
    state[_SETPOINT + _YAW] = wrap_pi(state[_SETPOINT + _YAW] + state[_RATES + 1] * interval_s)
    _demand(body, constants, state, demand)
    _limited(demand, constants, before[_YAW], at_limit)
    rates = np.zeros(3)
    for axis in range(3):
        step = steer[axis] + demand[axis] - before[axis]
        step = min(constants[MAX_STEP], max(-constants[MAX_STEP], step))
        rates[axis] = step / interval_s
        held[axis] += step
    if constants[ENDLESS] > 0.0:
        held[_YAW] = wrap_pi(held[_YAW])
    for i in range(4):
        state[BODY.start + i] = body[i]

    joints = out[JOINTS]
    for axis in range(3):
        joints[axis] = held[axis] + constants[JITTER] * normals[row, axis]
    if constants[AXES] < 3.0:
        joints[_ROLL] = 0.0
    roll, pitch, yaw = joints[_ROLL], joints[_PITCH], joints[_YAW]
    quaternion_from_joints(roll, pitch, yaw, out[Q_FRD_FROM_GIMBAL])
    multiply(truth[t.Q_NED_FROM_FRD], out[Q_FRD_FROM_GIMBAL], out[Q_NED_FROM_GIMBAL])

    # Angular velocity: the vehicle's, and that of each joint about its axis.
    turning = out[RATES]
    rotate_inverse(out[Q_FRD_FROM_GIMBAL], truth[t.RATES_FRD_RAD_S], turning)
    sr, cr = math.sin(roll), math.cos(roll)
    sp, cp = math.sin(pitch), math.cos(pitch)
    turning[0] += cp * rates[_ROLL] - sp * cr * rates[_YAW]
    turning[1] += rates[_PITCH] + sr * rates[_YAW]
    turning[2] += sp * rates[_ROLL] + cp * cr * rates[_YAW]

    # The reported attitude.
    for axis in range(3):
        out[MEASURED_JOINTS.start + axis] = joints[axis] + constants[ENCODER] * normals[row, 6 + axis]
        out[MEASURED_RATES.start + axis] = turning[axis] + constants[GYRO_NOISE] * normals[row, 12 + axis]
    if constants[AXES] < 3.0:
        out[MEASURED_JOINTS.start + _ROLL] = 0.0
    error, attitude, euler, turn = np.zeros(3), out[MEASURED_Q_NED], np.zeros(3), np.zeros(4)
    for axis in range(3):
        error[axis] = state[_ERROR + axis] + constants[ATTITUDE_NOISE] * normals[row, 9 + axis]
    _tilted(out[Q_NED_FROM_GIMBAL], error, attitude)
    euler_from_quaternion(body, euler)
    quaternion_from_euler(0.0, 0.0, -euler[2], turn)
    multiply(turn, attitude, out[MEASURED_Q_HEADING])

    for axis in range(3):
        state[_ERROR + axis] = (
            constants[DECAY] * state[_ERROR + axis] + constants[_DRIVE + axis] * normals[row, 3 + axis]
        )
