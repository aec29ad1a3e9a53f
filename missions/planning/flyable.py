"""A pattern as a path that an aircraft can follow: corners have the aircraft's radius; the path is sampled
finely, with course and curvature.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from missions.patterns.curve import ArcLengthTable, Array, Curve
from missions.patterns.polyline import Polyline
from missions.planning.corners import Corner

_STEP_M: Final = 2.0
_STRAIGHT_RAD: Final = 1e-3
_BACK_M: Final = 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FlyablePath:
    """Points along a path.

    Attributes:
        points_m: (n, 2) north, east.
        arc_m: (n,) distance flown from the pattern's start, increasing; negative before the start.
        course_rad: (n,) direction, unwrapped.
        curvature_per_m: (n,) positive turning right.
    """

    points_m: Array
    arc_m: Array
    course_rad: Array
    curvature_per_m: Array

    @property
    def length_m(self) -> float:
        """From the pattern's start to the path's end."""
        return float(self.arc_m[-1])

    @property
    def reach_m(self) -> float:
        """Largest distance from the origin."""
        return float(np.hypot(*self.points_m.T).max())

    def until(self, length_m: float) -> "FlyablePath":
        """The first part of the path, up to a length."""
        count = max(2, int(np.searchsorted(self.arc_m, length_m)) + 1)
        return FlyablePath(
            points_m=self.points_m[:count],
            arc_m=self.arc_m[:count],
            course_rad=self.course_rad[:count],
            curvature_per_m=self.curvature_per_m[:count],
        )

    def moved(self, north_m: float, east_m: float) -> "FlyablePath":
        """The path moved by an offset."""
        return FlyablePath(
            points_m=self.points_m + np.array((north_m, east_m)),
            arc_m=self.arc_m,
            course_rad=self.course_rad,
            curvature_per_m=self.curvature_per_m,
        )

    def with_leads(self, before_m: float, after_m: float) -> "FlyablePath":
        """The path with straight flight added before and after it, in its direction there. Its start stays at
        distance 0.
        """
        first, last = self._straight(0, -before_m), self._straight(-1, after_m)
        return FlyablePath(
            points_m=np.concatenate((first[0], self.points_m, last[0])),
            arc_m=np.concatenate((first[1], self.arc_m, last[1])),
            course_rad=np.concatenate((first[2], self.course_rad, last[2])),
            curvature_per_m=np.concatenate((first[3], self.curvature_per_m, last[3])),
        )

    def _straight(self, end: int, distance_m: float) -> tuple[Array, Array, Array, Array]:
        """Points of the straight extension at one end, in the order of flight; a distance of 0 gives none."""
        count = max(1, math.ceil(abs(distance_m) / _STEP_M))
        along = np.linspace(0.0, distance_m, count + 1)[1:]
        course = float(self.course_rad[end])
        points = self.points_m[end] + along[:, None] * np.array((math.cos(course), math.sin(course)))
        if distance_m < 0.0:
            points, along = points[::-1], along[::-1]
        return points, self.arc_m[end] + along, np.full(count, course), np.zeros(count)

    def at(self, arc_m: float) -> tuple[tuple[float, float], float, float]:
        """((north, east), course, curvature) at a distance."""
        north = float(np.interp(arc_m, self.arc_m, self.points_m[:, 0]))
        east = float(np.interp(arc_m, self.arc_m, self.points_m[:, 1]))
        course = float(np.interp(arc_m, self.arc_m, self.course_rad))
        return (north, east), course, float(np.interp(arc_m, self.arc_m, self.curvature_per_m))

    def nearest(self, north_m: float, east_m: float, *, from_arc_m: float, ahead_m: float) -> float:
        """Distance along the path of the point nearest to a place; the search begins 20 m before
        `from_arc_m`.
        """
        low = int(np.searchsorted(self.arc_m, from_arc_m - _BACK_M))
        low = min(low, len(self.arc_m) - 2)
        high = max(low + 2, int(np.searchsorted(self.arc_m, from_arc_m + ahead_m)))
        offset = self.points_m[low:high] - np.array((north_m, east_m))
        best = low + int(np.argmin((offset**2).sum(axis=1)))
        course = float(self.course_rad[best])
        on_m = (north_m - self.points_m[best, 0]) * math.cos(course) + (
            east_m - self.points_m[best, 1]
        ) * math.sin(course)
        return float(self.arc_m[best] + min(_STEP_M, max(-_STEP_M, on_m)))

    def waypoints(
        self, *, deviation_m: float, spacing_min_m: float, spacing_max_m: float
    ) -> list[tuple[float, float]]:
        """Points so close that straight legs stay within a deviation, as far as the least spacing allows."""
        bend = np.maximum(np.abs(self.curvature_per_m), 1e-9)
        chord = np.clip(np.sqrt(8.0 * deviation_m / bend), spacing_min_m, spacing_max_m)
        density = 1.0 / chord
        legs = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(self.arc_m))))
        count = max(1, math.ceil(float(legs[-1])))
        where = np.interp(np.linspace(0.0, float(legs[-1]), count + 1), legs, self.arc_m)
        return [self.at(float(s))[0] for s in where]


def flyable_path(curve: Curve, radius_m: float, ramp_m: float) -> FlyablePath:
    """The path of a curve; a polyline gets corners with the given radius (`check_turns` ensures that the legs
    are long enough).

    Args:
        ramp_m: distance over which a corner's curvature rises.
    """
    if isinstance(curve, Polyline):
        return _with_corners(curve, radius_m, ramp_m)
    table = ArcLengthTable.of(curve, _STEP_M)
    return FlyablePath(
        points_m=table.points_m,
        arc_m=table.arc_m,
        course_rad=table.course_rad,
        curvature_per_m=table.curvature_per_m,
    )


def _with_corners(polyline: Polyline, radius_m: float, ramp_m: float) -> FlyablePath:
    vertices = np.asarray(polyline.vertices_m)
    legs = np.diff(vertices, axis=0)
    courses = np.unwrap(np.arctan2(legs[:, 1], legs[:, 0]))
    points: list[Array] = []
    course: list[Array] = []
    bend: list[Array] = []
    start = vertices[0]

    def straight(stop: Array, along: float) -> None:
        length = float(np.hypot(*(stop - start)))
        count = max(2, math.ceil(length / _STEP_M))
        share = np.linspace(0.0, 1.0, count, endpoint=False)[:, None]
        points.append(start + share * (stop - start))
        course.append(np.full(count, along))
        bend.append(np.zeros(count))

    for k in range(1, len(vertices) - 1):
        turn = float(courses[k] - courses[k - 1])
        if abs(turn) < _STRAIGHT_RAD:
            continue
        side = math.copysign(1.0, turn)
        corner = Corner.of(abs(turn), radius_m, ramp_m)
        before = float(courses[k - 1])
        along = np.array((math.cos(before), math.sin(before)))
        across = side * np.array((-along[1], along[0]))
        entry = vertices[k] - corner.reach_m * along
        straight(entry, before)
        points.append(entry + corner.points_m[:-1, :1] * along + corner.points_m[:-1, 1:] * across)
        course.append(before + side * corner.course_rad[:-1])
        bend.append(side * corner.curvature_per_m[:-1])
        start = vertices[k] + corner.reach_m * np.array((math.cos(courses[k]), math.sin(courses[k])))
    straight(vertices[-1], float(courses[-1]))
    points.append(vertices[-1:])
    course.append(np.array([float(courses[-1])]))
    bend.append(np.zeros(1))
    whole = np.concatenate(points)
    arc = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(whole, axis=0).T))))
    kept = np.concatenate(([True], np.diff(arc) > 1e-6))
    return FlyablePath(
        points_m=whole[kept],
        arc_m=arc[kept],
        course_rad=np.concatenate(course)[kept],
        curvature_per_m=np.concatenate(bend)[kept],
    )
