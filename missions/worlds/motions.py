"""How ground targets of embedded worlds move."""

import math
from typing import Final

from flightsim.payload import Circle, ConstantVelocity, RandomWalk, Static, TargetMotion
from missions.errors import PlanError
from missions.worlds.motion_kind import MotionKind

_MAX_DISTANCE_M: Final = 50_000.0
_MAX_SPEED_M_S: Final = 60.0


def motion_of(
    kind: MotionKind,
    *,
    place_ne_m: tuple[float, float],
    speed_m_s: float = 0.0,
    course_rad: float = 0.0,
    range_m: float = 0.0,
) -> TargetMotion:
    """Motion of a ground target that begins at a place.

    Args:
        kind: kind of motion.
        place_ne_m: place at boot, from home; for a circle, which begins in the north, its northernmost point.
        speed_m_s: ground speed; 0 for a static target.
        course_rad: course of a straight motion, and initial course of a random walk.
        range_m: radius of a circle; for a random walk, half the side of the square that it stays in; 0 where
            the kind needs none.

    Raises:
        PlanError: a place or speed is impossible.
    """
    north_m, east_m = place_ne_m
    if not math.hypot(north_m, east_m) <= _MAX_DISTANCE_M:
        raise PlanError(f"`target_ne_m` {north_m:g},{east_m:g} m is not within {_MAX_DISTANCE_M:g} m of home")
    moving = kind is not MotionKind.STATIC
    if not (0.0 < speed_m_s <= _MAX_SPEED_M_S if moving else speed_m_s == 0.0):
        accepted = f"more than 0 and up to {_MAX_SPEED_M_S:g} m/s" if moving else "0 m/s"
        raise PlanError(f"target speed {speed_m_s:g} m/s; a {kind} target goes {accepted}")
    if not math.isfinite(course_rad):
        raise PlanError(f"target course {course_rad:g} rad is no direction")
    match kind:
        case MotionKind.STATIC:
            return Static(north_m=north_m, east_m=east_m)
        case MotionKind.STRAIGHT:
            return ConstantVelocity(
                north_m=north_m, east_m=east_m, speed_m_s=speed_m_s, course_rad=course_rad
            )
        case MotionKind.CIRCLE:
            return Circle(north_m=north_m - range_m, east_m=east_m, radius_m=range_m, speed_m_s=speed_m_s)
        case MotionKind.RANDOM_WALK:
            return RandomWalk(
                south_m=north_m - range_m,
                west_m=east_m - range_m,
                north_m=north_m + range_m,
                east_m=east_m + range_m,
                speed_m_s=speed_m_s,
                start_m=(north_m, east_m),
                course_rad=course_rad,
            )
