"""How far the clocks of a video and of the vehicle's attitude are apart, by the rotation that both show.

A camera that is turned about its optical axis sees all of the ground turn, whatever its height and speed. The
rotation between two pictures is compared with that of the reported attitude, shifted in time: the best shift
is the clocks' difference. Without rotation nothing can be said.
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from estimators.vision.tag_detector import Picture
from flightsim.foundation.vectors import Quaternion, Vector, conjugate, from_euler, product

__all__ = ["ClockCheck", "ClockDifference"]

Array = NDArray[np.float64]

_WIDTH_PX: Final = 320  # of the pictures that are compared
_CORNERS: Final = 120
_LEAST_CORNERS: Final = 20
_LONGEST_US: Final = 300_000  # between two pictures
_SHIFT_S: Final = 1.5
_STEP_S: Final = 0.02
_PAIRS: Final = 1200
_ATTITUDES: Final = 40_000
_LEAST_PAIRS: Final = 30
_LEAST_TURN_RAD: Final = math.radians(6.0)  # in all pairs, root of the sum of squares
_LEAST_SHARE: Final = 0.8  # of the rotation that the best shift explains


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockDifference:
    """The difference of two clocks.

    Attributes:
        apart_s: what has to be added to the times of the pictures, to agree with the attitude.
        explained: share of the pictures' rotation that the attitude then explains.
    """

    apart_s: float
    explained: float


class ClockCheck:
    """Compares the rotation in pictures with that of the attitude.

    Args:
        mount_rad: roll, pitch and yaw of the camera against the body.
    """

    def __init__(self, mount_rad: Vector) -> None:
        self._q_frd_from_mount = from_euler(*mount_rad)
        self._grey: Picture | None = None
        self._exposed_us = 0
        self._pairs: deque[tuple[int, int, float]] = deque(maxlen=_PAIRS)
        self._times_us: list[int] = []
        self._turned_rad: list[float] = []  # about the optical axis, since the first attitude
        self._q: Quaternion | None = None

    def take_attitude(self, time_us: int, roll_rad: float, pitch_rad: float, yaw_rad: float) -> None:
        """Take an attitude (ATTITUDE)."""
        q = product(from_euler(roll_rad, pitch_rad, yaw_rad), self._q_frd_from_mount)
        if self._times_us and time_us <= self._times_us[-1]:
            if time_us > self._times_us[-1] - 10 * _LONGEST_US:
                return  # late or repeated
            self._times_us, self._turned_rad, self._q = [], [], None  # the vehicle has booted again
            self._pairs.clear()
        turn = 0.0
        if self._q is not None:
            w, x, _, _ = product(conjugate(self._q), q)
            turn = math.remainder(2.0 * math.atan2(x, w), math.tau)
        self._q = q
        self._times_us.append(time_us)
        self._turned_rad.append((self._turned_rad[-1] if self._turned_rad else 0.0) + turn)
        if len(self._times_us) > _ATTITUDES:
            del self._times_us[: _ATTITUDES // 2], self._turned_rad[: _ATTITUDES // 2]

    def take_picture(self, exposed_us: int, picture: Picture) -> None:
        """Take a picture (height, width, 3), BGR."""
        height, width = picture.shape[:2]
        scale = min(1.0, _WIDTH_PX / width)
        small = cv2.resize(
            picture, (round(scale * width), round(scale * height)), interpolation=cv2.INTER_AREA
        )
        grey: Picture = cv2.cvtColor(small, cv2.COLOR_BGR2GRAY)  # type: ignore[assignment]
        before, before_us = self._grey, self._exposed_us
        self._grey, self._exposed_us = grey, exposed_us
        if before is None or not 0 < exposed_us - before_us <= _LONGEST_US:
            return
        turn = _rotation(before, grey)
        if turn is not None:
            self._pairs.append((before_us, exposed_us, turn))

    def difference(self) -> ClockDifference | None:
        """The clocks' difference; None: too little rotation was seen, or the attitude does not explain it."""
        if len(self._pairs) < _LEAST_PAIRS or len(self._times_us) < 2:
            return None
        times_s = np.array(self._times_us) * 1e-6
        turned = np.array(self._turned_rad)
        begin, end, seen = (np.array(values) for values in zip(*self._pairs, strict=True))
        begin, end = begin * 1e-6, end * 1e-6
        best: ClockDifference | None = None
        for shift_s in np.arange(-_SHIFT_S, _SHIFT_S + 0.5 * _STEP_S, _STEP_S).tolist():
            known = (begin + shift_s >= times_s[0]) & (end + shift_s <= times_s[-1])
            power = float(np.sum(seen[known] ** 2))
            if int(known.sum()) < _LEAST_PAIRS or power < _LEAST_TURN_RAD**2:
                continue
            expected = np.interp(end[known] + shift_s, times_s, turned)
            expected -= np.interp(begin[known] + shift_s, times_s, turned)
            explained = 1.0 - float(np.sum((seen[known] - expected) ** 2)) / power
            if best is None or explained > best.explained:
                best = ClockDifference(apart_s=shift_s, explained=explained)
        return best if best is not None and best.explained >= _LEAST_SHARE else None


def _rotation(before: Picture, after: Picture) -> float | None:
    """Angle by which the camera has turned about its optical axis, from its right to its down; None: too few
    corners can be followed.
    """
    corners = cv2.goodFeaturesToTrack(before, _CORNERS, 0.01, 8.0)
    if corners is None or len(corners) < _LEAST_CORNERS:
        return None
    moved, found, _ = cv2.calcOpticalFlowPyrLK(before, after, corners, None)  # type: ignore[call-overload]
    kept = found.ravel() == 1
    if int(kept.sum()) < _LEAST_CORNERS:
        return None
    affine, inliers = cv2.estimateAffinePartial2D(corners[kept], moved[kept])
    if affine is None or int(inliers.sum()) < _LEAST_CORNERS // 2:
        return None
    # what is seen turns the other way than the camera
    return -math.atan2(float(affine[1, 0]), float(affine[0, 0]))
