"""A camera whose detections are moving objects in rendered video: the world's renderer and the detectors of
`estimators.vision`, frame by frame on vehicle time.
"""

import math
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

import numpy as np

from estimators.vision import (
    CameraGeometry,
    CameraPose,
    CornerFlowDetector,
    CornerFlowParameters,
    FrameDifferenceDetector,
    FrameDifferenceParameters,
    MovingObjectDetector,
    VideoCounts,
    VideoFrame,
)
from estimators.vision.ground_points import CameraAxes
from flightsim.foundation.checks import NotNegative, Positive
from flightsim.foundation.options import Options
from flightsim.foundation.random_streams import RandomStreams
from flightsim.foundation.vectors import from_euler, product
from flightsim.payload import NO_TAG, CameraView, Detection, ImagerParameters, PinholeModel, Terrain
from flightsim.picture import Renderer, Scenery
from flightsim.picture.pose import rotation_of
from missions.embedded.picture_geometry import picture_geometry

__all__ = ["MotionSource", "RenderedMotion", "RenderedMotionReader"]

_LEAST_HEIGHT_M: Final = 5.0  # a camera that is lower has no ground in view that it could be compared with


class MotionSource(StrEnum):
    """What finds the moving objects."""

    CORNERS = "corners"
    DIFFERENCES = "differences"


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderedMotion(Options):
    """Renders what a camera sees, and detects what moves on the ground.

    The detector gets an attitude and a height with slow errors, as a camera has them from its vehicle.

    Attributes:
        source: corners or frame differences.
        corners, differences: parameters of both.
        scenery, terrain: of the world.
        tilt_sigma_rad, height_sigma_m: standard deviations of the errors of roll and pitch, and of height.
        error_time_s: their correlation time.
    """

    source: MotionSource = MotionSource.DIFFERENCES
    corners: CornerFlowParameters = field(default_factory=CornerFlowParameters)
    differences: FrameDifferenceParameters = field(default_factory=FrameDifferenceParameters)
    scenery: Scenery = field(default_factory=Scenery)
    terrain: Terrain | None = None
    tilt_sigma_rad: NotNegative = 0.012
    height_sigma_m: NotNegative = 2.0
    error_time_s: Positive = 5.0

    def start(
        self, *, model: PinholeModel, imager: ImagerParameters, blur_px_m: float, seed: int
    ) -> "RenderedMotionReader":
        """The reader of one camera.

        Raises:
            ValueError: the distortion folds the picture.
        """
        return RenderedMotionReader(self, model, imager, blur_px_m, seed)

    def detector(self, camera: CameraGeometry) -> MovingObjectDetector:
        """The detector for a camera."""
        if self.source is MotionSource.CORNERS:
            return CornerFlowDetector(camera, self.corners)
        return FrameDifferenceDetector(camera, self.differences)


class RenderedMotionReader:
    """Renders the frames of one camera, and detects what moves in them."""

    def __init__(
        self,
        parameters: RenderedMotion,
        model: PinholeModel,
        imager: ImagerParameters,
        blur_px_m: float,
        seed: int,
    ) -> None:
        self._parameters = parameters
        self._model, self._imager = model, imager
        self._renderer = Renderer(
            model,
            aperture_px_m=blur_px_m,
            scenery=parameters.scenery,
            imager=imager,
            seed=seed,
            terrain=parameters.terrain,
        )
        self._rng = RandomStreams(seed).generator("rendered_motion")
        self._errors = self._rng.standard_normal(3)  # roll, pitch, height, in standard deviations
        self._error_us: int | None = None
        self._zoom = 1.0
        self._detector = parameters.detector(picture_geometry(model, imager, 1.0))

    @property
    def counts(self) -> VideoCounts:
        """What became of the frames since the zoom was changed last."""
        return self._detector.counts

    def read(self, view: CameraView) -> tuple[Detection, ...] | None:
        """The moving objects in the picture of a view, from left to right; None: the frame says nothing about
        them.
        """
        height_m = self._height_m(view)
        if view.covered or height_m < _LEAST_HEIGHT_M:
            self._detector.reset()
            return None
        if view.zoom != self._zoom:
            self._zoom = view.zoom
            self._detector = self._parameters.detector(picture_geometry(self._model, self._imager, view.zoom))
        roll, pitch = (self._parameters.tilt_sigma_rad * self._errors[:2]).tolist()
        reported = rotation_of(product(from_euler(roll, pitch, 0.0), view.q_ned_from_mount))
        # rows: to the right, down and ahead of the picture; the level frame's forward is north
        pose = CameraPose(axes=CameraAxes(axes=reported[:, [1, 2, 0]].T), height_m=height_m)
        found = self._detector.detect(
            VideoFrame(time_us=view.time_us, pixels=self._renderer.render(view), pose=pose)
        )
        if found is None:
            return None
        camera = self._detector.camera
        pixels = (
            camera.pixels(np.column_stack((found.rays, np.ones(len(found))))) if len(found) else found.rays
        )
        detections = [
            Detection(
                view.time_us,
                u_px,
                v_px,
                math.atan(x),
                math.atan(y),
                size_px / camera.focal_px[0],
                NO_TAG,
                0.0,
            )
            for (u_px, v_px), (x, y), size_px in zip(
                pixels.tolist(), found.rays.tolist(), found.sizes_px.tolist(), strict=True
            )
        ]
        return tuple(sorted(detections, key=lambda one: (one.u_px, one.v_px)))

    def _height_m(self, view: CameraView) -> float:
        """The height as the vehicle reports it; the errors go on with each frame."""
        p = self._parameters
        if self._error_us is not None:
            keep = math.exp(-max(0, view.time_us - self._error_us) * 1e-6 / p.error_time_s)
            self._errors *= keep
            self._errors += math.sqrt(1.0 - keep * keep) * self._rng.standard_normal(3)
        self._error_us = view.time_us
        return -view.eye_ned_m[2] + p.height_sigma_m * float(self._errors[2])
