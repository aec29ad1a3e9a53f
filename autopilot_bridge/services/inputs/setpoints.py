"""The frames of streamed setpoints: a SET_POSITION_TARGET in local NED. Message fields are untrusted.

Streamed setpoints: SET_POSITION_TARGET_LOCAL_NED, SET_POSITION_TARGET_GLOBAL_INT and SET_ATTITUDE_TARGET.

PX4 flies them in OFFBOARD as they come and counts the good ones as a sign of life (docs/firmware/px4.md,
section 9). ArduPilot flies them smoothly in GUIDED (docs/firmware/ardupilot.md, sections 6 and 7). Neither
acknowledges them.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import place
from autopilot_bridge.navigation import layout as nav
from flightsim.foundation.rotations import rotate
from flightsim.foundation.vectors import Vector

UNSET: Final[Vector] = (math.nan, math.nan, math.nan)
_MAX_POSITION_M: Final = 1e6
_MAX_SPEED_M_S: Final = 1e3
_MAX_ACCELERATION_M_S2: Final = 1e3
_MAX_ANGLE_RAD: Final = 1e3

POSITION_BITS: Final = (1, 2, 4)
VELOCITY_BITS: Final = (8, 16, 32)
ACCELERATION_BITS: Final = (64, 128, 256)
FORCE_BIT: Final = 512
"""The accelerations are forces, which no firmware takes. Both look at the bit only where accelerations are
used; masks that ignore them and have it (4088, 4039) are common.
"""
YAW_BIT: Final = 1024
YAW_RATE_BIT: Final = 2048

THROTTLE_BIT: Final = 64
"""Of SET_ATTITUDE_TARGET.type_mask, as the next."""
ATTITUDE_BIT: Final = 128
_RATE_BITS: Final = (1, 2, 4)
_MAX_RATE_RAD_S: Final = 100.0


class Target(NamedTuple):
    """A setpoint in local NED; NaN: not controlled."""

    position: Vector
    velocity: Vector
    acceleration: Vector
    yaw_rad: float
    yaw_rate_rad_s: float

    @property
    def has_position(self) -> bool:
        """Some component of the position is controlled."""
        return any_finite(self.position)

    @property
    def has_velocity(self) -> bool:
        """Some component of the velocity is controlled."""
        return any_finite(self.velocity)

    @property
    def has_acceleration(self) -> bool:
        """Some component of the acceleration is controlled."""
        return any_finite(self.acceleration)


def any_finite(triple: Vector) -> bool:
    """At least one component is set."""
    return any(math.isfinite(value) for value in triple)


def masked(values: Vector, bits: tuple[int, int, int], type_mask: int, limit: float) -> Vector:
    """Components that the mask does not ignore; one that is not finite or too large counts as ignored."""
    x, y, z = (
        float(value) if not type_mask & bit and abs(value) <= limit else math.nan
        for value, bit in zip(values, bits, strict=True)
    )
    return x, y, z


def position_of(values: Vector, type_mask: int) -> Vector:
    """Position components, m."""
    return masked(values, POSITION_BITS, type_mask, _MAX_POSITION_M)


def velocity_of(values: Vector, type_mask: int) -> Vector:
    """Velocity components, m/s."""
    return masked(values, VELOCITY_BITS, type_mask, _MAX_SPEED_M_S)


def acceleration_of(values: Vector, type_mask: int) -> Vector:
    """Acceleration components, m/s^2."""
    return masked(values, ACCELERATION_BITS, type_mask, _MAX_ACCELERATION_M_S2)


def yaw_of(yaw_rad: float, yaw_rate_rad_s: float, type_mask: int) -> tuple[float, float]:
    """(yaw, yaw rate); the yaw wrapped to -pi..pi."""
    yaw = yaw_rad if not type_mask & YAW_BIT and abs(yaw_rad) <= _MAX_ANGLE_RAD else math.nan
    rate = (
        yaw_rate_rad_s if not type_mask & YAW_RATE_BIT and abs(yaw_rate_rad_s) <= _MAX_ANGLE_RAD else math.nan
    )
    return math.remainder(yaw, 2.0 * math.pi) if math.isfinite(yaw) else math.nan, rate


def rotated_by_heading(values: Vector, heading_rad: float) -> Vector:
    """A vector given as forward, right, down, in NED. A single unset horizontal component is zero."""
    forward, right, down = values
    if not (math.isfinite(forward) or math.isfinite(right)):
        return math.nan, math.nan, down
    forward = forward if math.isfinite(forward) else 0.0
    right = right if math.isfinite(right) else 0.0
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    return c * forward - s * right, s * forward + c * right, down


def rotated_by_attitude(values: Vector, context: FlightContext) -> Vector:
    """A vector given in body axes (FRD), in NED."""
    ned = np.empty(3)
    rotate(context.nav[nav.Q_NED_FROM_FRD], np.array(values), ned)
    north, east, down = ned.tolist()
    return north, east, down


def heading_of(context: FlightContext) -> float:
    """The vehicle's heading."""
    return float(context.nav[nav.EULER_RAD][2])


def place_of(context: FlightContext) -> Vector:
    """The vehicle's position, local NED."""
    north_m, east_m, down_m = (float(value) for value in context.nav[nav.POS_NED_M])
    return north_m, east_m, down_m


def local_from_global(
    context: FlightContext, lat_e7: int, lon_e7: int, altitude_m: float, *, relative: bool
) -> Vector | None:
    """Local NED of a geodetic position; None when it is invalid, or the vehicle's own position is not known.

    Args:
        relative: the altitude is over home, else over mean sea level.
    """
    frame = context.frame
    if frame is None or not math.isfinite(altitude_m) or abs(altitude_m) > _MAX_POSITION_M:
        return None
    there = place(lat_e7, lon_e7, 0)
    if there is None:
        return None
    reference_down_m = float(context.home_ned_m[2]) if relative else frame.origin.alt_m
    if not math.isfinite(reference_down_m):
        return None
    north_m, east_m, _ = frame.ned_from_geodetic(there.lat_deg, there.lon_deg, frame.origin.alt_m)
    if max(abs(north_m), abs(east_m)) > _MAX_POSITION_M:
        return None
    return north_m, east_m, reference_down_m - altitude_m


def unit_quaternion(values: list[float], tolerance: float) -> np.ndarray | None:
    """q_ned_from_frd, normalised; None when it is not of unit length within `tolerance`."""
    q = np.array(values, dtype=np.float64)
    length = float(np.sqrt(q @ q)) if all(map(math.isfinite, values)) else math.nan
    return q / length if abs(length - 1.0) <= tolerance else None


def whole(values: Vector, bits: tuple[int, int, int], type_mask: int) -> Vector:
    """A vector that is used whole: not set when the mask has any of its bits."""
    return UNSET if any(type_mask & bit for bit in bits) else values


def rates_of(message: dialect.MAVLink_set_attitude_target_message) -> Vector:
    """Body rates that are not ignored, rad/s; NaN for the others."""
    values = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
    roll, pitch, yaw = (
        float(value) if not message.type_mask & bit and abs(value) <= _MAX_RATE_RAD_S else math.nan
        for value, bit in zip(values, _RATE_BITS, strict=True)
    )
    return roll, pitch, yaw
