"""Default sizes of patterns that suit an aircraft's turns, used when none are specified."""

import math
from typing import Final

from missions.patterns.curve import Curve
from missions.patterns.polyline import Polyline
from missions.planning.turns import leg_needed_m, smallest_radius_m
from missions.vehicle.limits import FixedWingLimits

WINGS_SIDE_M: Final = 1000.0  # of a fixed wing's pattern, unless its turns need more
_ROOM: Final = 1.05
_SQUARE_RAD: Final = 0.5 * math.pi
_SECTOR_RAD: Final = 2.0 * math.pi / 3.0
_LEGS_MIN: Final = 3


def spacing_for_turns_m(airspeed_m_s: float, limits: FixedWingLimits) -> float:
    """Track spacing of sweeps and squares: each leg has room for a right-angle turn at both ends."""
    return _tens(_ROOM * leg_needed_m(_SQUARE_RAD, airspeed_m_s, limits))


def curve_side_m(curve: Curve, side_m: float, airspeed_m_s: float, limits: FixedWingLimits) -> float:
    """Side of a curved pattern, from one with any side: the default, or as large as its bends need."""
    if isinstance(curve, Polyline):
        return WINGS_SIDE_M
    needed_m = side_m * limits.path_radius_m(airspeed_m_s) / smallest_radius_m(curve)
    return _hundreds(max(WINGS_SIDE_M, _ROOM * needed_m))


def sector_side_m(airspeed_m_s: float, limits: FixedWingLimits) -> float:
    """Side of a sector search, whose legs turn by 120 degrees at both ends."""
    return _hundreds(max(WINGS_SIDE_M, 2.0 * _ROOM * leg_needed_m(_SECTOR_RAD, airspeed_m_s, limits)))


def legs_side_m(spacing_m: float) -> float:
    """Side of a sweep or a square with a whole number of track spacings."""
    return spacing_m * max(_LEGS_MIN, math.ceil(WINGS_SIDE_M / spacing_m - 1e-9))


def spacing_within_m(side_m: float, airspeed_m_s: float, limits: FixedWingLimits) -> float:
    """Track spacing that divides a side evenly with room for turns; if the side is too short, the default."""
    legs = math.floor(side_m / (_ROOM * leg_needed_m(_SQUARE_RAD, airspeed_m_s, limits)))
    return side_m / legs if legs >= 1 else spacing_for_turns_m(airspeed_m_s, limits)


def _tens(value_m: float) -> float:
    return 10.0 * math.ceil(0.1 * value_m)


def _hundreds(value_m: float) -> float:
    return 100.0 * math.ceil(0.01 * value_m)
