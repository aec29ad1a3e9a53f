"""How fast waypoints may be passed: corner speeds and a look-ahead over the coming legs."""

import math
from collections.abc import Sequence
from typing import Final

from autopilot_bridge.flight.parameters import FlightParameters
from autopilot_bridge.flight.trajectory import braking_speed

Point = tuple[float, float, float]

_STRAIGHT_RAD: Final = 1e-3
_REVERSAL_RAD: Final = math.radians(150.0)
_ROUNDING: Final = 0.6  # of the acceptance radius may be used up by rounding a corner


def turn_angle(before: Point, corner: Point, after: Point) -> float:
    """Horizontal change of course at a corner, 0 (straight on) to pi; 0 beside a vertical leg."""
    n1, e1 = corner[0] - before[0], corner[1] - before[1]
    n2, e2 = after[0] - corner[0], after[1] - corner[1]
    if math.hypot(n1, e1) < 0.1 or math.hypot(n2, e2) < 0.1:
        return 0.0
    return abs(math.atan2(n1 * e2 - e1 * n2, n1 * n2 + e1 * e2))


def corner_speed(angle_rad: float, tangent_m: float, acceleration_m_s2: float) -> float:
    """Speed on the arc that touches both legs `tangent_m` before and after the corner.

    The arc's radius is tangent / tan(angle / 2), its centripetal acceleration the given one.
    """
    if angle_rad < _STRAIGHT_RAD:
        return math.inf
    if angle_rad > _REVERSAL_RAD:
        return 0.0
    return math.sqrt(acceleration_m_s2 * tangent_m / math.tan(0.5 * angle_rad))


def easing_speed(angle_rad: float, distance_m: float, jerk_m_s3: float) -> float:
    """Speed at which a turn built up and taken back within twice `distance_m` is a full one.

    The lateral acceleration is a triangle of slope jerk over the time 2 distance / v, so the course changes
    by jerk distance^2 / v^3.
    """
    if angle_rad < _STRAIGHT_RAD:
        return math.inf
    return (jerk_m_s3 * distance_m * distance_m / angle_rad) ** (1.0 / 3.0)


def turn_in_distance(angle_rad: float, speed_m_s: float, acceleration_m_s2: float, jerk_m_s3: float) -> float:
    """Distance before the corner at which a turn at `speed_m_s` begins, its build-up included."""
    if angle_rad < _STRAIGHT_RAD:
        return 0.0
    arc = speed_m_s * speed_m_s / acceleration_m_s2 * math.tan(0.5 * min(angle_rad, _REVERSAL_RAD))
    return arc + 0.5 * speed_m_s * min(1.0, acceleration_m_s2 / jerk_m_s3)


def passing_speed(path: Sequence[Point], radii_m: Sequence[float], parameters: FlightParameters) -> float:
    """Speed at which the first corner may be passed, so that every later one can be met in time.

    Args:
        path: start of the leg, the corner, and the points after it; the last one is a stop.
        radii_m: acceptance radius of each point of `path`.
        parameters: cornering acceleration, braking limits.
    """
    if len(path) < 3:
        return 0.0
    speed = 0.0
    for i in range(len(path) - 2, 0, -1):
        ahead = math.dist(path[i][0:2], path[i + 1][0:2])
        behind = math.dist(path[i - 1][0:2], path[i][0:2])
        if ahead < 0.1:
            speed = 0.0  # a climb on the spot
            continue
        reach = braking_speed(
            ahead, speed, parameters.acceleration_m_s2, parameters.jerk_m_s3, parameters.trajectory_p_1_s
        )
        half_leg = min(0.5 * ahead, 0.5 * behind if behind > 0.1 else math.inf)
        tangent = min(radii_m[i], half_leg)
        angle = turn_angle(path[i - 1], path[i], path[i + 1])
        # a rounded corner stays this close to the waypoint when the turn is eased in from here
        easing = min(half_leg, _ROUNDING * radii_m[i] / math.tan(0.25 * max(angle, _STRAIGHT_RAD)))
        speed = min(
            reach,
            corner_speed(angle, tangent, parameters.corner_acceleration_m_s2),
            easing_speed(angle, easing, parameters.jerk_m_s3),
        )
    return speed
