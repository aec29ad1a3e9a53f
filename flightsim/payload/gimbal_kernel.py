"""One control step of a gimbal, compiled.

The joints follow the demand (the command seen from the vehicle) with a first-order lag and a rate limit. What
the vehicle's own motion changes of the demand is fed forward, as the gyros of a gimbal do it, so that
steadying lags only where the rate limit or a stop is reached.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.kernels import kernel
from flightsim.foundation.records import Record, Vector3, Vector4
from flightsim.foundation.rotations import (
    euler_from_quaternion,
    integrate,
    multiply,
    quaternion_from_euler,
    rotate_inverse,
    wrap_pi,
)

Array = NDArray[np.float64]
RecordArray = NDArray[np.void]

NORMALS: Final = 15  # jitter, error, encoders, attitude, gyros


@dataclass(frozen=True, slots=True, kw_only=True)
class GimbalConstants:
    """What a gimbal is; joints are roll, pitch, yaw."""

    interval_s: float
    gain: float
    axes: float
    low: Array  # (3,), stops of the joints
    high: Array  # (3,)
    endless: bool  # yaw turns without end
    max_step: float
    jitter: float
    encoder: float
    attitude_noise: float
    gyro_noise: float
    decay: float
    drive: Array  # (3,): tilt about north and east, heading


class GimbalState(Record):
    """What a gimbal carries from step to step."""

    commanded: Vector3  # roll, pitch, yaw
    pitch_rate: float  # of the commanded angles
    yaw_rate: float
    levelled: float
    yaw_locked: float
    parked: float
    error: Vector3  # of the attitude reference: rotation vector in NED
    body: Vector4  # vehicle's attitude at the last step, by the attitude reference
    started: float
    held: Vector3  # joints without jitter


class GimbalOutput(Record):
    """Where a gimbal is and what it reports, as `flightsim.payload.gimbal.Gimbal` describes it."""

    joints: Vector3
    q_frd_from_gimbal: Vector4
    q_ned_from_gimbal: Vector4
    rates: Vector3
    measured_joints: Vector3
    measured_q_ned: Vector4
    measured_q_heading: Vector4
    measured_rates: Vector3
    at_limit: Vector3


_ROLL: Final = 0
_PITCH: Final = 1
_YAW: Final = 2


@kernel
def _tilted(q: Array, rotation: Array, out: Array) -> None:
    """out = exp(rotation / 2) (x) q: q as a reference with a rotation error in the outer frame has it."""
    error = np.zeros(4)
    error[0] = 1.0
    integrate(error, rotation[0], rotation[1], rotation[2])
    multiply(error, q, out)


@kernel
def body_euler(truth: Array, error: Array, out: Array) -> None:
    """out = roll, pitch, yaw of the vehicle by the gimbal's attitude reference, which has an error."""
    q = np.zeros(4)
    _tilted(truth[t.Q_NED_FROM_FRD], error, q)
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
def _demand(body: Array, c: GimbalConstants, s: GimbalState, out: Array) -> None:
    """out = joint angles of the command on a vehicle of attitude `body`; without limits."""
    if s.parked > 0.0:
        out[:] = 0.0
        return
    euler = np.zeros(3)
    euler_from_quaternion(body, euler)
    roll, pitch, yaw = s.commanded[0], s.commanded[1], s.commanded[2]
    wanted, relative, inverse = np.zeros(4), np.zeros(4), np.zeros(4)
    if s.levelled > 0.0:
        if s.yaw_locked <= 0.0:
            yaw += euler[2]
        quaternion_from_euler(roll, pitch, yaw, wanted)
        inverse[0], inverse[1], inverse[2], inverse[3] = body[0], -body[1], -body[2], -body[3]
        multiply(inverse, wanted, relative)
    else:
        if s.yaw_locked > 0.0:
            yaw -= euler[2]
        quaternion_from_euler(roll, pitch, yaw, relative)
    joints_from_quaternion(relative, c.axes, s.held[_YAW], out)


@kernel
def _limited(joints: Array, c: GimbalConstants, near: float, out: Array) -> None:
    """Keep joints within their stops, in place; yaw without end is taken next to `near`. `out`: which."""
    for axis in range(3):
        out[axis] = 0.0
        if axis == _YAW and c.endless:
            joints[axis] = near + wrap_pi(joints[axis] - near)
        elif not c.low[axis] <= joints[axis] <= c.high[axis]:
            joints[axis] = min(c.high[axis], max(c.low[axis], joints[axis]))
            out[axis] = 1.0


@kernel
def advance(
    truth: Array, constants: RecordArray, states: RecordArray, normals: Array, outputs: RecordArray, row: int
) -> None:
    """One control step, with the records of one gimbal."""
    c: GimbalConstants = constants[0]
    s: GimbalState = states[0]
    out: GimbalOutput = outputs[0]
    interval_s = c.interval_s
    body, before, demand = np.zeros(4), np.zeros(3), np.zeros(3)
    held, at_limit = s.held, out.at_limit
    _tilted(truth[t.Q_NED_FROM_FRD], s.error, body)
    if s.started <= 0.0:
        for i in range(4):
            s.body[i] = body[i]
        s.started = 1.0

    # The joint angles for the old command and the old attitude, then the change since.
    _demand(s.body, c, s, before)
    _limited(before, c, held[_YAW], at_limit)
    steer = np.zeros(3)
    for axis in range(3):
        steer[axis] = c.gain * (before[axis] - held[axis])
    s.commanded[_PITCH] += s.pitch_rate * interval_s
    if s.pitch_rate != 0.0:
        s.commanded[_PITCH] = min(c.high[_PITCH], max(c.low[_PITCH], s.commanded[_PITCH]))
    s.commanded[_YAW] = wrap_pi(s.commanded[_YAW] + s.yaw_rate * interval_s)
    _demand(body, c, s, demand)
    _limited(demand, c, before[_YAW], at_limit)
    rates = np.zeros(3)
    for axis in range(3):
        step = steer[axis] + demand[axis] - before[axis]
        step = min(c.max_step, max(-c.max_step, step))
        rates[axis] = step / interval_s
        held[axis] += step
    if c.endless:
        held[_YAW] = wrap_pi(held[_YAW])
    for i in range(4):
        s.body[i] = body[i]

    joints = out.joints
    for axis in range(3):
        joints[axis] = held[axis] + c.jitter * normals[row, axis]
    if c.axes < 3.0:
        joints[_ROLL] = 0.0
    roll, pitch, yaw = joints[_ROLL], joints[_PITCH], joints[_YAW]
    quaternion_from_joints(roll, pitch, yaw, out.q_frd_from_gimbal)
    multiply(truth[t.Q_NED_FROM_FRD], out.q_frd_from_gimbal, out.q_ned_from_gimbal)

    # Angular velocity: the vehicle's, and that of each joint about its axis.
    turning = out.rates
    rotate_inverse(out.q_frd_from_gimbal, truth[t.RATES_FRD_RAD_S], turning)
    sr, cr = math.sin(roll), math.cos(roll)
    sp, cp = math.sin(pitch), math.cos(pitch)
    turning[0] += cp * rates[_ROLL] - sp * cr * rates[_YAW]
    turning[1] += rates[_PITCH] + sr * rates[_YAW]
    turning[2] += sp * rates[_ROLL] + cp * cr * rates[_YAW]

    # The reported attitude.
    for axis in range(3):
        out.measured_joints[axis] = joints[axis] + c.encoder * normals[row, 6 + axis]
        out.measured_rates[axis] = turning[axis] + c.gyro_noise * normals[row, 12 + axis]
    if c.axes < 3.0:
        out.measured_joints[_ROLL] = 0.0
    error, attitude, euler, turn = np.zeros(3), out.measured_q_ned, np.zeros(3), np.zeros(4)
    for axis in range(3):
        error[axis] = s.error[axis] + c.attitude_noise * normals[row, 9 + axis]
    _tilted(out.q_ned_from_gimbal, error, attitude)
    euler_from_quaternion(body, euler)
    quaternion_from_euler(0.0, 0.0, -euler[2], turn)
    multiply(turn, attitude, out.measured_q_heading)

    for axis in range(3):
        s.error[axis] = c.decay * s.error[axis] + c.drive[axis] * normals[row, 3 + axis]
