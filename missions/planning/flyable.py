"""A pattern as an aircraft can follow it: corners as arcs, sampled finely, with course and curvature."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from missions.patterns.curve import ArcLengthTable, Array, Curve
from missions.patterns.polyline import Polyline

_STEP_M: Final = 2.0
_STRAIGHT_RAD: Final = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class FlyablePath:
    """Points along a path.

    Attributes:
        points_m: (n, 2) north, east.
        arc_m: (n,) distance flown, increasing.
        course_rad: (n,) direction, unwrapped.
        curvature_per_m: (n,) positive turning right.
    """

    points_m: Array
    arc_m: Array
    course_rad: Array
    curvature_per_m: Array

    @property
    def length_m(self) -> float:
        """Of the whole path."""
        return float(self.arc_m[-1])

    def until(self, length_m: float) -> "FlyablePath":
        """The first part of it."""
        count = max(2, int(np.searchsorted(self.arc_m, length_m)) + 1)
        return FlyablePath(
            points_m=self.points_m[:count],
            arc_m=self.arc_m[:count],
            course_rad=self.course_rad[:count],
            curvature_per_m=self.curvature_per_m[:count],
        )

    def at(self, arc_m: float) -> tuple[tuple[float, float], float, float]:
        """((north, east), course, curvature) at a distance."""
        north = float(np.interp(arc_m, self.arc_m, self.points_m[:, 0]))
        east = float(np.interp(arc_m, self.arc_m, self.points_m[:, 1]))
        course = float(np.interp(arc_m, self.arc_m, self.course_rad))
        return (north, east), course, float(np.interp(arc_m, self.arc_m, self.curvature_per_m))

    def nearest(self, north_m: float, east_m: float, *, from_arc_m: float, ahead_m: float) -> float:
        """Distance along the path of its point nearest to a place, looked for from a bit before one place on."""
        low = int(np.searchsorted(self.arc_m, from_arc_m - 20.0))
        high = max(low + 2, int(np.searchsorted(self.arc_m, from_arc_m + ahead_m)))
        offset = self.points_m[low:high] - np.array((north_m, east_m))
        return float(self.arc_m[low + int(np.argmin((offset**2).sum(axis=1)))])

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


def flyable_path(curve: Curve, radius_m: float) -> FlyablePath:
    """The path of a curve; a polyline gets arcs of a radius at its corners (the legs are long enough)."""
    if isinstance(curve, Polyline):
        return _with_arcs(curve, radius_m)
    table = ArcLengthTable.of(curve, _STEP_M)
    return FlyablePath(
        points_m=table.points_m,
        arc_m=table.arc_m,
        course_rad=table.course_rad,
        curvature_per_m=table.curvature_per_m,
    )


def _with_arcs(polyline: Polyline, radius_m: float) -> FlyablePath:
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
        turn = courses[k] - courses[k - 1]
        if abs(turn) < _STRAIGHT_RAD:
            continue
        cut = radius_m * math.tan(0.5 * abs(turn))
        along = np.array((math.cos(courses[k - 1]), math.sin(courses[k - 1])))
        entry = vertices[k] - cut * along
        straight(entry, float(courses[k - 1]))
        side = math.copysign(1.0, turn)
        centre = entry + side * radius_m * np.array((-along[1], along[0]))
        count = max(4, math.ceil(radius_m * abs(turn) / _STEP_M))
        angle = courses[k - 1] + turn * np.linspace(0.0, 1.0, count, endpoint=False)
        points.append(centre + side * radius_m * np.column_stack((np.sin(angle), -np.cos(angle))))
        course.append(angle)
        bend.append(np.full(count, side / radius_m))
        start = vertices[k] + cut * np.array((math.cos(courses[k]), math.sin(courses[k])))
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
