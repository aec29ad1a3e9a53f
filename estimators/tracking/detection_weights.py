"""How much each detection of a vehicle counts, when the errors of successive ones are nearly the same.

The likelihoods of frames are multiplied as if their errors were independent. They are not: GPS and attitude
err for tens of seconds in the same way, and a camera that is turned on its mount always does. So the variance
of each detection is multiplied by a factor, chosen such that the variance that the product claims is that of
its own error (docs/vision_search.md, "Correlated errors").
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.camera_sight import PoseErrors, rotation_matrix
from flightsim.foundation.vectors import Quaternion, euler_of

__all__ = ["DetectionWeights"]

Array = NDArray[np.float64]

_LEAST_SHARE: Final = 1.0 / 60_000.0  # of the information that one detection has alone
_LEAST_DOWN: Final = 0.05  # of a ray


@dataclass(slots=True)
class _Sum:
    """A weighted sum of errors on the ground, by their causes of unit variance: (2, 3) each."""

    mount: Array
    attitude: Array
    place: Array


class DetectionWeights:
    """The factors of the variances of one vehicle's detections.

    Args:
        errors: of its pose.
        pixel_rad: error of a detection's place in image coordinates.
    """

    def __init__(self, errors: PoseErrors, pixel_rad: float) -> None:
        self._errors, self._pixel_rad = errors, pixel_rad
        self.reset()

    def reset(self) -> None:
        """Begin again: the vehicle has rebooted."""
        self._sum = _Sum(*(np.zeros((2, 3)) for _ in range(3)))
        self._claimed = 0.0  # information, per axis
        self._variance = 0.0  # of the weighted sum, per axis
        self._time_us: int | None = None

    @property
    def information_m2(self) -> float:
        """Information that all detections together have about the place, per axis, 1/m^2."""
        return self._claimed

    def take(
        self,
        time_us: int,
        *,
        height_m: float,
        q_ned_from_frd: Quaternion,
        q_frd_from_mount: Quaternion,
        ray: tuple[float, float],
    ) -> float:
        """The factor for a detection, from 1 on; it counts in those of later ones.

        Args:
            time_us: of its exposure.
            height_m: of the camera above the ground.
            q_ned_from_frd, q_frd_from_mount: attitude of the vehicle, and of the camera on it.
            ray: image coordinates of the detection, right and down.
        """
        if self._time_us is not None and time_us < self._time_us:
            self.reset()
        e = self._errors
        since_s = 0.0 if self._time_us is None else (time_us - self._time_us) * 1e-6
        self._time_us = time_us
        self._sum.attitude *= _kept(since_s, e.attitude_time_s)
        self._sum.place *= _kept(since_s, e.place_time_s)
        found = self._errors_on_ground(height_m, q_ned_from_frd, q_frd_from_mount, ray)
        if found is None:
            return 1.0 / _LEAST_SHARE
        error, pixels_m2 = found
        variance = pixels_m2 + 0.5 * sum(float(np.sum(part * part)) for part in _parts(error))
        if not variance > 0.0:
            return 1.0
        shared = 0.5 * sum(
            float(np.sum(a * b)) for a, b in zip(_parts(error), _parts(self._sum), strict=True)
        )
        # the weight at which the variance of the new sum is the information that it claims
        free = 1.0 - 2.0 * shared
        root = math.sqrt(max(0.0, free * free + 4.0 * variance * (self._claimed - self._variance)))
        share = min(1.0, max(0.5 * (free + root), _LEAST_SHARE))
        weight = share / variance
        for total, part in zip(_parts(self._sum), _parts(error), strict=True):
            total += weight * part
        self._claimed += weight
        self._variance += 2.0 * weight * shared + weight * weight * variance
        return 1.0 / share

    def _errors_on_ground(
        self,
        height_m: float,
        q_ned_from_frd: Quaternion,
        q_frd_from_mount: Quaternion,
        ray: tuple[float, float],
    ) -> tuple[_Sum, float] | None:
        """Effect of errors of unit variance on the place on the ground, and the variance by the pixels; None:
        the ray does not meet the ground.
        """
        e = self._errors
        body = rotation_matrix(q_ned_from_frd)
        mount = body @ rotation_matrix(q_frd_from_mount)
        north, east, down = (mount @ (1.0, *ray)).tolist()
        if not (down > _LEAST_DOWN and height_m > 0.0):
            return None
        along = height_m / down
        # of a small change of the ray (NED) on the place, and of the camera's place
        of_ray = along * np.array([[1.0, 0.0, -north / down], [0.0, 1.0, -east / down]])
        of_place = np.array([[1.0, 0.0, -north / down], [0.0, 1.0, -east / down]])
        cross = np.array([[0.0, down, -east], [-down, 0.0, north], [east, -north, 0.0]])
        of_turn = of_ray @ cross  # a rotation about t changes the ray by t x ray
        roll, _, yaw = euler_of(q_ned_from_frd)
        pitch_axis = body @ (0.0, math.cos(roll), -math.sin(roll))
        axes = np.column_stack((e.roll_rad * body[:, 0], e.pitch_rad * pitch_axis, (0.0, 0.0, e.yaw_rad)))
        cosine, sine = math.cos(yaw), math.sin(yaw)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        spread = turn @ np.diag([e.forward_m, e.right_m, e.height_m]) @ turn.T
        pixels = of_ray @ mount[:, 1:]
        return (
            _Sum(mount=e.mount_rad * of_turn @ mount, attitude=of_turn @ axes, place=of_place @ spread),
            0.5 * self._pixel_rad**2 * float(np.sum(pixels * pixels)),
        )


def _parts(errors: _Sum) -> tuple[Array, Array, Array]:
    return errors.mount, errors.attitude, errors.place


def _kept(since_s: float, time_s: float) -> float:
    """Share of an error that is left after a time."""
    return 0.0 if time_s == 0.0 else math.exp(-since_s / time_s)
