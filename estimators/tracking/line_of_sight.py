"""Conversion of a place in the image to a direction over ground and back.

Source: Tolman et al. 2021, equations 36 to 40.

Frames: camera (x to the right of the image, y down, z along the optical axis), gimbal (x along the optical
axis, y right, z down), body (FRD), NED. The paper's level frame is NED turned by the heading; here NED itself
is used, so that a turning aircraft doesn't turn the frame.
"""

import math
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import dialect
from estimators import wire
from flightsim.foundation.vectors import Quaternion, Vector, conjugate, from_euler, rotate, yaw_of

_IN_VEHICLE_FRAME: Final = dialect.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
_IN_EARTH_FRAME: Final = dialect.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
_YAW_LOCK: Final = dialect.GIMBAL_DEVICE_FLAGS_YAW_LOCK


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection:
    """One object in one image (LANDING_TARGET of the camera).

    Attributes:
        time_us: vehicle time at which the image was taken.
        target: number that the camera's tracker assigns to the object (`target_num`).
        image_x, image_y: normalized image coordinates: x to the right, y down, unit focal length.
    """

    time_us: int
    target: int
    image_x: float
    image_y: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GimbalAttitude:
    """The attitude of the gimbal (GIMBAL_DEVICE_ATTITUDE_STATUS).

    Attributes:
        time_us: vehicle time.
        q: Hamilton quaternion (w x y z) that rotates gimbal vectors (x along the line of sight, y right, z
            down) to the reference frame.
        from_north: whether the reference frame is NED; otherwise it is the vehicle's level frame, x along its
        heading.
    """

    time_us: int
    q: tuple[float, float, float, float]
    from_north: bool


def detection(m: wire.LANDING_TARGET | dialect.MAVLink_landing_target_message) -> Detection | None:
    """From LANDING_TARGET; None when its angles are not possible in an image."""
    if not (abs(m.angle_x) < 0.5 * math.pi and abs(m.angle_y) < 0.5 * math.pi):
        return None
    return Detection(
        time_us=int(m.time_usec),
        target=int(m.target_num),
        image_x=math.tan(m.angle_x),
        image_y=math.tan(m.angle_y),
    )


def gimbal_attitude(
    m: wire.GIMBAL_DEVICE_ATTITUDE_STATUS | dialect.MAVLink_gimbal_device_attitude_status_message,
) -> GimbalAttitude | None:
    """The attitude from GIMBAL_DEVICE_ATTITUDE_STATUS; None when its quaternion is invalid.

    Roll and pitch are relative to the horizon. Yaw is relative to north or to the vehicle's heading, as the
    flags specify; for gimbals older than those flags YAW_LOCK means north.
    """
    w, x, y, z = (float(value) for value in m.q)
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if not 0.5 < norm < 2.0:
        return None
    flags = int(m.flags)
    return GimbalAttitude(
        time_us=int(m.time_boot_ms) * 1000,
        q=(w / norm, x / norm, y / norm, z / norm),
        from_north=bool(flags & _IN_EARTH_FRAME)
        or (not flags & _IN_VEHICLE_FRAME and bool(flags & _YAW_LOCK)),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class LineOfSight:
    """A direction from the aircraft.

    Attributes:
        bearing_rad: bearing, clockwise from north.
        depression_rad: angle below the horizon, positive down.
    """

    bearing_rad: float
    depression_rad: float

    @classmethod
    def along(cls, ned: Vector) -> "LineOfSight":
        """The direction of a vector in NED."""
        return cls(
            bearing_rad=math.atan2(ned[1], ned[0]), depression_rad=math.atan2(ned[2], math.hypot(*ned[:2]))
        )


def gimbal_from_camera(image_x: float, image_y: float) -> Vector:
    """The vector of equation 36, (image_x, image_y, 1), in the gimbal's frame (equation 38)."""
    return (1.0, image_x, image_y)


def gimbal_angles(line_frd: Vector) -> tuple[float, float]:
    """(azimuth, elevation), rad, that point a two-axis gimbal along a vector of the body frame:
    atan2(l_y, l_x) and -asin(l_z) (section V-C).
    """
    x, y, z = line_frd
    length = math.sqrt(x * x + y * y + z * z)
    return math.atan2(y, x), -math.asin(max(-1.0, min(1.0, z / length)))


def line_of_sight_of_gimbal(
    image_x: float, image_y: float, gimbal: GimbalAttitude, q_ned_from_frd: Quaternion
) -> LineOfSight:
    """Direction of a detection (equation 37) from a gimbal that reports its own attitude against the horizon,
    as defined in MAVLink.

    Its quaternion combines the first two rotations of the equation. The heading is the aircraft's.

    Args:
        image_x, image_y: normalized image coordinates.
        gimbal: attitude of the gimbal when the image was taken.
        q_ned_from_frd: attitude of the aircraft at that time.
    """
    line = rotate(gimbal.q, gimbal_from_camera(image_x, image_y))
    if not gimbal.from_north:
        line = rotate(from_euler(0.0, 0.0, yaw_of(q_ned_from_frd)), line)
    return LineOfSight.along(line)


def pointing_angles(offset_ned_m: Vector, q_ned_from_frd: Quaternion) -> tuple[float, float]:
    """(azimuth, elevation), rad, of a gimbal that points at a place `offset_ned_m` from the aircraft."""
    return gimbal_angles(rotate(conjugate(q_ned_from_frd), offset_ned_m))
