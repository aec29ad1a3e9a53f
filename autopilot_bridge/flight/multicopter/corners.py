"""Speeds at waypoints: corner speeds and a look-ahead over the next legs."""

import math
from collections.abc import Sequence
from typing import Final

from autopilot_bridge.flight.heading import SAME_PLACE_M, turn_angle
from autopilot_bridge.flight.multicopter.trajectory import braking_speed
from autopilot_bridge.flight.parameters import FlightParameters
from flightsim.foundation.vectors import Vector

_STRAIGHT_RAD: Final = 1e-3
_REVERSAL_RAD: Final = math.radians(150.0)
_TURN_SHARE: Final = 0.85  # of the acceptance radius: a turn begins inside it
_SWING_OUT: Final = 0.2  # of the acceptance radius


def turn_distance(angle_rad: float, speed_m_s: float, acceleration_m_s2: float, jerk_m_s3: float) -> float:
    """Distance before a corner at which a turn must begin to end on the next leg.

    The velocity changes along a straight line from that of one leg to that of the other. Its change 2 v
    sin(angle / 2) is built up and removed at limited jerk within a time T; this is symmetric about the corner
    and begins v T / 2 before it.
    """
    change = 2.0 * speed_m_s * math.sin(0.5 * angle_rad)
    build_up = acceleration_m_s2 / jerk_m_s3
    if change > acceleration_m_s2 * build_up:
        time_s = change / acceleration_m_s2 + build_up
    else:  # the full acceleration is not needed
        time_s = 2.0 * math.sqrt(change / jerk_m_s3)
    return 0.5 * speed_m_s * time_s


def turn_speed(angle_rad: float, distance_m: float, acceleration_m_s2: float, jerk_m_s3: float) -> float:
    """Speed of the turn that begins `distance_m` before a corner: the inverse of `turn_distance`.

    An almost straight turn has no speed limit; a reversal has speed 0.
    """
    if angle_rad < _STRAIGHT_RAD:
        return math.inf
    if angle_rad > _REVERSAL_RAD:
        return 0.0
    share = 2.0 * math.sin(0.5 * angle_rad)
    build_up = acceleration_m_s2 / jerk_m_s3
    speed = (jerk_m_s3 * distance_m * distance_m / share) ** (1.0 / 3.0)
    if share * speed <= acceleration_m_s2 * build_up:
        return speed
    half = 0.5 * build_up
    return (
        acceleration_m_s2
        / share
        * (math.sqrt(half * half + 2.0 * share * distance_m / acceleration_m_s2) - half)
    )


def turn_room(path: Sequence[Vector], radii_m: Sequence[float], index: int) -> float:
    """How far before corner `index` of a path its turn may begin: inside the acceptance radius, and at most
    half of either leg.
    """
    behind, ahead = (
        math.dist(path[index - 1][0:2], path[index][0:2]),
        math.dist(path[index][0:2], path[index + 1][0:2]),
    )
    half_leg = 0.5 * min(ahead, behind if behind > SAME_PLACE_M else math.inf)
    return min(_TURN_SHARE * radii_m[index], half_leg)


def turn_in_distance(
    path: Sequence[Vector], radii_m: Sequence[float], speed_m_s: float, parameters: FlightParameters
) -> float:
    """Distance before the first corner of a path at which its turn begins, at the speed `speed_m_s`."""
    p = parameters
    wanted = turn_distance(
        turn_angle(path[0], path[1], path[2]), speed_m_s, p.corner_acceleration_m_s2, p.jerk_m_s3
    )
    return min(wanted, turn_room(path, radii_m, 1))


def passing_speed(path: Sequence[Vector], radii_m: Sequence[float], parameters: FlightParameters) -> float:
    """Speed at which the first corner may be passed so that every later corner can be met too.

    Args:
        path: start of the leg, the corner, and the points after it; the vehicle stops at the last one.
        radii_m: acceptance radius of each point of `path`.
        parameters: cornering acceleration, braking limits.
    """
    if len(path) < 3:
        return 0.0
    p = parameters
    speed = turn_in = 0.0
    for i in range(len(path) - 2, 0, -1):
        ahead = math.dist(path[i][0:2], path[i + 1][0:2])
        if ahead < SAME_PLACE_M:
            speed = turn_in = 0.0  # a vertical climb
            continue
        reach = braking_speed(
            max(0.0, ahead - turn_in), speed, p.acceleration_m_s2, p.jerk_m_s3, p.trajectory_p_1_s
        )
        angle = turn_angle(path[i - 1], path[i], path[i + 1])
        room = turn_room(path, radii_m, i)
        # a slight turn may begin late: it overshoots by at most a fraction of the radius
        late = _SWING_OUT * radii_m[i] * max(0.0, math.cos(angle)) / math.sin(max(angle, _STRAIGHT_RAD))
        turn = turn_speed(angle, min(room + late, 0.5 * ahead), p.corner_acceleration_m_s2, p.jerk_m_s3)
        speed = min(reach, turn)
        turn_in = min(room, turn_distance(angle, speed, p.corner_acceleration_m_s2, p.jerk_m_s3))
    return speed
