"""Where the turn onto a leg can be over: the quickest way from one leg onto the next, in wind.

An aircraft that turns in `d` before a corner and flies a circle of radius R through the change of course
theta passes the new leg's line (unless d reaches R tan(theta / 2)) and is beside it by

    R (1 - cos theta) - d sin theta

when it flies the leg's course. It comes back by turning on through phi and back again by phi, where, in still
air, 2 R (1 - cos phi) is that distance, and is on the leg

    R sin theta - d cos theta + 2 R sin phi

behind the corner. That is the shortest path of bounded curvature (Dubins 1957) onto the line, and no control
law gets there sooner at that bank. In wind the circles are flown in the air, which drifts meanwhile: the same
with headings in place of courses, and a phi that brings the drifted end onto the line. Between the two turns
the bank has to be reversed: as much time at the heading between them.

With R = 64 m (25 m/s, 45 degrees) a right angle turned 50 m before is over 126 m behind the corner, a turn
through 150 degrees 201 m in still air, and up to 278 m in a wind of 6 m/s.
"""

import math
from typing import Final

Place = tuple[float, float]

_G_M_S2: Final = 9.80665
_BISECTIONS: Final = 50


def _wrap(angle_rad: float) -> float:
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


def course(start: Place, end: Place) -> float:
    """Course of a leg, rad."""
    return math.atan2(end[1] - start[1], end[0] - start[0])


def ground_speed(course_rad: float, airspeed_m_s: float, wind: Place) -> float:
    """Speed over ground along a course."""
    along = wind[0] * math.cos(course_rad) + wind[1] * math.sin(course_rad)
    across = wind[1] * math.cos(course_rad) - wind[0] * math.sin(course_rad)
    return along + math.sqrt(airspeed_m_s * airspeed_m_s - across * across)


def _heading(course_rad: float, airspeed_m_s: float, wind: Place) -> float:
    across = wind[1] * math.cos(course_rad) - wind[0] * math.sin(course_rad)
    return course_rad - math.asin(across / airspeed_m_s)


def turn_over_m(
    before: Place,
    corner: Place,
    after: Place,
    *,
    turn_in_m: float,
    airspeed_m_s: float,
    bank_rad: float,
    reversal_s: float,
    wind: Place,
) -> float:
    """Distance behind the corner at which the quickest turn onto the leg `corner`..`after` is over.

    Args:
        before: start of the leg to the corner; places are metres north and east.
        turn_in_m: distance before the corner at which the turn begins.
        airspeed_m_s: true airspeed; the wind is slower.
        bank_rad: of both turns.
        reversal_s: time in which the bank is reversed between them.
        wind: velocity of the air, north and east, m/s.
    """
    course_in, course_out = course(before, corner), course(corner, after)
    side = math.copysign(1.0, _wrap(course_out - course_in))
    heading_in = _heading(course_in, airspeed_m_s, wind)
    heading_out = _heading(course_out, airspeed_m_s, wind)
    rate = _G_M_S2 * math.tan(bank_rad) / airspeed_m_s
    radius = side * airspeed_m_s / rate
    change = (side * (heading_out - heading_in)) % (2.0 * math.pi)

    def end(phi: float, straight_s: float) -> tuple[float, float]:
        """Along the leg, and how far the line is still away, where the turn through `change` and phi ends."""
        between = heading_in + side * (change + phi)
        north = radius * (2.0 * math.sin(between) - math.sin(heading_in) - math.sin(heading_out))
        east = -radius * (2.0 * math.cos(between) - math.cos(heading_in) - math.cos(heading_out))
        time_s = (change + 2.0 * phi) / rate + straight_s
        north += airspeed_m_s * straight_s * math.cos(between) + wind[0] * time_s
        east += airspeed_m_s * straight_s * math.sin(between) + wind[1] * time_s
        north -= turn_in_m * math.cos(course_in)
        east -= turn_in_m * math.sin(course_in)
        along = north * math.cos(course_out) + east * math.sin(course_out)
        across = east * math.cos(course_out) - north * math.sin(course_out)
        return along, -side * across

    along, away = end(0.0, 0.0)
    if away <= 0.0:  # the corner is cut: there is nothing to come back from
        return along
    low, high = 0.0, 0.5 * math.pi
    along, away = end(high, reversal_s)
    if away > 0.0:  # straight to the line for a while between the turns
        closing_m_s = away - end(high, reversal_s + 1.0)[1]
        return end(high, reversal_s + away / closing_m_s)[0]
    for _ in range(_BISECTIONS):
        phi = 0.5 * (low + high)
        along, away = end(phi, reversal_s)
        low, high = (phi, high) if away > 0.0 else (low, phi)
    return along
