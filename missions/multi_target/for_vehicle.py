"""What suits a vehicle in a search, where options were not specified, and what it can't fly."""

import math
from typing import Final

from missions.errors import PlanError
from missions.multi_target.options import MultiTargetOptions
from missions.search.checks import check_steps
from missions.vehicle.limits import FixedWingLimits, Limits

_WINGS_ALTITUDE_M: Final = 60.0
_TURNS: Final = 2.5  # step of an aircraft, in turn radii


def for_vehicle(options: MultiTargetOptions, limits: Limits) -> MultiTargetOptions:
    """The same options; those that were not specified get values that suit the vehicle."""
    if not isinstance(limits, FixedWingLimits):
        step_m = options.step_length_m
        return options.unless_none(step_m=step_m, speed_m_s=4.0, acceptance_m=min(2.0, 0.4 * step_m))
    speed_m_s = limits.airspeed_trim_m_s if options.speed_m_s is None else options.speed_m_s
    step_m = options.step_m or _TURNS * limits.turn_radius_m(speed_m_s)
    own = options.unless_none(
        step_m=step_m, speed_m_s=speed_m_s, acceptance_m=0.4 * step_m, turn_limit_rad=0.5 * math.pi
    )
    return own.unless_chosen(altitude_m=_WINGS_ALTITUDE_M)


def check_vehicle(options: MultiTargetOptions, limits: Limits) -> None:
    """Refuse what one vehicle of the team can't fly.

    Args:
        options: options adapted to the vehicle.
        limits: limits of the vehicle.

    Raises:
        PlanError: names the option to change.
    """
    step_m, _ = check_steps(options, limits)
    if step_m >= min(options.area.height_m, options.area.width_m):
        raise PlanError(
            f"`step_m` {step_m:.0f} m leaves the searched area of {options.area.height_m:g} m by "
            f"{options.area.width_m:g} m; ask for a larger `area_m`, or a smaller `step_m`"
        )
