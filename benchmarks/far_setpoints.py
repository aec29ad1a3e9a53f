"""A place 5 km from home by streamed setpoints: how far from it the autopilot says that it is.

    flightstack fly benchmarks/far_setpoints.py --firmware px4 [--arg north_m=3500] [--arg east_m=3500]

A mission for a multicopter. Local setpoints are in metres of the autopilot (docs/firmware/real.md): one in
metres of WGS84 would lead 10 m beside the place. The result is the mean of GLOBAL_POSITION_INT in hover,
which has the error of the autopilot's control and not that of its GPS.
"""

import math
import sys

from flightsim.foundation.geodesy import LocalFrame
from flightstack import FlightOptions, MissionError, PlanError, Position, Setpoint, Vehicle
from missions.vehicle.limits import MulticopterLimits

_ACCELERATION_M_S2 = 1.5
_SETTLING_S = 8.0
_HOVER_S = 20.0
_BOUND_M = 0.5


async def fly(vehicle: Vehicle, options: FlightOptions) -> None:
    """Fly there, hover, land there."""
    north_m, east_m = (float(options.arguments.get(name, "3500")) for name in ("north_m", "east_m"))
    height_m = options.altitude_m
    await vehicle.arm()
    await vehicle.takeoff(height_m)
    frame = LocalFrame(vehicle.home)
    meant = frame.geodetic_from_ned(north_m, east_m, -height_m)
    away_m = math.hypot(north_m, east_m)
    limits = await vehicle.limits()
    if not isinstance(limits, MulticopterLimits):
        raise PlanError("an aircraft with wings can't hover: give a multicopter")
    speed_m_s = 0.9 * limits.speed_m_s
    ramp_s = speed_m_s / _ACCELERATION_M_S2
    cruise_s = away_m / speed_m_s - ramp_s
    places: list[tuple[float, float, float]] = []

    def progress(time_s: float) -> tuple[float, float]:
        """Way and speed of a start, a cruise and a stop."""
        if time_s < ramp_s:
            return 0.5 * _ACCELERATION_M_S2 * time_s**2, _ACCELERATION_M_S2 * time_s
        if time_s < ramp_s + cruise_s:
            return speed_m_s * (time_s - 0.5 * ramp_s), speed_m_s
        left_s = max(0.0, 2.0 * ramp_s + cruise_s - time_s)
        return away_m - 0.5 * _ACCELERATION_M_S2 * left_s**2, _ACCELERATION_M_S2 * left_s

    def setpoint(time_s: float) -> Setpoint | None:
        hover_s = time_s - (2.0 * ramp_s + cruise_s) - _SETTLING_S
        position = vehicle.latest(Position)
        if hover_s > 0.0 and position is not None:
            places.append((position.lat_deg, position.lon_deg, position.alt_m))
        if hover_s > _HOVER_S:
            return None
        way_m, way_m_s = progress(time_s)
        share, rate = way_m / away_m, way_m_s / away_m
        return Setpoint(
            position_ned_m=(share * north_m, share * east_m, -height_m),
            velocity_ned_m_s=(rate * north_m, rate * east_m, 0.0),
        )

    await vehicle.follow(setpoint, rate_hz=options.rate_hz)
    mean = [sum(values) / len(places) for values in zip(*places, strict=True)]
    off = [a - b for a, b in zip(frame.ned_from_geodetic(*mean), (north_m, east_m, -height_m), strict=True)]
    sys.stdout.write(
        f"meant {meant[0]:.7f}, {meant[1]:.7f}: {math.hypot(*off[:2]):.2f} m beside it, "
        f"{off[2]:+.2f} m down\n"
    )
    await vehicle.land()
    if math.hypot(*off) > _BOUND_M:
        raise MissionError(f"the hover is {math.hypot(*off):.2f} m from the place that was meant")
