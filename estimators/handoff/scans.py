"""Moving points of one camera, from its messages to places in the level frame of the aircraft.

Messages may be lost, repeated or out of order. A scan is used when all its points were received, or without
the missing ones when a later scan begins: a missing point is a missed detection, which the tracker expects.
"""

import math
from collections import Counter, deque
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.moving_points import MovingPoints
from estimators.tracking.line_of_sight import GimbalAttitude, gimbal_from_camera
from estimators.vision.ground_points import on_ground
from flightsim.foundation.vectors import ImagePoint, between, conjugate, from_euler, rotate

Array = NDArray[np.float64]

_GIMBALS_KEPT: Final = 64
_STALE_US: Final = 200_000
_FARTHEST: Final = 6.0  # heights over ground: farther away a small error of the angle is a large one
_REBOOT_US: Final = 1_000_000


@dataclass(slots=True, kw_only=True)
class PointScan:
    """The moving points of one frame.

    Attributes:
        time_us: vehicle time of the exposure.
        sigma: standard deviation of a point per axis, as a tangent.
        points: by number in the scan.
        total: number of points that the camera has sent.
    """

    time_us: int
    sigma: float
    total: int
    points: dict[int, ImagePoint] = field(default_factory=dict)


class ScanAssembler:
    """Puts the messages of one camera together to scans.

    Attributes:
        counts: messages "repeated" and "late", scans "complete", "incomplete" and "missed" (gaps of the scan
            numbers).
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._open: PointScan | None = None
        self._number: int | None = None
        self._done_us = -1

    def add(self, message: MovingPoints) -> list[PointScan]:
        """Add a message; the scans that are to be used now, in order: none, one or two."""
        found: list[PointScan] = []
        if message.time_us <= self._done_us:
            if message.time_us >= self._done_us - _REBOOT_US:
                self.counts["repeated" if message.time_us == self._done_us else "late"] += 1
                return found
            self._open, self._number = None, None  # the camera has rebooted
            self._done_us = -1
        scan = self._open
        if scan is not None and message.time_us < scan.time_us:
            self.counts["late"] += 1
            return found
        if scan is not None and message.time_us > scan.time_us:
            found.append(self._close("incomplete", scan))
            scan = None
        if scan is None:
            scan = PointScan(time_us=message.time_us, sigma=message.sigma, total=message.total)
            if self._number is not None:
                self.counts["missed"] += max(0, min(1000, message.scan - self._number - 1))
            self._open, self._number = scan, message.scan
        before = len(scan.points)
        scan.points.update(enumerate(message.points, start=message.first))
        if message.points and len(scan.points) == before:
            self.counts["repeated"] += 1
        if len(scan.points) >= scan.total:
            found.append(self._close("complete", scan))
        return found

    def _close(self, what: str, scan: PointScan) -> PointScan:
        self.counts[what] += 1
        self._open, self._done_us = None, scan.time_us
        return scan


class GimbalHistory:
    """Past attitudes of a gimbal."""

    def __init__(self) -> None:
        self._past: deque[GimbalAttitude] = deque(maxlen=_GIMBALS_KEPT)

    def add(self, attitude: GimbalAttitude) -> bool:
        """Add an attitude; returns False when it is not newer than the last one."""
        if self._past and attitude.time_us <= self._past[-1].time_us:
            if attitude.time_us > self._past[-1].time_us - _REBOOT_US:
                return False
            self._past.clear()
        self._past.append(attitude)
        return True

    def at(self, time_us: int) -> GimbalAttitude | None:
        """The attitude at a time; None: no attitude is close to it."""
        before = after = None
        for attitude in reversed(self._past):
            if attitude.time_us <= time_us:
                before = attitude
                break
            after = attitude
        known = [a for a in (before, after) if a is not None and abs(a.time_us - time_us) <= _STALE_US]
        if len(known) < 2 or known[0].from_north != known[1].from_north:
            return known[0] if known else None
        first, second = known
        share = (time_us - first.time_us) / (second.time_us - first.time_us)
        return GimbalAttitude(
            time_us=time_us, q=between(first.q, second.q, share), from_north=first.from_north
        )


def image_point(
    place_m: tuple[float, float], gimbal: GimbalAttitude, heading_rad: float, height_m: float
) -> ImagePoint | None:
    """Image point of a place on level ground, forward and right; None: it is behind the camera. It is the
    inverse of `level_places`.
    """
    line = (*place_m, height_m)
    if gimbal.from_north:
        line = rotate(from_euler(0.0, 0.0, heading_rad), line)
    ahead, right, down = rotate(conjugate(gimbal.q), line)
    return (right / ahead, down / ahead) if ahead > 1e-6 else None


def level_places(
    scan: PointScan, gimbal: GimbalAttitude, heading_rad: float, height_m: float, tilt_sigma_rad: float
) -> tuple[Array, Array] | None:
    """Places on level ground of a scan (Tolman et al. 2021, equations 36 to 40).

    Args:
        scan: image points.
        gimbal: its attitude at the exposure.
        heading_rad: heading of the aircraft then; not used when the gimbal's yaw is relative to it.
        height_m: height over the ground.
        tilt_sigma_rad: errors of roll and pitch that change from frame to frame.

    Returns:
        (n, 2) forward and right, and (n, 2, 2) covariances; None: the height or the heading is not known.
    """
    if not height_m > 1.0 or (gimbal.from_north and not math.isfinite(heading_rad)):
        return None
    turn = from_euler(0.0, 0.0, -heading_rad) if gimbal.from_north else None
    directions = np.zeros((len(scan.points), 3))
    for row, number in enumerate(sorted(scan.points)):
        line = rotate(gimbal.q, gimbal_from_camera(*scan.points[number]))
        directions[row] = line if turn is None else rotate(turn, line)
    places, covariances = on_ground(directions, height_m, math.hypot(scan.sigma, tilt_sigma_rad))
    near = np.hypot(places[:, 0], places[:, 1]) < _FARTHEST * height_m  # NaN is not
    return places[near], covariances[near]
