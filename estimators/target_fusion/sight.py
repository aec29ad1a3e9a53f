"""The place of a detection relative to the drone, from direction and range, with the uncertainty of both.

Steckenrider et al. 2020 take the target's place in the drone's frame as measured (equation 30). A camera
measures a direction; the range comes from the tag's apparent size (AprilTags, as in the paper), the message,
or the height.
"""

import math
from dataclasses import dataclass

import numpy as np

from estimators.lissajous.model import Array
from estimators.target_fusion.parameters import Range, TargetFusionParameters
from flightsim.foundation.vectors import Quaternion, rotate

_MAX_RANGE_M = 20_000.0
_STEEPEST = 1e-3  # sine of the depression: below it the place on the ground is too far away to be useful


@dataclass(frozen=True, slots=True)
class Detection:
    """One detected object in one image (LANDING_TARGET).

    Attributes:
        time_us: vehicle time of the exposure.
        vehicle: system id.
        target: number of its tag; 255: no tag.
        angle_x_rad, angle_y_rad: angles from the optical axis, right and down, each in its own plane.
        distance_m: distance in the message; 0: not known.
        size_rad: apparent size; 0: not known.
    """

    time_us: int
    vehicle: int
    target: int
    angle_x_rad: float
    angle_y_rad: float
    distance_m: float
    size_rad: float


@dataclass(frozen=True, slots=True)
class Seen:
    """A target's place relative to the drone, in the level frame along its heading.

    Attributes:
        place_m: (2,) forward and right distance.
        covariance_m2: (2, 2) covariance of the place.
    """

    place_m: Array
    covariance_m2: Array


def place_in_level_frame(
    detection: Detection, q_level_from_camera: Quaternion, height_m: float, p: TargetFusionParameters
) -> Seen | None:
    """The place of a detection relative to the drone; None when its range is not known.

    Args:
        detection: the detection.
        q_level_from_camera: rotates vectors of the camera (x along the optical axis, y right, z down) into
            the drone's level frame (x along its heading, z down).
        height_m: height of the drone above the target's ground; NaN: not known.
        p: parameters with the uncertainties.
    """
    x, y = math.tan(detection.angle_x_rad), math.tan(detection.angle_y_rad)
    norm = math.sqrt(1.0 + x * x + y * y)
    forward, right, down = rotate(q_level_from_camera, (1.0 / norm, x / norm, y / norm))
    level = math.hypot(forward, right)
    measured = _range(detection, height_m, down, p)
    if measured is None:
        return None
    range_m, sigma_m = measured
    if sigma_m is None:
        # range = height / sine: an error in height or tilt moves the place along the line on the ground
        along = (level / down * p.height_sigma_m) ** 2 + (height_m / down**2 * p.tilt_sigma_rad) ** 2
    else:
        along = (level * sigma_m) ** 2 + (range_m * down * p.tilt_sigma_rad) ** 2
    across = (range_m * max(level, abs(down)) * p.bearing_sigma_rad) ** 2
    if level < 1e-9:
        c, s = 1.0, 0.0
    else:
        c, s = forward / level, right / level
    covariance = np.array(
        [
            [c * c * along + s * s * across, c * s * (along - across)],
            [c * s * (along - across), s * s * along + c * c * across],
        ]
    )
    return Seen(np.array([range_m * forward, range_m * right]), covariance)


def _range(
    detection: Detection, height_m: float, down: float, p: TargetFusionParameters
) -> tuple[float, float | None] | None:
    """Range and its standard deviation. The second is None for a range from the height; the result is None
    without a range.
    """
    if p.distance in (Range.AUTO, Range.MESSAGE) and 0.0 < detection.distance_m <= _MAX_RANGE_M:
        share = p.range_sigma
        if detection.size_rad > 0.0:
            share = min(share, p.size_sigma_rad / detection.size_rad)
        return detection.distance_m, share * detection.distance_m
    if p.distance in (Range.AUTO, Range.SIZE) and p.target_size_m and 0.0 < detection.size_rad < math.pi:
        range_m = 0.5 * p.target_size_m / math.tan(0.5 * detection.size_rad)
        if range_m <= _MAX_RANGE_M:
            return range_m, p.size_sigma_rad / detection.size_rad * range_m
    if p.distance in (Range.AUTO, Range.HEIGHT) and down > _STEEPEST and height_m > 0.0:
        range_m = height_m / down
        if range_m <= _MAX_RANGE_M:
            return range_m, None
    return None
