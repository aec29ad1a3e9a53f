"""Control allocation of a quad-X with desaturation, and the motors' thrust curve.

Normalised as PX4 normalises its effectiveness matrix: unit roll or pitch torque moves each motor by
1/sqrt(2), unit yaw and unit thrust by 1. Desaturation in the order of PX4 with airmode off
(`ControlAllocationSequentialDesaturation`): thrust gives way first (only downwards), then roll and pitch,
and yaw is mixed last into what is left.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel

Array = NDArray[np.float64]

MOTORS: Final = 4
ROLL: Final = 0
PITCH: Final = 1
YAW: Final = 2
COLLECTIVE: Final = 3
_A: Final = 1.0 / math.sqrt(2.0)
# motors: front right CCW, rear left CCW, front left CW, rear right CW (PX4 quad x); columns roll, pitch,
# yaw, thrust
ALLOCATION: Final[Array] = np.array(
    [[-_A, _A, 1.0, 1.0], [_A, -_A, 1.0, 1.0], [_A, _A, -1.0, 1.0], [-_A, -_A, -1.0, 1.0]]
)
_YAW_MARGIN: Final = 0.15  # of the range, kept for yaw when thrust is full (PX4 MINIMUM_YAW_MARGIN)


@kernel
def _desaturation_gain(motor: Array, axis: int, upper: float) -> float:
    """Step along `axis` that brings the worst motors back into 0..upper (sum of both ends)."""
    gain_min = 0.0
    gain_max = 0.0
    for i in range(MOTORS):
        gain = 0.0
        if motor[i] < 0.0:
            gain = -motor[i] / ALLOCATION[i, axis]
        elif motor[i] > upper:
            gain = (upper - motor[i]) / ALLOCATION[i, axis]
        gain_min = min(gain_min, gain)
        gain_max = max(gain_max, gain)
    return gain_min + gain_max


@kernel
def _desaturate(motor: Array, axis: int, upper: float, only_reduce: bool) -> None:
    gain = _desaturation_gain(motor, axis, upper)
    if only_reduce and gain > 0.0:
        return
    for i in range(MOTORS):
        motor[i] += gain * ALLOCATION[i, axis]
    # the second, half step shares what can't be met between the two ends of the range
    gain = 0.5 * _desaturation_gain(motor, axis, upper)
    for i in range(MOTORS):
        motor[i] += gain * ALLOCATION[i, axis]


@kernel
def allocate(roll: float, pitch: float, yaw: float, thrust: float, motor: Array, unallocated: Array) -> None:
    """motor (4,) = normalised motor thrusts 0..1; unallocated (3,) = commanded torque not produced."""
    for i in range(MOTORS):
        motor[i] = roll * ALLOCATION[i, ROLL] + pitch * ALLOCATION[i, PITCH] + thrust
    _desaturate(motor, COLLECTIVE, 1.0, True)
    _desaturate(motor, ROLL, 1.0, False)
    _desaturate(motor, PITCH, 1.0, False)
    for i in range(MOTORS):
        motor[i] += yaw * ALLOCATION[i, YAW]
    _desaturate(motor, YAW, 1.0 + _YAW_MARGIN, False)
    _desaturate(motor, COLLECTIVE, 1.0, True)
    given_roll = 0.0
    given_pitch = 0.0
    given_yaw = 0.0
    for i in range(MOTORS):
        motor[i] = min(1.0, max(0.0, motor[i]))
        given_roll += 0.5 * motor[i] * ALLOCATION[i, ROLL]
        given_pitch += 0.5 * motor[i] * ALLOCATION[i, PITCH]
        given_yaw += 0.25 * motor[i] * ALLOCATION[i, YAW]
    unallocated[0] = roll - given_roll
    unallocated[1] = pitch - given_pitch
    unallocated[2] = yaw - given_yaw


@kernel
def command_from_thrust(thrust: float, factor: float) -> float:
    """Motor command c with thrust = factor c^2 + (1 - factor) c (PX4 THR_MDL_FAC)."""
    thrust = min(1.0, max(0.0, thrust))
    if factor < 1e-6:
        return thrust
    linear = 1.0 - factor
    return (math.sqrt(linear * linear + 4.0 * factor * thrust) - linear) / (2.0 * factor)
