"""From the messages of the aircraft's components to the target's position, without I/O.

Inputs are attitudes, airspeeds, heights, gimbal attitudes and detections in the order of their arrival.
Outputs are the relative target and the direction in which the gimbal must point.
"""

import math
from collections import deque
from enum import StrEnum
from typing import Final

from estimators.orbit_target.attitude import AttitudeSource
from estimators.orbit_target.parameters import TrackerParameters
from estimators.orbit_target.relative_target import RelativeState, RelativeTarget
from estimators.tracking.line_of_sight import (
    Detection,
    GimbalAttitude,
    LineOfSight,
    line_of_sight_of_gimbal,
    pointing_angles,
)
from flightsim.foundation.vectors import between, yaw_of

_GIMBALS_KEPT: Final = 128
_GIMBAL_STALE_US: Final = 200_000
_IMAGES_KEPT: Final = 64
_OLD_IMAGE_US: Final = 900_000
_LEAST_HEIGHT_M: Final = 2.0
_FLATTEST_RAD: Final = math.radians(5.0)  # a flatter line of sight gives no distance to start with


class TargetStatus(StrEnum):
    """State of the knowledge about the target."""

    EXPECTED = "expected"  # not acquired yet: known only from another source
    SEEN = "seen"  # acquired by consecutive detections
    LOST = "lost"  # was acquired, but has not been detected for some time


class TargetTracker:
    """Follows one target by line of sight.

    Args:
        attitude: attitude of the aircraft.
        parameters: noise and times.
        first_sigmas: standard deviations of place (m) and velocity against the air (m/s) with which the first
            detection starts the filter; None: only `start` and `expect` do.

    Attributes:
        target: the filter.
        losses: number of times that an acquired target was lost.
        height_m: height of the aircraft over the target's ground; NaN: not known.
    """

    def __init__(
        self,
        attitude: AttitudeSource,
        parameters: TrackerParameters | None = None,
        first_sigmas: tuple[float, float] | None = None,
    ) -> None:
        self.parameters = parameters or TrackerParameters()
        self.target = RelativeTarget(self.parameters)
        self.losses = 0
        self._attitude = attitude
        self._first_sigmas = first_sigmas
        self._gimbals: deque[GimbalAttitude] = deque(maxlen=_GIMBALS_KEPT)
        self._images: dict[int, list[Detection]] = {}
        self.height_m = math.nan
        self._seen_us: int | None = None
        self._sightings_us: deque[int] = deque(maxlen=self.parameters.acquired_after)
        self._status = TargetStatus.EXPECTED

    # inputs

    def start(
        self,
        time_us: int,
        *,
        offset_ne_m: tuple[float, float],
        offset_std_m: float,
        drift_ne_m_s: tuple[float, float],
        drift_std_m_s: float,
    ) -> None:
        """Start with a target position of another source (equation 33). Earlier detections still count
        towards the target's acquisition.
        """
        self._seen_us = None
        self._status = TargetStatus.EXPECTED
        self.target.start(
            time_us,
            offset_ne_m=offset_ne_m,
            offset_std_m=offset_std_m,
            drift_ne_m_s=drift_ne_m_s,
            drift_std_m_s=drift_std_m_s,
        )

    def expect(
        self,
        time_us: int,
        *,
        target_ne_m: tuple[float, float],
        target_ne_m_s: tuple[float, float],
        own_ne_m: tuple[float, float],
        own_ne_m_s: tuple[float, float],
        air_ne_m_s: tuple[float, float],
        sigma_m: float,
        drift_sigma_m_s: float,
    ) -> None:
        """Start with a place where the target is expected, while the aircraft knows its own position.

        Args:
            time_us: present time.
            target_ne_m, target_ne_m_s: expected place and velocity of the target, from home.
            own_ne_m, own_ne_m_s: place and velocity over ground of the aircraft, from home.
            air_ne_m_s: velocity of the aircraft through the air.
            sigma_m, drift_sigma_m_s: standard deviations of the place and of the velocity against the air.
        """
        wind = (own_ne_m_s[0] - air_ne_m_s[0], own_ne_m_s[1] - air_ne_m_s[1])
        self.start(
            time_us,
            offset_ne_m=(target_ne_m[0] - own_ne_m[0], target_ne_m[1] - own_ne_m[1]),
            offset_std_m=sigma_m,
            drift_ne_m_s=(target_ne_m_s[0] - wind[0], target_ne_m_s[1] - wind[1]),
            drift_std_m_s=drift_sigma_m_s,
        )

    def count_anew(self) -> None:
        """Reset the counts of losses and detections to zero."""
        self.losses = 0
        self.target.accepted = self.target.rejected = 0

    def height(self, height_m: float) -> None:
        """Set the height of the aircraft over the target's ground."""
        self.height_m = height_m

    def gimbal(self, attitude: GimbalAttitude) -> bool:
        """Add a gimbal attitude; returns False when it is not newer than the newest."""
        if self._gimbals and attitude.time_us <= self._gimbals[-1].time_us:
            return False
        self._gimbals.append(attitude)
        return True

    def detect(self, detection: Detection) -> None:
        """Add one detected object of an image; it is processed in the next `step`."""
        self._images.setdefault(detection.time_us, []).append(detection)
        if len(self._images) > _IMAGES_KEPT:
            del self._images[min(self._images)]

    # outputs

    def step(self, time_us: int, airspeed_true_m_s: float, climb_m_s: float = 0.0) -> None:
        """Advance to a time, then process the images that have arrived. Does nothing without attitude and
        airspeed.

        Args:
            time_us: present time.
            airspeed_true_m_s: true airspeed, along the nose.
            climb_m_s: upward part of it.
        """
        q = self._attitude.at(time_us)
        if q is None or not math.isfinite(airspeed_true_m_s + climb_m_s):
            return
        heading = yaw_of(q)
        level = math.sqrt(max(0.0, airspeed_true_m_s**2 - climb_m_s**2))
        self.target.move(time_us, (level * math.cos(heading), level * math.sin(heading)))
        for image_us in sorted(self._images):
            self._look(image_us, self._images.pop(image_us), time_us)
        if self._status is TargetStatus.SEEN and time_us - self._sightings_us[-1] > self._lost_after_us:
            self._status = TargetStatus.LOST
            self.losses += 1

    def _look(self, image_us: int, detections: list[Detection], now_us: int) -> None:
        if not now_us - _OLD_IMAGE_US < image_us <= now_us or not self.height_m > _LEAST_HEIGHT_M:
            return
        gimbal, q = self._gimbal_at(image_us), self._attitude.at(image_us)
        if gimbal is None or q is None:
            return
        lines = [line_of_sight_of_gimbal(d.image_x, d.image_y, gimbal, q) for d in detections]
        if not self.target.known and self._first_sigmas is not None:
            self._start_along(lines[0], now_us, self._first_sigmas)

        def distance(line: LineOfSight) -> float:
            return self.target.distance_squared(image_us, line, self.height_m)

        if self.target.see(image_us, min(lines, key=distance), self.height_m):
            self._seen_us = image_us
            self._sight(image_us)

    def _start_along(self, line: LineOfSight, now_us: int, sigmas: tuple[float, float]) -> None:
        """Start where a line of sight meets the ground (equation 40)."""
        if line.depression_rad < _FLATTEST_RAD:
            return
        away_m = self.height_m / math.tan(line.depression_rad)
        self.start(
            now_us,
            offset_ne_m=(away_m * math.cos(line.bearing_rad), away_m * math.sin(line.bearing_rad)),
            offset_std_m=sigmas[0],
            drift_ne_m_s=(0.0, 0.0),
            drift_std_m_s=sigmas[1],
        )

    def _sight(self, image_us: int) -> None:
        """Count an accepted detection towards the acquisition."""
        if self._sightings_us and image_us - self._sightings_us[-1] > self._lost_after_us:
            self._sightings_us.clear()
        self._sightings_us.append(image_us)
        if len(self._sightings_us) == self.parameters.acquired_after:
            self._status = TargetStatus.SEEN

    def _gimbal_at(self, time_us: int) -> GimbalAttitude | None:
        later: GimbalAttitude | None = None
        for sample in reversed(self._gimbals):
            if sample.time_us <= time_us:
                if later is None or later.from_north != sample.from_north:
                    return sample if time_us - sample.time_us <= _GIMBAL_STALE_US else None
                share = (time_us - sample.time_us) / (later.time_us - sample.time_us)
                return GimbalAttitude(
                    time_us=time_us, q=between(sample.q, later.q, share), from_north=sample.from_north
                )
            later = sample
        return None

    @property
    def status(self) -> TargetStatus:
        """State of the knowledge about the target."""
        return self._status

    @property
    def _lost_after_us(self) -> float:
        return self.parameters.lost_after_s * 1e6

    def unseen_s(self, time_us: int) -> float:
        """Time since the target was last seen; infinite if it never was."""
        return math.inf if self._seen_us is None else (time_us - self._seen_us) * 1e-6

    def state(self, time_us: int) -> RelativeState:
        """The state of the target relative to the aircraft, at the present or a later time."""
        return self.target.state(time_us)

    def pointing(self, time_us: int, ahead_s: float) -> tuple[float, float] | None:
        """(azimuth, elevation), rad relative to the body, of a gimbal that points at the target; None when
        they are not known.

        Args:
            time_us: present time.
            ahead_s: time by which the target's motion is predicted, to allow for the gimbal's delay.
        """
        q = self._attitude.at(time_us)
        if q is None or not self.target.known or not math.isfinite(self.height_m):
            return None
        north_m, east_m = self.target.state(time_us + round(ahead_s * 1e6)).offset_ne_m
        return pointing_angles((north_m, east_m, max(_LEAST_HEIGHT_M, self.height_m)), q)
