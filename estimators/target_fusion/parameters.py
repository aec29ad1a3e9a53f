"""Parameters of the target fusion besides those of the drones' motion: camera, range, and the target's
motion.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

from estimators.lissajous.parameters import LissajousParameters
from flightsim.foundation.checks import (
    named,
    require_finite,
    require_members,
    require_not_negative,
    require_positive,
)


class Heading(StrEnum):
    """The source of a drone's heading."""

    COURSE = "course"
    """Along its estimated velocity, with that velocity's uncertainty (as in Steckenrider
    et al. 2020)."""
    YAW = "yaw"
    """The yaw in the autopilot's ATTITUDE."""


class Mount(StrEnum):
    """The mount of the camera."""

    GIMBAL = "gimbal"
    """On a gimbal that reports its attitude (GIMBAL_DEVICE_ATTITUDE_STATUS)."""
    FIXED = "fixed"
    """Fixed to the body; roll and pitch come from ATTITUDE."""


class Range(StrEnum):
    """The source of the distance to a target."""

    AUTO = "auto"
    """LANDING_TARGET's distance, else from the size if it is known, else from the height."""
    MESSAGE = "message"
    SIZE = "size"
    """From the apparent size and `target_size_m`."""
    HEIGHT = "height"
    """From the height above home, assuming level ground."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetFusionParameters(LissajousParameters):
    """Parameters of `TargetFusionEstimator`; those of `LissajousParameters` apply to every drone.

    Attributes:
        centre_vehicle: system id of the vehicle whose home is the origin of the pattern's centre, unless the
            centre is specified by coordinates.
        heading: source of a drone's heading.
        min_speed_m_s: with `heading=course`, detections of a slower drone are not placed: a drone that
            hovers, climbs or lands may have any heading, and its course is noise.
        mount: mount of the camera.
        mount_roll_rad, mount_pitch_rad, mount_yaw_rad: attitude of a fixed camera relative to the body; pitch
            -pi/2: down.
        distance: source of the range.
        target_size_m: true size of the target, for `distance=size`; 0: not known.
        bearing_sigma_rad: one sigma of a direction across the line of sight, camera and gimbal together.
        tilt_sigma_rad: one sigma of the camera's pitch against the horizon.
        size_sigma_rad: one sigma of an apparent size, from pixel noise.
        range_sigma: one sigma of a distance that comes without an apparent size, as a fraction of the
            distance.
        height_sigma_m: one sigma of the height above the target.
        yaw_sigma_rad: one sigma of ATTITUDE's yaw, and with `heading=course` of the nose from the course.
        walk_m_sqrt_s: one sigma per axis that a target may wander in a second, growing with the square root
            of time; it is the uncertainty that an old estimate gains.
        gate: largest squared Mahalanobis distance of a detection that belongs to the target; 13.8 rejects one
            valid detection in a thousand.
        confirmations: number of agreeing detections before a target is reported, or moved to another place.
        wait_s: time for which a detection waits for the data needed to place it.
        max_delay_s: detections that are older than the estimate by more than this are rejected.
    """

    centre_vehicle: int = 1
    heading: Heading = Heading.COURSE
    min_speed_m_s: float = 0.5
    mount: Mount = Mount.GIMBAL
    mount_roll_rad: float = 0.0
    mount_pitch_rad: float = -0.5 * math.pi
    mount_yaw_rad: float = 0.0
    distance: Range = Range.AUTO
    target_size_m: float = 0.0
    bearing_sigma_rad: float = 0.003
    tilt_sigma_rad: float = 0.003
    size_sigma_rad: float = 0.00064
    range_sigma: float = 0.05
    height_sigma_m: float = 1.0
    yaw_sigma_rad: float = 0.02
    walk_m_sqrt_s: float = 1.0
    gate: float = 13.8
    confirmations: int = 3
    wait_s: float = 0.5
    max_delay_s: float = 2.0

    def __post_init__(self) -> None:
        # zero-argument super() does not reach the base of a dataclass with slots
        LissajousParameters.__post_init__(self)
        require_members(self, heading=Heading, mount=Mount, distance=Range)
        if not 1 <= self.centre_vehicle <= 255:
            raise ValueError(f"centre_vehicle {self.centre_vehicle} is not a system id, 1..255")
        if self.confirmations < 1:
            raise ValueError(f"confirmations {self.confirmations} is not accepted: 1 or more is")
        require_positive(
            **named(self, "bearing_sigma_rad", "tilt_sigma_rad", "size_sigma_rad", "range_sigma", "gate"),
            wait_s=self.wait_s,
        )
        require_not_negative(
            **named(self, "min_speed_m_s", "target_size_m", "height_sigma_m", "yaw_sigma_rad"),
            **named(self, "walk_m_sqrt_s", "max_delay_s"),
        )
        require_finite(**named(self, "mount_roll_rad", "mount_pitch_rad", "mount_yaw_rad"))
        if self.distance is Range.SIZE and not self.target_size_m:
            raise ValueError("distance=size needs target_size_m, the true size of the target")
        if self.wait_s > self.history_s:
            raise ValueError(f"wait_s {self.wait_s:g} is more than history_s {self.history_s:g}")
