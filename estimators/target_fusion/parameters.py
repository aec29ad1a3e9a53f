"""Parameters of the target fusion besides those of the drones' motion: camera, range, and the target's
motion.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

from estimators.lissajous.parameters import LissajousParameters
from flightsim.foundation.options import option


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
    """Parameters of `TargetFusionEstimator`; those of `LissajousParameters` apply to every drone."""

    centre_vehicle: int = option(
        1,
        least=1,
        most=255,
        help="System id of the vehicle whose home is the origin of the pattern's centre.",
    )
    heading: Heading = option(Heading.COURSE, help="Source of a drone's heading.")
    min_speed_m_s: float = option(
        0.5,
        least=0.0,
        help="Speed below which a course is noise: detections of a slower drone are not placed.",
    )
    mount: Mount = option(Mount.GIMBAL, help="Mount of the camera.")
    mount_roll_rad: float = option(0.0, help="Roll of a fixed camera relative to the body.")
    mount_pitch_rad: float = option(
        -0.5 * math.pi, help="Pitch of a fixed camera relative to the body; -pi/2: down."
    )
    mount_yaw_rad: float = option(0.0, help="Yaw of a fixed camera relative to the body.")
    distance: Range = option(Range.AUTO, help="Source of the distance to a target.")
    target_size_m: float = option(
        0.0, least=0.0, help="True size of the target, for distance=size; 0: not known."
    )
    bearing_sigma_rad: float = option(
        0.003,
        above=0.0,
        help="Standard deviation of a direction across the line of sight, with the gimbal's.",
    )
    tilt_sigma_rad: float = option(
        0.003, above=0.0, help="Standard deviation of the camera's pitch against the horizon."
    )
    size_sigma_rad: float = option(
        0.00064, above=0.0, help="Standard deviation of an apparent size, from pixel noise."
    )
    range_sigma: float = option(
        0.05, above=0.0, help="Standard deviation of a distance without apparent size, over the distance."
    )
    height_sigma_m: float = option(1.0, least=0.0, help="Standard deviation of the height above the target.")
    yaw_sigma_rad: float = option(
        0.02, least=0.0, help="Standard deviation of ATTITUDE's yaw, or of the nose from the course."
    )
    walk_m_sqrt_s: float = option(
        1.0, least=0.0, help="Standard deviation of a target's walk in a second, per axis."
    )
    gate: float = option(
        13.8,
        above=0.0,
        help="Largest squared Mahalanobis distance of a detection that belongs to the target.",
    )
    confirmations: int = option(
        3, least=1, help="Number of agreeing detections before a target is reported, or moved."
    )
    wait_s: float = option(
        0.5, above=0.0, help="Time for which a detection waits for the data needed to place it."
    )
    max_delay_s: float = option(2.0, least=0.0, help="Largest age of a detection before the estimate.")

    def check_together(self) -> None:
        if self.distance is Range.SIZE and not self.target_size_m:
            raise ValueError("distance=size needs target_size_m, the true size of the target")
        if self.wait_s > self.history_s:
            raise ValueError(f"wait_s {self.wait_s:g} is more than history_s {self.history_s:g}")
