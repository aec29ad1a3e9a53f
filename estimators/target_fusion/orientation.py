"""Quaternions with their times, interpolated: attitude of a vehicle, and of its gimbal."""

import math
from bisect import bisect_left

__all__ = ["Orientations", "Quaternion", "from_euler", "product", "rotated", "yaw_of"]

Quaternion = tuple[float, float, float, float]
"""Hamilton, w x y z."""

Vector = tuple[float, float, float]


def from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """The rotation by yaw, then pitch, then roll about the turned axes."""
    cr, sr = math.cos(0.5 * roll_rad), math.sin(0.5 * roll_rad)
    cp, sp = math.cos(0.5 * pitch_rad), math.sin(0.5 * pitch_rad)
    cy, sy = math.cos(0.5 * yaw_rad), math.sin(0.5 * yaw_rad)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def rotated(q: Quaternion, v: Vector) -> Vector:
    """A vector turned by a unit quaternion."""
    w, x, y, z = q
    tx, ty, tz = 2.0 * (y * v[2] - z * v[1]), 2.0 * (z * v[0] - x * v[2]), 2.0 * (x * v[1] - y * v[0])
    return (
        v[0] + w * tx + y * tz - z * ty,
        v[1] + w * ty + z * tx - x * tz,
        v[2] + w * tz + x * ty - y * tx,
    )


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """The rotation by b, then by a."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def yaw_of(q: Quaternion) -> float:
    """Yaw of a rotation."""
    w, x, y, z = q
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


class Orientations:
    """Orientations by time, for a few seconds back.

    Args:
        history_us: how long they are kept.
        reach_us: how far from the nearest one is still good enough.
    """

    __slots__ = ("_history_us", "_quaternions", "_reach_us", "_times")

    def __init__(self, history_us: int, reach_us: int) -> None:
        self._history_us = history_us
        self._reach_us = reach_us
        self._times: list[int] = []
        self._quaternions: list[Quaternion] = []

    def add(self, time_us: int, q: Quaternion) -> None:
        """Keep one, newer than those before."""
        self._times.append(time_us)
        self._quaternions.append(q)
        drop = bisect_left(self._times, time_us - self._history_us)
        if drop > 16:  # in bunches: a list is cheap to cut, not to cut often
            del self._times[:drop], self._quaternions[:drop]

    def clear(self) -> None:
        """Forget all."""
        self._times.clear()
        self._quaternions.clear()

    def covers(self, time_us: int) -> bool:
        """Whether one as new as that is there."""
        return bool(self._times) and self._times[-1] >= time_us

    def at(self, time_us: int) -> Quaternion | None:
        """Between the two next to a time, or the nearest if it is near; None when none is."""
        after = bisect_left(self._times, time_us)
        if 0 < after < len(self._times):
            before_us, after_us = self._times[after - 1], self._times[after]
            if after_us - before_us <= 2 * self._reach_us:
                share = (time_us - before_us) / (after_us - before_us)
                return _between(self._quaternions[after - 1], self._quaternions[after], share)
        near = [i for i in (after - 1, after) if 0 <= i < len(self._times)]
        near.sort(key=lambda i: abs(self._times[i] - time_us))
        if not near or abs(self._times[near[0]] - time_us) > self._reach_us:
            return None
        return self._quaternions[near[0]]


def _between(a: Quaternion, b: Quaternion, share: float) -> Quaternion:
    """Normalised linear interpolation, the short way round: good for the few degrees between samples."""
    sign = 1.0 if a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] >= 0.0 else -1.0
    w, x, y, z = (p + share * (sign * q - p) for p, q in zip(a, b, strict=True))
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if norm < 1e-9:
        return a
    return w / norm, x / norm, y / norm, z / norm
