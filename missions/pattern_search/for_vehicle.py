"""What suits a vehicle, where a pattern's options were not specified."""

from dataclasses import replace
from typing import Final

from missions.base.options import FlightOptions, Via
from missions.planning.sizing import WINGS_SIDE_M, spacing_for_turns_m
from missions.vehicle.limits import Limits, MulticopterLimits

SEARCH_LIMIT_S: Final = 1800.0
"""Time after which a search is given up."""
_SEPARATION_M: Final = 20.0  # of fixed wings
_LOWEST_LAYER_M: Final = 40.0


def flight_for_vehicle(options: FlightOptions, limits: Limits) -> FlightOptions:
    """Options of a pattern as one vehicle flies it: those that were not specified get larger, higher and
    faster values for a fixed wing than for a multicopter, and a search gets its limit.
    """
    if options.search and options.search_time_s is None:
        options = replace(options, search_time_s=SEARCH_LIMIT_S)
    if isinstance(limits, MulticopterLimits):
        return options
    speed_m_s = options.speed_m_s if options.chosen("speed_m_s") else limits.airspeed_trim_m_s
    gaps = options.vehicles - 1
    room_m = limits.altitude_max_m - _LOWEST_LAYER_M
    separation_m = options.separation_m
    if not options.chosen("separation_m"):
        separation_m = min(_SEPARATION_M, room_m / max(1, gaps))
    return options.unless_chosen(
        pattern="L2" if options.ratio is None else options.pattern,
        via=Via.SETPOINTS,
        width_m=WINGS_SIDE_M,
        height_m=WINGS_SIDE_M,
        speed_m_s=speed_m_s,
        altitude_m=max(_LOWEST_LAYER_M, min(100.0, limits.altitude_max_m - gaps * separation_m)),
        spacing_m=spacing_for_turns_m(speed_m_s, limits),
        acceptance_m=min(30.0, max(10.0, speed_m_s)),
        separation_m=separation_m,
    )
