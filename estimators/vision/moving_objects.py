"""The role of the visual front end: a frame and the pose of its camera in, moving objects on the ground out.

Measurements are in the level frame of the vehicle, scaled by the height over the ground (Tolman et al. 2021,
equations 36 to 40).
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from estimators.vision.camera import CameraGeometry
from estimators.vision.ground_points import on_ground
from estimators.vision.ground_registration import VideoCounts
from estimators.vision.video_frame import CameraPose, VideoFrame
from flightsim.foundation.checks import Positive
from flightsim.foundation.options import Options

__all__ = ["MovingObjectDetector", "MovingObjects", "ObjectParameters", "ObjectPoints", "objects_of"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectParameters(Options):
    """What can be an object, and how well it is measured.

    Attributes:
        link_m: points of one object are at most that far from the next one.
        link_m_s: and their velocities differ by at most that.
        fastest_m_s: faster points are of no object.
        farthest: places farther than that many heights are left out.
        centre_px: standard deviation of an object's middle in the picture, per axis.
        centre_m: standard deviation of the middle of what is seen of it from its own, per axis.
    """

    link_m: Positive = 4.5
    link_m_s: Positive = 5.0
    fastest_m_s: Positive = 30.0
    farthest: Positive = 4.0
    centre_px: Positive = 1.0
    centre_m: Positive = 0.4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MovingObjects:
    """Moving objects in one frame, as (n, ...) arrays.

    Attributes:
        time_us: of the frame.
        pixels: (n, 2) middles in the picture, without lens distortion, from its corner.
        rays: (n, 2) normalised image coordinates (equation 36).
        sizes_px: (n,) extents.
        points: (n,) numbers of corners, or of pixels, that show each.
        places: (n, 2) forward and right in the level frame (equation 40).
        covariances: (n, 2, 2) theirs, with those of the picture and of the pose.
        velocities: (n, 2) over the ground in the level frame; NaN: not measured.
    """

    time_us: int
    pixels: Array
    rays: Array
    sizes_px: Array
    points: NDArray[np.int64]
    places: Array
    covariances: Array
    velocities: Array

    def __len__(self) -> int:
        return len(self.pixels)


class MovingObjectDetector(ABC):
    """Finds moving objects in the frames of one camera.

    Args:
        camera: its geometry.

    Attributes:
        camera: as given.
    """

    def __init__(self, camera: CameraGeometry) -> None:
        self.camera = camera

    @abstractmethod
    def detect(self, frame: VideoFrame) -> MovingObjects | None:
        """The moving objects of a frame; frames come in the order of their times.

        Returns:
            None: this frame says nothing about moving objects (`counts` has the reason), which is different
            from a frame without any.
        """

    @property
    @abstractmethod
    def counts(self) -> VideoCounts:
        """What became of the frames."""

    @abstractmethod
    def reset(self) -> None:
        """Discard all earlier frames."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ObjectPoints:
    """Points of moving objects, before they are put together.

    Attributes:
        points_px: (n, 2) in OpenCV's pixels.
        sizes_px: (n,) extents.
        weights: (n,) number of pixels or corners of each.
        before_px: (n, 2) where each would be if it had not moved; None: not known.
        elapsed_s: since then.
    """

    points_px: Array
    sizes_px: Array
    weights: NDArray[np.int64]
    before_px: Array | None = None
    elapsed_s: float = 0.0


def objects_of(
    time_us: int,
    points: ObjectPoints,
    camera: CameraGeometry,
    pose: CameraPose,
    parameters: ObjectParameters,
    least_weight: int,
) -> MovingObjects:
    """Put the points of objects together, and place them on the ground.

    Args:
        time_us: of the frame.
        points: of the objects.
        camera, pose: of the frame.
        parameters: what can be an object.
        least_weight: objects with fewer pixels or corners are left out.
    """
    p = parameters
    places = _placed(points.points_px, camera, pose)
    near: NDArray[np.bool_] = np.asarray(np.isfinite(places).all(axis=1))
    near[near] = np.hypot(*places[near].T) < p.farthest * pose.height_m
    velocities = np.full_like(places, np.nan)
    if points.before_px is not None and points.elapsed_s > 0.0:
        velocities = (places - _placed(points.before_px, camera, pose)) / points.elapsed_s
        near[near] = np.hypot(*velocities[near].T) < p.fastest_m_s
    kept = np.flatnonzero(near)
    places, velocities, pixels = places[kept], velocities[kept], points.points_px[kept]
    weights, sizes = points.weights[kept], points.sizes_px[kept]
    found: list[tuple[Array, float, int, Array]] = []
    if len(kept):
        linked = _within(places, p.link_m)
        if points.before_px is not None:
            linked &= _within(velocities, p.link_m_s)
        count, labels = connected_components(linked, directed=False)
        for label in range(count):
            of = labels == label
            total = int(weights[of].sum())
            if total < least_weight:
                continue
            share = weights[of] / total
            low = (pixels[of] - 0.5 * sizes[of, None]).min(axis=0)
            high = (pixels[of] + 0.5 * sizes[of, None]).max(axis=0)
            found.append(
                (share @ pixels[of], float((high - low).max()), total, np.median(velocities[of], axis=0))
            )
    middles = np.array([entry[0] for entry in found]).reshape(-1, 2)
    rays = (middles + 0.5 - camera.centre_px) / camera.focal_px
    sigma_rad = math.hypot(p.centre_px / min(camera.focal_px), pose.tilt_sigma_rad)
    on, covariances = on_ground(pose.axes.directions(rays), pose.height_m, sigma_rad)
    by_height = on * (pose.height_sigma_m / pose.height_m)
    covariances += by_height[:, :, None] * by_height[:, None, :] + p.centre_m**2 * np.eye(2)
    return MovingObjects(
        time_us=time_us,
        pixels=middles + 0.5,
        rays=rays,
        sizes_px=np.array([entry[1] for entry in found]),
        points=np.array([entry[2] for entry in found], np.int64),
        places=on,
        covariances=covariances,
        velocities=np.array([entry[3] for entry in found]).reshape(-1, 2),
    )


def _placed(points_px: Array, camera: CameraGeometry, pose: CameraPose) -> Array:
    """Places (n, 2) on the ground of OpenCV's pixels (n, 2); NaN over the horizon."""
    rays = (points_px + 0.5 - camera.centre_px) / camera.focal_px
    places, _ = on_ground(pose.axes.directions(rays), pose.height_m, 0.0)
    return places


def _within(values: Array, distance: float) -> NDArray[np.bool_]:
    apart = np.linalg.norm(values[:, None] - values[None], axis=-1)
    found: NDArray[np.bool_] = apart <= distance
    return found
