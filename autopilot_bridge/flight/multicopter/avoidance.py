"""Stop before obstacles: PX4's collision prevention, ArduPilot's AC_Avoid for pilots and streamed velocities.

A commanded horizontal velocity is limited so that the vehicle can stop before the margin. A velocity away
from an obstacle is not limited. PX4 slows down the whole velocity; ArduPilot keeps the component along the
obstacle (slide).
"""

import math
from typing import Final

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.obstacles import SECTOR_RAD, SECTORS

_LEAST_M_S: Final = 1e-3
_SLIDES: Final = 2  # iterations over all sectors: two walls make a corner


def _stopping(ctx: FlightContext) -> tuple[float, float]:
    """(deceleration, delay) of a stop: the jerk limit adds twice the duration of its ramp (as in PX4)."""
    p, limits = ctx.multicopter.avoidance, ctx.multicopter
    deceleration = min(p.deceleration_m_s2, limits.acceleration_m_s2)
    return deceleration, p.delay_s + 2.0 * deceleration / limits.jerk_m_s3


def limited_velocity(
    ctx: FlightContext, north_m_s: float, east_m_s: float, heading_rad: float
) -> tuple[float, float]:
    """A horizontal velocity, NED, limited by the obstacles."""
    p, obstacles = ctx.multicopter.avoidance, ctx.surroundings.obstacles
    speed = math.hypot(north_m_s, east_m_s)
    if speed < _LEAST_M_S:
        return north_m_s, east_m_s
    timeout_us = round(p.timeout_s * 1e6)
    if p.slide:
        return _slid(ctx, north_m_s, east_m_s, heading_rad, timeout_us)
    direction = math.atan2(east_m_s, north_m_s) - heading_rad
    if not (p.go_without_data or obstacles.known(direction, ctx.time_us, timeout_us=timeout_us)):
        return 0.0, 0.0
    deceleration, delay = _stopping(ctx)
    limit = obstacles.speed_limit(
        direction,
        ctx.time_us,
        margin_m=p.margin_m,
        acceleration_m_s2=deceleration,
        delay_s=delay,
        guard_rad=p.guard_rad,
        timeout_us=timeout_us,
    )
    scale = min(1.0, limit / speed)
    return scale * north_m_s, scale * east_m_s


def _slid(
    ctx: FlightContext, north: float, east: float, heading_rad: float, timeout_us: int
) -> tuple[float, float]:
    """The velocity without the components towards obstacles that are too fast for the distance."""
    p, obstacles = ctx.multicopter.avoidance, ctx.surroundings.obstacles
    if obstacles.newest_us < 0 or ctx.time_us - obstacles.newest_us > timeout_us:
        return north, east
    b, t = _stopping(ctx)
    for _ in range(_SLIDES):
        for sector in range(SECTORS):
            measured_us, distance_m = int(obstacles.measured_us[sector]), float(obstacles.distances_m[sector])
            if measured_us < 0 or ctx.time_us - measured_us > timeout_us or not math.isfinite(distance_m):
                continue
            angle = heading_rad + sector * SECTOR_RAD
            c, s = math.cos(angle), math.sin(angle)
            towards = c * north + s * east
            room = max(0.0, distance_m - p.margin_m)
            allowed = b * (math.sqrt(t * t + 2.0 * room / b) - t)
            if towards > allowed:
                north -= (towards - allowed) * c
                east -= (towards - allowed) * s
    return north, east
