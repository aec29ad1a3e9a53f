"""What each detection of a vehicle adds to the knowledge of the target's place.

The likelihoods of frames are multiplied as if their errors were independent. They are not: GPS and attitude
err for tens of seconds in the same way, and a camera that is turned on its mount, a biased heading, late
pictures and a wrong height of the ground err in the same way in all frames. So a linear filter of the
vehicle's own detections has these errors as states beside the target's place; passes in several directions
estimate them. Each detection then stands for the information that it has added to the place: the product over
the frames is the place's own posterior (docs/vision_search.md, "Shared errors").
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.camera_sight import Detection, PoseErrors, lower_root, rotation_matrix
from flightsim.foundation.vectors import Quaternion, euler_of

__all__ = ["SharedErrors", "View"]

Array = NDArray[np.float64]

_PLACE: Final = slice(0, 2)
_ATTITUDE: Final = slice(2, 5)
_POSITION: Final = slice(5, 8)
_MOUNT: Final = slice(8, 11)
_YAW, _LATENCY, _GROUND, _SIZE = 11, 12, 13, 14
_LEAST_DOWN: Final = 0.05  # of a ray
_LEAST_SHARE: Final = 1.0 / 400.0  # of the information of one detection alone; less waits for the next one
_GATE: Final = 30.0  # squared distance of a detection from the expected place; exceeded by 3e-7 of the true
_MOST_TRACKS: Final = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """How a vehicle saw a target.

    Attributes:
        time_us: of the exposure.
        place_ne_m: of the camera.
        height_m: of the camera above the ground.
        q_ned_from_frd, q_frd_from_mount: attitude of the vehicle, and of the camera on it.
        ray: image coordinates of the detection, right and down.
        rate_m_s: velocity, north and east, at which the vehicle's motion moves this ray over the ground.
    """

    time_us: int
    place_ne_m: tuple[float, float]
    height_m: float
    q_ned_from_frd: Quaternion
    q_frd_from_mount: Quaternion
    ray: tuple[float, float]
    rate_m_s: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class _OnGround:
    """A detection on the ground.

    Attributes:
        place: (2,) that the ray meets, m.
        by_errors: (2, 14) derivative of that place by the filter's states, errors of unit variance.
        by_ray: (2, 2) derivative by the image coordinates.
    """

    place: Array
    by_errors: Array
    by_ray: Array


class _Track:
    """Detections that fit one place: mean and covariance of the states, and what was given out of them."""

    def __init__(self, seen: _OnGround, noise: Array) -> None:
        errors = seen.by_errors.copy()
        errors[:, _PLACE] = 0.0
        self.mean: Array = np.zeros(_SIZE)
        self.mean[_PLACE] = seen.place
        self.covariance: Array = np.eye(_SIZE)
        # whatever the place was before: it is the detection's, less its errors
        self.covariance[_PLACE, _PLACE] = errors @ errors.T + noise
        self.covariance[_PLACE] -= errors
        self.covariance[:, _PLACE] -= errors.T
        self.given: Array = np.zeros((2, 2))  # information
        self.given_vector: Array = np.zeros(2)  # information times place

    def predict(self, since_s: float, errors: PoseErrors, walk_m2_s: float) -> None:
        """Errors that fade, and a target that walks."""
        for part, time_s in ((_ATTITUDE, errors.attitude_time_s), (_POSITION, errors.place_time_s)):
            kept = 0.0 if time_s == 0.0 else math.exp(-since_s / time_s)
            self.mean[part] *= kept
            self.covariance[part] *= kept
            self.covariance[:, part] *= kept
            self.covariance[part, part] += (1.0 - kept * kept) * np.eye(3)
        if walk_m2_s > 0.0 and since_s > 0.0:
            walked = walk_m2_s * since_s * np.eye(2)
            self.covariance[_PLACE, _PLACE] += walked
            fade = np.linalg.inv(np.eye(2) + self.given @ walked)
            self.given, self.given_vector = fade @ self.given, fade @ self.given_vector

    def fits(self, seen: _OnGround, noise: Array) -> bool:
        """Whether a detection lies where the track expects it."""
        off = seen.place - seen.by_errors @ self.mean
        spread = seen.by_errors @ self.covariance @ seen.by_errors.T + noise
        return float(off @ np.linalg.solve(spread, off)) <= _GATE

    def update(self, seen: _OnGround, noise: Array) -> None:
        """Use a detection."""
        h, p = seen.by_errors, self.covariance
        spread = h @ p @ h.T + noise
        gain = np.linalg.solve(spread, h @ p).T
        self.mean = self.mean + gain @ (seen.place - h @ self.mean)
        rest = np.eye(_SIZE) - gain @ h
        self.covariance = rest @ p @ rest.T + gain @ noise @ gain.T

    def give(self, about: Array, alone: Array) -> tuple[Array, Array]:
        """Root R (2, 2) of the information R R' about the place that was not given before, and the place (2,)
        that it is of, less `about`. Directions in which it is a small share of what a detection has `alone`
        wait.
        """
        information = np.linalg.inv(self.covariance[_PLACE, _PLACE])
        new = information - self.given
        vector = information @ self.mean[_PLACE] - self.given_vector - new @ about
        root = np.linalg.cholesky(alone)
        shares, axes = np.linalg.eigh(np.linalg.solve(root, np.linalg.solve(root, new).T))
        kept = shares >= _LEAST_SHARE
        directions = root @ axes  # `new` is the sum of shares times their outer products
        along = np.where(kept, np.linalg.solve(directions, vector), 0.0)
        shares = np.where(kept, shares, 0.0)
        taken = (directions * shares) @ directions.T
        self.given = self.given + taken
        self.given_vector = self.given_vector + taken @ about + directions @ along
        off = np.linalg.solve(directions.T, along / np.maximum(shares, _LEAST_SHARE))
        return directions * np.sqrt(shares), off


class SharedErrors:
    """The errors that one vehicle's detections share.

    Detections that do not fit those before, of another target or false ones, begin a track of their own.

    Args:
        errors: of its pose.
        pixel_rad: error of a detection's place in image coordinates.
        walk_m_sqrt_s: of the target.
    """

    def __init__(self, errors: PoseErrors, pixel_rad: float, *, walk_m_sqrt_s: float = 0.0) -> None:
        self._errors, self._pixel_rad, self._walk_m2_s = errors, pixel_rad, walk_m_sqrt_s**2
        self.reset()

    def reset(self) -> None:
        """Begin again: the vehicle has rebooted."""
        self._tracks: list[_Track] = []
        self._time_us: int | None = None

    @property
    def covariance_m2(self) -> Array | None:
        """(2, 2) covariance of the place by all detections of the newest track, north and east; None: there
        was none.
        """
        return self._tracks[0].covariance[_PLACE, _PLACE].copy() if self._tracks else None

    def take(self, view: View) -> Detection:
        """What a detection says about the place that those before did not say.

        Returns:
            The place in the picture that stands for it, and the root of its information there.
        """
        if self._time_us is not None and view.time_us < self._time_us:
            self.reset()
        since_s = 0.0 if self._time_us is None else (view.time_us - self._time_us) * 1e-6
        self._time_us = view.time_us
        for track in self._tracks:
            track.predict(since_s, self._errors, self._walk_m2_s)
        seen = self._on_ground(view)
        if seen is None:
            return Detection(*view.ray, 0.0, 0.0, 0.0)
        noise = self._pixel_rad**2 * seen.by_ray @ seen.by_ray.T
        shared = seen.by_errors[:, _PLACE.stop :]
        alone = np.asarray(np.linalg.inv(shared @ shared.T + noise), dtype=np.float64)
        fitting = [track for track in self._tracks if track.fits(seen, noise)]
        if fitting:
            track = fitting[0]
            self._tracks.remove(track)
            track.update(seen, noise)
        else:
            track = _Track(seen, noise)
            del self._tracks[_MOST_TRACKS - 1 :]
        self._tracks.insert(0, track)
        root, off = track.give(seen.place, alone)
        a, b = np.linalg.solve(seen.by_ray, off).tolist()
        return Detection(view.ray[0] + a, view.ray[1] + b, *lower_root(seen.by_ray.T @ root))

    def _on_ground(self, view: View) -> _OnGround | None:
        """None: the ray does not meet the ground."""
        e = self._errors
        body = rotation_matrix(view.q_ned_from_frd)
        mount = body @ rotation_matrix(view.q_frd_from_mount)
        north, east, down = (mount @ (1.0, *view.ray)).tolist()
        if not (down > _LEAST_DOWN and view.height_m > 0.0):
            return None
        along = view.height_m / down
        of_place = np.array([[1.0, 0.0, -north / down], [0.0, 1.0, -east / down]])
        of_ray = along * of_place  # of a small change of the ray, NED
        cross = np.array([[0.0, down, -east], [-down, 0.0, north], [east, -north, 0.0]])
        of_turn = of_ray @ cross  # a rotation about t changes the ray by t x ray
        roll, _, yaw = euler_of(view.q_ned_from_frd)
        pitch_axis = body @ (0.0, math.cos(roll), -math.sin(roll))
        axes = np.column_stack((e.roll_rad * body[:, 0], e.pitch_rad * pitch_axis, (0.0, 0.0, e.yaw_rad)))
        cosine, sine = math.cos(yaw), math.sin(yaw)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        by_errors = np.zeros((2, _SIZE))
        by_errors[:, _PLACE] = np.eye(2)
        by_errors[:, _ATTITUDE] = of_turn @ axes
        by_errors[:, _POSITION] = of_place @ turn @ np.diag([e.forward_m, e.right_m, e.height_m]) @ turn.T
        by_errors[:, _MOUNT] = e.mount_rad * of_turn @ mount
        by_errors[:, _YAW] = e.yaw_bias_rad * of_turn[:, 2]
        by_errors[:, _LATENCY] = e.latency_s * np.array(view.rate_m_s)
        by_errors[:, _GROUND] = e.ground_m * of_place[:, 2]
        return _OnGround(
            np.array(view.place_ne_m) + along * np.array([north, east]), by_errors, of_ray @ mount[:, 1:]
        )
