"""What a searching camera's frame says about a target on level ground: its parameters and their checks.

Source: Tisdale, Ryan, Kim, Tornqvist and Hedrick 2008, "A multiple UAV system for vision-based search and
localization", section III, as docs/vision_search.md corrects it. `estimators.tracking.camera_likelihood`
computes the likelihood from these.

North and east are metres in the area's frame. Camera axes: x along the optical axis, y to the right of the
picture, z down. Image coordinates are those of the ray, a = y / x and b = z / x, without lens distortion.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from flightsim.foundation.vectors import Quaternion, Vector, conjugate, euler_of, rotate

__all__ = [
    "CameraSight",
    "Detection",
    "DetectionRate",
    "PoseErrors",
    "SightModel",
    "lower_root",
    "rotation_matrix",
]

Array = NDArray[np.float64]

MAX_DETECTIONS: Final = 2
"""Detections of the target in one frame that a likelihood counts; of one target at most one is true."""

LEAST_HEIGHT_M: Final = 0.1
"""Height of a camera above the ground below which its detections say nothing."""

_LEAST_DOWN: Final = 1e-3  # of a ray that meets the ground


class Detection(NamedTuple):
    """The Gaussian of the target's image coordinates by a detection. Its information is L L', with the lower
    triangle L of `first`, `cross` and `last`.
    """

    a: float
    b: float
    first: float
    cross: float
    last: float

    @classmethod
    def of_covariance(cls, a: float, b: float, aa: float, ab: float, bb: float) -> "Detection":
        """The Gaussian of a mean and a covariance."""
        determinant = aa * bb - ab * ab
        first = math.sqrt(bb / determinant)
        return cls(a, b, first, -ab / (determinant * first), 1.0 / (first * math.sqrt(determinant)))


def lower_root(root: Array) -> tuple[float, float, float]:
    """11, 21 and 22 of the lower triangle L with L L' = R R', of a root R (2, 2) that may be singular."""
    lower = np.linalg.qr(root.T)[1].T
    (first, _), (cross, last) = (lower * np.where(np.diag(lower) < 0.0, -1.0, 1.0)).tolist()
    return first, cross, last


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionRate:
    """Probability that a target in view is detected, by the resolution r: the pixels that its side covers.

    P(D | V, r) = peak / (1 + exp(-(constant + linear r + quadratic r^2))): Bayes' rule on Gaussian
    resolutions of detected and of missed targets (equation 6) has this form; with equal variances it is a
    logistic curve.

    Attributes:
        peak: bound of the probability.
        constant, linear, quadratic: of the logarithm of the odds.
    """

    peak: float = 1.0
    constant: float = 0.0
    linear: float = 0.0
    quadratic: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 < self.peak <= 1.0:
            raise EstimatorError(f"peak {self.peak:g} is not in 0..1, or is 0")
        if not all(map(math.isfinite, (self.constant, self.linear, self.quadratic))):
            raise EstimatorError("constant, linear, quadratic are not finite numbers")

    @classmethod
    def of_gaussians(
        cls, *, detected: tuple[float, float], missed: tuple[float, float], rate: float
    ) -> "DetectionRate":
        """Equation 6.

        Args:
            detected, missed: mean and standard deviation of the resolution of detected and of missed targets.
            rate: share of the targets in view that was detected.
        """
        (m1, s1), (m0, s0) = detected, missed
        if not (s1 > 0.0 and s0 > 0.0 and 0.0 < rate < 1.0):
            raise EstimatorError(f"rate {rate:g} is not between 0 and 1, or a deviation is not above 0")
        return cls(
            constant=math.log(rate / (1.0 - rate) * s0 / s1) - 0.5 * (m1 / s1) ** 2 + 0.5 * (m0 / s0) ** 2,
            linear=m1 / s1**2 - m0 / s0**2,
            quadratic=0.5 / s0**2 - 0.5 / s1**2,
        )

    @classmethod
    def rising(cls, *, half_px: float, width_px: float, peak: float) -> "DetectionRate":
        """A logistic curve: half of the peak at `half_px`, 73 % of it `width_px` later."""
        if not width_px > 0.0:
            raise EstimatorError(f"width_px {width_px:g} is not possible; give more than 0")
        return cls(peak=peak, constant=-half_px / width_px, linear=1.0 / width_px)

    def probability(self, resolution_px: Array | float) -> Array:
        """The probability at resolutions."""
        r = np.asarray(resolution_px, dtype=np.float64)
        odds = self.constant + r * (self.linear + r * self.quadratic)
        found: Array = self.peak / (1.0 + np.exp(-np.clip(odds, -700.0, 700.0)))
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class SightModel:
    """What a team knows about its detector and its target.

    Attributes:
        rate: probability of detection by the resolution.
        target_size_m: side of the target.
        false_rate: probability that a frame in which the target is not detected has a false detection,
            anywhere in the picture with the same density (P_false of the paper).
        pixel_sigma_px: error of a detection's place in the picture, per axis.
        border_sides: a target is detected when its centre is farther than this from the border, in sides of
            the target: 0.5 where all of it must be in the picture.

    Raises:
        EstimatorError: a value is not possible.
    """

    rate: DetectionRate
    target_size_m: float
    false_rate: float = 0.004
    pixel_sigma_px: float = 1.0
    border_sides: float = 0.6

    def __post_init__(self) -> None:
        for name in ("target_size_m", "pixel_sigma_px"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise EstimatorError(f"{name} {value:g} is not possible; give more than 0")
        if not 0.0 < self.false_rate < 1.0:
            raise EstimatorError(
                f"false_rate {self.false_rate:g} is not between 0 and 1; without false detections one "
                "wrong detection would be the end of the belief"
            )
        if not 0.0 <= self.border_sides <= 10.0:
            raise EstimatorError(f"border_sides {self.border_sides:g} is not in 0..10")


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseErrors:
    """Standard deviations of a vehicle's own pose, and how long the errors last.

    Errors of successive frames are those of first-order Gauss-Markov processes, but for those that stay: of
    the mount, of the pictures' times, of the ground, and the bias of the heading. `SharedErrors` takes them
    into account.

    Attributes:
        forward_m, right_m: of the place, along and across the heading.
        height_m: of the height above ground.
        yaw_rad, pitch_rad, roll_rad: of the attitude.
        mount_rad: of the camera's attitude on the vehicle, about each of its axes.
        yaw_bias_rad: of the part of the yaw's error that stays.
        latency_s: of the pictures' times.
        ground_m: of the ground's height.
        place_time_s, attitude_time_s: correlation times of place and height, and of all angles; 0:
            independent frames, as in the paper.
    """

    forward_m: float = 0.3
    right_m: float = 0.3
    height_m: float = 0.5
    yaw_rad: float = 0.02
    pitch_rad: float = 0.005
    roll_rad: float = 0.005
    mount_rad: float = 0.0
    yaw_bias_rad: float = 0.0
    latency_s: float = 0.0
    ground_m: float = 0.0
    place_time_s: float = 0.0
    attitude_time_s: float = 0.0

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise EstimatorError(f"{name} {value:g} is not possible; give 0 or more")

    def covariances(
        self,
        q_ned_from_frd: Quaternion,
        q_frd_from_mount: Quaternion,
        velocity_m_s: tuple[float, float] = (0.0, 0.0),
    ) -> tuple[Array, Array]:
        """Covariances of one pose by all its errors.

        Args:
            q_ned_from_frd, q_frd_from_mount: attitude of the vehicle, and of the camera on it.
            velocity_m_s: of the vehicle, north and east.

        Returns:
            (3, 3) of the place, NED, m^2, and (3, 3) of the rotation about the camera's axes, rad^2.
        """
        roll, _, yaw = euler_of(q_ned_from_frd)
        cosine, sine = math.cos(yaw), math.sin(yaw)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        height_m2 = self.height_m**2 + self.ground_m**2
        place = turn @ np.diag([self.forward_m**2, self.right_m**2, height_m2]) @ turn.T
        late_m = self.latency_s * np.array(velocity_m_s)
        place[:2, :2] += np.outer(late_m, late_m)
        to_camera = conjugate(q_frd_from_mount)
        axes = (
            (self.roll_rad, (1.0, 0.0, 0.0)),
            (self.pitch_rad, (0.0, math.cos(roll), -math.sin(roll))),
            (math.hypot(self.yaw_rad, self.yaw_bias_rad), rotate(conjugate(q_ned_from_frd), (0.0, 0.0, 1.0))),
        )
        rotation = self.mount_rad**2 * np.eye(3)
        for sigma_rad, axis_frd in axes:
            axis = np.array(rotate(to_camera, axis_frd))
            rotation += sigma_rad**2 * np.outer(axis, axis)
        return place, rotation


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CameraSight:
    """One frame: where a camera was, how well this is known, and what it detected.

    Attributes:
        place_ned_m: of the camera; the ground is at down = 0.
        q_ned_from_mount: attitude of the camera's axes.
        place_m2: (3, 3) covariance of the place, NED.
        rotation_rad2: (3, 3) covariance of the rotation about the camera's axes.
        width_px, height_px: size of the picture; its centre is on the optical axis.
        focal_px: focal length.
        distortion: k1, k2, p1, p2, k3 of Brown's model.
        detections: (m, 2) a and b of the detections of the target; m = 0: none.
        roots: (m, 3) roots of the detections' information, as in `Detection`; None: those of the pose's
            covariances, as if no other frame had the same errors.

    Raises:
        EstimatorError: a value is not possible.
    """

    place_ned_m: Vector
    q_ned_from_mount: Quaternion
    place_m2: Array
    rotation_rad2: Array
    width_px: int
    height_px: int
    focal_px: float
    distortion: tuple[float, ...] = (0.0,) * 5
    detections: Array = field(default_factory=lambda: np.zeros((0, 2)))
    roots: Array | None = None

    def __post_init__(self) -> None:
        numbers = (*self.place_ned_m, *self.q_ned_from_mount, self.focal_px, *self.distortion)
        if not all(map(math.isfinite, numbers)):
            raise EstimatorError("a camera's pose or geometry is not finite")
        if not (self.width_px > 0 and self.height_px > 0 and self.focal_px > 0.0):
            raise EstimatorError(
                f"{self.width_px} x {self.height_px} px, focal length {self.focal_px:g} px is no picture"
            )
        if len(self.distortion) != 5:
            raise EstimatorError(f"distortion {self.distortion} is not k1, k2, p1, p2, k3")
        if self.detections.ndim != 2 or self.detections.shape[1] != 2:
            raise EstimatorError(f"detections have the shape {self.detections.shape}, not (m, 2)")
        if self.roots is not None and self.roots.shape != (len(self.detections), 3):
            raise EstimatorError(f"roots have the shape {self.roots.shape}, not (m, 3)")

    @property
    def height_m(self) -> float:
        """Height of the camera above the ground."""
        return -self.place_ned_m[2]

    @property
    def r_mount_from_ned(self) -> Array:
        """(3, 3) rotation."""
        return rotation_matrix(conjugate(self.q_ned_from_mount))

    def blurred(self, variance_m2: float) -> "CameraSight":
        """The same frame with a further variance of the place, north and east: of a target that has walked
        since, or of the place in a cell.
        """
        if not variance_m2 > 0.0:
            return self
        roots = None if self.roots is None else self.roots.copy()
        for ray, root in zip(self.detections, () if roots is None else roots, strict=False):
            by_ground = self._image_by_ground(ray)
            if by_ground is not None:
                lower = np.array([[root[0], 0.0], [root[1], root[2]]])
                wide = lower.T @ by_ground
                squares, axes = np.linalg.eigh(wide @ wide.T)
                rest = axes / np.sqrt(1.0 + variance_m2 * np.maximum(0.0, squares))
                root[:] = lower_root(lower @ rest)
        place_m2 = self.place_m2 + np.diag([variance_m2, variance_m2, 0.0])
        return replace(self, place_m2=place_m2, roots=roots)

    @property
    def known_m2(self) -> float:
        """Least variance on the ground of what the frame says: of its detections, or of the pose."""
        if self.roots is None or not len(self.roots):
            place, turn = self.place_m2, self.rotation_rad2
            return float(min(place[0, 0], place[1, 1]) + self.height_m**2 * min(turn[1, 1], turn[2, 2]))
        most = 0.0
        for ray, (first, cross, last) in zip(self.detections, self.roots, strict=True):
            by_ground = self._image_by_ground(ray)
            if by_ground is not None:
                upper = np.array([[first, cross], [0.0, last]]) @ by_ground
                most = max(most, float(np.linalg.norm(upper, 2)) ** 2)
        return 1.0 / most if most > 0.0 else math.inf

    def _image_by_ground(self, ray: Array) -> Array | None:
        """(2, 2) derivative of image coordinates by the place on the ground, at a ray; None: it does not meet
        the ground.
        """
        a, b = ray.tolist()
        r = self.r_mount_from_ned
        down = float(r.T[2] @ (1.0, a, b))
        if not (down > _LEAST_DOWN and self.height_m > LEAST_HEIGHT_M):
            return None
        return np.asarray((r[1:, :2] - np.outer((a, b), r[0, :2])) * (down / self.height_m))


def rotation_matrix(q: Quaternion) -> Array:
    """(3, 3) matrix whose columns are the rotated axes."""
    return np.array([rotate(q, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]).T
