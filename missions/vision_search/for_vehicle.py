"""What suits a vehicle in a search, where options were not specified, and what it can't fly."""

import math
from typing import Final

from missions.errors import PlanError
from missions.patterns.lissajous import NAMED_PATTERNS
from missions.search.checks import check_steps
from missions.vehicle.limits import FixedWingLimits, Limits
from missions.vision_search.options import LocalizeKind, VisionSearchOptions

_WINGS_ALTITUDE_M: Final = 90.0
_WINGS_SEPARATION_M: Final = 10.0
_TURNS: Final = 2.5  # step of an aircraft, in turn radii


def for_vehicle(options: VisionSearchOptions, limits: Limits) -> VisionSearchOptions:
    """The same options; those that were not specified get values that suit the vehicle."""
    if not isinstance(limits, FixedWingLimits):
        return options.unless_none(
            step_m=options.step_length_m,
            speed_m_s=8.0,
            acceptance_m=0.4 * options.step_length_m,
            turn_limit_rad=math.pi,
        )
    speed_m_s = limits.airspeed_trim_m_s if options.speed_m_s is None else options.speed_m_s
    step_m = options.step_m or _TURNS * limits.turn_radius_m(speed_m_s)
    own = options.unless_none(
        step_m=step_m, speed_m_s=speed_m_s, acceptance_m=0.4 * step_m, turn_limit_rad=0.5 * math.pi
    )
    return own.unless_chosen(altitude_m=_WINGS_ALTITUDE_M, separation_m=_WINGS_SEPARATION_M)


def check_vehicle(options: VisionSearchOptions, limits: Limits) -> None:
    """Refuse what one vehicle of the team can't fly.

    Args:
        options: options adapted to the vehicle.
        limits: limits of the vehicle.

    Raises:
        PlanError: names the option to change.
    """
    if options.curve.upper() not in NAMED_PATTERNS:
        raise PlanError(f"`curve` {options.curve!r} is not known; there are {', '.join(NAMED_PATTERNS)}")
    check_steps(options, limits)
    if isinstance(limits, FixedWingLimits) and options.localize is LocalizeKind.ORBIT:
        raise PlanError(
            "an aircraft with a fixed camera does not see the middle of its turn; ask for `localize` passes"
        )
