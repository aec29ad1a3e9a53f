"""A curve as waypoints: close together in bends, far apart on straight parts."""

import itertools
import math

import numpy as np

from missions.errors import PlanError
from missions.patterns.curve import ArcLengthTable, Curve
from missions.patterns.polyline import Polyline
from missions.planning.trajectory import Trajectory


def waypoints_along(
    curve: Curve,
    *,
    deviation_m: float = 0.3,
    spacing_min_m: float = 3.0,
    spacing_max_m: float = 25.0,
    length_m: float | None = None,
) -> list[tuple[float, float]]:
    """Waypoints (north, east), m, the first and the last point of the curve included.

    For a polyline these are its corners. For other curves the sagitta of the legs, c^2 kappa / 8 for a chord
    c, stays below `deviation_m` as far as `spacing_min_m` allows.

    Args:
        curve: the pattern.
        deviation_m: largest distance from the straight legs to the curve.
        spacing_min_m, spacing_max_m: limits of the leg lengths.
        length_m: length of the curve after which to end.
    """
    if not (deviation_m > 0.0 and 0.0 < spacing_min_m <= spacing_max_m):
        raise PlanError(
            f"waypoint deviation {deviation_m:g} m, spacing {spacing_min_m:g}..{spacing_max_m:g} m: "
            "all must be more than 0, and in order"
        )
    if isinstance(curve, Polyline):
        return _cut_polyline(curve, length_m)
    table = ArcLengthTable.of(curve)
    chord = np.sqrt(8.0 * deviation_m / np.maximum(np.abs(table.curvature_per_m), 1e-9))
    density = 1.0 / np.clip(chord, spacing_min_m, spacing_max_m)
    arc = table.arc_m
    # legs flown so far, as a function of distance: equal steps of it make the waypoints
    legs = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(arc))))
    total = float(legs[-1] if length_m is None else np.interp(min(length_m, table.length_m), arc, legs))
    count = max(2, math.ceil(total))
    where = np.interp(np.linspace(0.0, total, count + 1), legs, arc)
    points = curve.points(table.parameter_at(where))
    return [(float(n), float(e)) for n, e in points]


def _cut_polyline(curve: Polyline, length_m: float | None) -> list[tuple[float, float]]:
    vertices = list(curve.vertices_m)
    if length_m is None or length_m >= curve.length_m:
        return vertices
    kept = [vertices[0]]
    left = length_m
    for (n0, e0), (n1, e1) in itertools.pairwise(vertices):
        leg = math.dist((n0, e0), (n1, e1))
        if leg >= left:
            f = max(left, 1e-3) / leg
            kept.append((n0 + f * (n1 - n0), e0 + f * (e1 - e0)))
            break
        kept.append((n1, e1))
        left -= leg
    return kept


def leg_speeds(points: list[tuple[float, float]], trajectory: Trajectory) -> list[float]:
    """Speed (m/s) for the leg to each waypoint: the lowest speed of the planned trajectory on that leg.

    Waypoint missions have no acceleration limits; with the speeds of the plan a vehicle flies bends as
    planned. The smooth start and stop of the trajectory are ignored. The first waypoint gets the speed of the
    leg after it.

    Args:
        points: waypoints (north, east) on the trajectory's path, in order.
        trajectory: the plan.
    """
    position = trajectory.position_ned_m[:, :2]
    speed = np.hypot(trajectory.velocity_ned_m_s[:, 0], trajectory.velocity_ned_m_s[:, 1])
    flown_m = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(position, axis=0).T))))
    where = [0]
    for point in points[1:]:
        start = where[-1]
        leg_m = math.dist(point, position[start])
        reach_m = flown_m[start] + 1.5 * leg_m + 2.0
        end = int(np.searchsorted(flown_m, reach_m, side="right"))
        distance = np.hypot(*(position[start:end] - point).T)
        where.append(start + int(distance.argmin()))
    speeds = []
    last = len(where) - 1
    for k in range(1, len(where)):
        flown = speed[where[k - 1] : where[k] + 1]
        if k == 1:
            flown = flown[-1:]
        elif k == last:
            flown = flown[:1]
        speeds.append(float(flown.min()) if len(flown) else float(speed.max()))
    return [speeds[0], *speeds] if speeds else [float(speed.max())] * len(points)
