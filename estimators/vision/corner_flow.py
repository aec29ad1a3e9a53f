"""Moving objects by corners that do not move with the ground (Tolman et al. 2021, section V-A)."""

from dataclasses import dataclass, field

import numpy as np

from estimators.vision.camera import CameraGeometry
from estimators.vision.ground_registration import GroundRegistration, RegistrationParameters, VideoCounts
from estimators.vision.moving_objects import (
    MovingObjectDetector,
    MovingObjects,
    ObjectParameters,
    ObjectPoints,
    objects_of,
)
from estimators.vision.video_frame import VideoFrame
from flightsim.foundation.checks import Count, Positive
from flightsim.foundation.options import Options

__all__ = ["CornerFlowDetector", "CornerFlowParameters"]


@dataclass(frozen=True, slots=True, kw_only=True)
class CornerFlowParameters(Options):
    """Parameters of the detector.

    Attributes:
        registration: of corners, flow and homography.
        objects: what can be an object.
        gate_squared: squared Mahalanobis distance from the ground of a corner that moves. The covariance has
            the noise of the flow and the parallax of heights, so that what only stands up does not move.
        least_px: least way over the baseline.
        least_corners: number of corners of an object.
    """

    registration: RegistrationParameters = field(default_factory=RegistrationParameters)
    objects: ObjectParameters = field(default_factory=ObjectParameters)
    gate_squared: Positive = 64.0
    least_px: Positive = 1.5
    least_corners: Count = 1


class CornerFlowDetector(MovingObjectDetector):
    """Corners that moved against the ground over the baseline, put together to objects.

    Args:
        camera: its geometry.
        parameters: None: the defaults.
    """

    def __init__(self, camera: CameraGeometry, parameters: CornerFlowParameters | None = None) -> None:
        super().__init__(camera)
        self.parameters = parameters or CornerFlowParameters()
        self._ground = GroundRegistration(camera, self.parameters.registration)

    def detect(self, frame: VideoFrame) -> MovingObjects | None:
        p = self.parameters
        found = self._ground.add(frame)
        if found is None:
            return None
        way_px = np.hypot(*(found.points_px - found.ground_px).T)
        moving = (found.normalised > p.gate_squared) & (way_px > p.least_px)
        count = int(moving.sum())
        points = ObjectPoints(
            points_px=found.points_px[moving],
            sizes_px=np.full(count, float(p.registration.window_px)),
            weights=np.ones(count, np.int64),
            before_px=found.ground_px[moving],
            elapsed_s=found.elapsed_s,
        )
        return objects_of(frame.time_us, points, self.camera, frame.pose, p.objects, p.least_corners)

    @property
    def counts(self) -> VideoCounts:
        return self._ground.counts

    def reset(self) -> None:
        self._ground.reset()
