"""The study `handoff` in pixels: what a camera sees is rendered, and searched by the front end of flights."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.vision import CameraPose, FrameDifferenceDetector, VideoFrame
from estimators.vision.ground_points import CameraAxes
from estimators.vision.patch_looks import patch_looks
from flightsim.foundation.vectors import from_euler, product
from flightsim.payload import NO_TAG, CameraView, TargetShape, TargetView
from flightsim.picture import Renderer
from flightsim.picture.pose import rotation_of
from missions.embedded.rendered_points import RenderedPoints

__all__ = ["WalkerPictures"]

Array = NDArray[np.float64]

_PERSON_M: Final = 1.75


class WalkerPictures:
    """The camera of one aircraft over walking persons, with its front end.

    Args:
        seed: of the noise of its pictures.
    """

    def __init__(self, seed: int) -> None:
        points = RenderedPoints()
        camera = points.camera
        self._renderer = Renderer(
            camera.model, aperture_px_m=camera.blur_px_m, imager=camera.imager, seed=seed
        )
        self._detector = FrameDifferenceDetector(points.geometry, points.front_end.differences)
        self.sigma = points.sigma

    def moving(
        self,
        time_us: int,
        eye_ned_m: Array,
        heading_rad: float,
        pointing_m: tuple[float, float],
        walkers: tuple[Array, Array],
        *,
        tilt_rad: tuple[float, float],
        height_m: float,
    ) -> tuple[Array, Array] | None:
        """Directions (n, 3) of what moves in a picture, in the level frame as the aircraft knows it, and what
        it looks like (n, 3); None: the picture says nothing about it.

        Args:
            time_us: of the picture.
            eye_ned_m: (3,) true place of the camera.
            heading_rad: true heading of the aircraft.
            pointing_m: where the camera points to, forward and right on the ground, in the true level frame.
            walkers: (n, 2) true places, north and east, and (n,) courses.
            tilt_rad: errors of roll and pitch.
            height_m: as the aircraft knows it.
        """
        forward, right = pointing_m
        azimuth = math.atan2(right, forward)
        depression = math.atan2(-eye_ned_m[2], math.hypot(forward, right))
        view = CameraView(
            time_us=time_us,
            eye_ned_m=(float(eye_ned_m[0]), float(eye_ned_m[1]), float(eye_ned_m[2])),
            q_ned_from_mount=from_euler(0.0, -depression, heading_rad + azimuth),
            targets=tuple(
                TargetView(
                    position_ned_m=(north_m, east_m, 0.0),
                    size_m=_PERSON_M,
                    tag_id=NO_TAG,
                    shape=TargetShape.PERSON,
                    course_rad=course_rad,
                )
                for (north_m, east_m), course_rad in zip(
                    walkers[0].tolist(), walkers[1].tolist(), strict=True
                )
            ),
        )
        known = rotation_of(product(from_euler(*tilt_rad, 0.0), from_euler(0.0, -depression, azimuth)))
        axes = CameraAxes(axes=known[:, [1, 2, 0]].T)
        picture = self._renderer.render(view)
        found = self._detector.detect(
            VideoFrame(time_us=time_us, pixels=picture, pose=CameraPose(axes=axes, height_m=height_m))
        )
        return None if found is None else (axes.directions(found.rays), patch_looks(picture, found.pixels))
