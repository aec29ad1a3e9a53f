"""Flight along commanded headings: an aircraft by its heading flight, a multicopter along a moving point."""

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final, Protocol

from flightsim.foundation.geodesy import LocalFrame
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.vehicle.limits import MulticopterLimits
from missions.vehicle.setpoint import Setpoint
from missions.vehicle.telemetry import Attitude
from missions.vehicle.vehicle import Vehicle

_LONGEST_STEP_S: Final = 0.5
_YAW_SHARE: Final = 0.7  # of the yaw rate, so that the yaw can follow


class Steering(Protocol):
    """A vehicle in flight that accepts heading commands."""

    async def turn_to(self, heading_rad: float) -> None:
        """Turn to a heading, the short way round, and hold it."""
        ...


class CourseReference:
    """A point that moves over ground at constant speed and height. Its heading changes no faster than a
    multicopter can follow. No I/O.
    """

    def __init__(
        self,
        *,
        place_ned_m: tuple[float, float, float],
        heading_rad: float,
        speed_m_s: float,
        limits: MulticopterLimits,
    ) -> None:
        """Initialise the point at rest.

        Args:
            place_ned_m: position from home; its height is kept.
            heading_rad: initial heading.
            speed_m_s: speed of the flight.
            limits: limits of the vehicle.
        """
        limits.check_speed(speed_m_s)
        self.heading_rad = heading_rad
        self._wanted_rad = heading_rad
        self._north_m, self._east_m, self._down_m = place_ned_m
        self._wanted_m_s = speed_m_s
        self._speed_m_s = 0.0
        self._limits = limits
        self._time_s = 0.0

    def turn_to(self, heading_rad: float) -> None:
        """Set the heading to turn to."""
        self._wanted_rad = heading_rad

    def stop(self) -> None:
        """Slow down to rest, straight ahead."""
        self._wanted_m_s = 0.0
        self._wanted_rad = self.heading_rad

    @property
    def at_rest(self) -> bool:
        """Whether it was stopped and is at rest."""
        return self._wanted_m_s == 0.0 and self._speed_m_s == 0.0

    def at(self, time_s: float) -> Setpoint:
        """The setpoint at a time; times must not decrease."""
        dt_s = min(_LONGEST_STEP_S, max(0.0, time_s - self._time_s))
        self._time_s = time_s
        limits = self._limits
        most_m_s = limits.tangential_m_s2 * dt_s
        change_m_s = min(most_m_s, max(-most_m_s, self._wanted_m_s - self._speed_m_s))
        self._speed_m_s += change_m_s
        rate_rad_s = min(_YAW_SHARE * limits.yaw_rate_rad_s, limits.lateral_m_s2 / max(self._speed_m_s, 1.0))
        left_rad = math.remainder(self._wanted_rad - self.heading_rad, math.tau)
        turn_rad = min(rate_rad_s * dt_s, max(-rate_rad_s * dt_s, left_rad))
        middle_rad = self.heading_rad + 0.5 * turn_rad
        self.heading_rad = (self.heading_rad + turn_rad) % math.tau
        self._north_m += self._speed_m_s * dt_s * math.cos(middle_rad)
        self._east_m += self._speed_m_s * dt_s * math.sin(middle_rad)
        cosine, sine = math.cos(self.heading_rad), math.sin(self.heading_rad)
        forward, right = (change_m_s / dt_s, self._speed_m_s * turn_rad / dt_s) if dt_s > 0.0 else (0.0, 0.0)
        return Setpoint(
            position_ned_m=(self._north_m, self._east_m, self._down_m),
            velocity_ned_m_s=(self._speed_m_s * cosine, self._speed_m_s * sine, 0.0),
            acceleration_ned_m_s2=(forward * cosine - right * sine, forward * sine + right * cosine, 0.0),
            yaw_rad=math.remainder(self.heading_rad, math.tau),
            yaw_rate_rad_s=turn_rad / dt_s if dt_s > 0.0 else 0.0,
        )


class _CourseFlight:
    """A multicopter that flies commanded headings."""

    def __init__(self, reference: CourseReference) -> None:
        self._reference = reference

    async def turn_to(self, heading_rad: float) -> None:
        self._reference.turn_to(heading_rad)


@asynccontextmanager
async def steering(
    vehicle: Vehicle, *, altitude_m: float, speed_m_s: float, rate_hz: float
) -> AsyncIterator[Steering]:
    """Fly headings at a height: `async with steering(...) as flight: await flight.turn_to(...)`.

    The vehicle must be in the air. At the end it holds its position.

    Args:
        altitude_m: height above home.
        speed_m_s: airspeed of an aircraft, ground speed of a multicopter.
        rate_hz: setpoints per vehicle second.
    """
    if vehicle.kind is VehicleKind.FIXED_WING:
        async with vehicle.wing.heading_flight(altitude_m=altitude_m, airspeed_m_s=speed_m_s) as flight:
            yield flight
        return
    limits = await vehicle.limits()
    if not isinstance(limits, MulticopterLimits):
        raise PlanError(f"a {vehicle.kind} is not flown along headings")
    here = await vehicle.position()
    north_m, east_m, _ = LocalFrame(vehicle.home).ned_from_geodetic(here.lat_deg, here.lon_deg, here.alt_m)
    attitude = vehicle.latest(Attitude)
    reference = CourseReference(
        place_ned_m=(north_m, east_m, -altitude_m),
        heading_rad=0.0 if attitude is None else attitude.yaw_rad % math.tau,
        speed_m_s=speed_m_s,
        limits=limits,
    )
    async with vehicle.guided(rate_hz) as session:
        following = asyncio.ensure_future(
            session.follow(lambda t: None if reference.at_rest else reference.at(t))
        )
        try:
            yield _CourseFlight(reference)
            reference.stop()
            await following
        finally:
            following.cancel()
            await asyncio.gather(following, return_exceptions=True)
