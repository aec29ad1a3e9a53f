"""Flies a pattern by streamed setpoints: points of the path for PX4, bank angles for ArduPilot's plane."""

import math
from dataclasses import replace
from typing import Final

from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import MissionError
from missions.pattern_search.wings.flight import PatternFlight
from missions.pattern_search.wings.guidance import PathRoll, PathRollParameters, TurnEffect
from missions.pattern_search.wings.place import PlaceOnPath
from missions.planning.flyable import FlyablePath
from missions.planning.way_in import Entry
from missions.vehicle import telemetry
from missions.vehicle.notes import PATTERN
from missions.vehicle.setpoint import AnySetpoint, AttitudeSetpoint, Setpoint
from missions.vehicle.vehicle import Vehicle

_ENTRY_S: Final = 0.8  # delay from the decision to leave the circle to the first flown setpoint
_BANK_SHARE: Final = 0.95
_QUICKEST_RAD_S: Final = 0.6
_STREAM_S: Final = 0.05  # age of a position, and of a setpoint


async def fly_setpoints(vehicle: Vehicle, flight: PatternFlight) -> None:
    """Fly the pattern, including takeoff and landing."""
    notes, clock, options = vehicle.notes, vehicle.clock, flight.options
    notes.commanded = flight.commanded(vehicle, [], options.acceptance_m)
    gains = await _gains(vehicle, flight)
    notes.begin("takeoff", clock.stamp_us)
    await vehicle.takeoff(options.own_altitude_m)
    notes.commanded = replace(notes.commanded, origin=vehicle.home)  # arming has set the home again
    notes.begin("transit", clock.stamp_us)
    effect = TurnEffect()
    await _to_the_start(vehicle, flight, effect)
    stream = _Stream(vehicle, flight, gains, effect)
    if vehicle.firmware.roll_alone:
        await vehicle.change_altitude(options.own_altitude_m)
        await vehicle.follow(stream.roll, options.rate_hz)
    else:
        await vehicle.follow(stream.point, options.rate_hz)
    await vehicle.wing.land_along(flight.approach(vehicle))
    notes.end(clock.stamp_us)


async def _to_the_start(vehicle: Vehicle, flight: PatternFlight, effect: TurnEffect) -> None:
    """Circle next to the entry of the pattern until the aircraft flies along the entry, at the pattern's
    height.

    On the circle the effect of a bank is measured.
    """
    frame = LocalFrame(vehicle.home)
    here = await vehicle.position()
    north, east, _ = frame.ned_from_geodetic(here.lat_deg, here.lon_deg, here.alt_m)
    entry = Entry.to(flight.route, flight.turn_radius_m, (north, east))
    lat, lon, alt = frame.geodetic_from_ned(*entry.centre_m, -flight.options.own_altitude_m)
    await vehicle.wing.loiter(
        GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt),
        radius_m=entry.radius_m,
        clockwise=entry.clockwise,
        wait=False,
    )
    await vehicle.wing.change_airspeed(flight.options.speed_m_s)

    def leaving() -> bool:
        _measure(vehicle, effect)
        return entry.leaving(vehicle, _ENTRY_S)

    await vehicle.link.wait_until(
        leaving, what="the way into the pattern", on=("GLOBAL_POSITION_INT",), timeout_s=240.0 + flight.away_s
    )


def path_point(
    route: FlyablePath, arc_m: float, speed_m_s: float, lead_s: float, height_m: float
) -> Setpoint:
    """The setpoint with the aircraft's place on the path and, as velocity, the direction of the path `lead_s`
    ahead.

    PX4's guidance demands V * 4 pi damping / period * sin(angle to that direction). In a bend, the direction
    of the path at this lead time makes the demand equal to the acceleration of the bend. It is not sent as an
    acceleration, because PX4 1.16.1 derives a curvature with the wrong sign from it on a fixed wing.

    Args:
        route: route of the pattern.
        arc_m: place of the aircraft along it.
        speed_m_s: ground speed.
        lead_s: period / (4 pi damping) of the guidance.
        height_m: height above home.
    """
    (north, east), _, _ = route.at(arc_m)
    _, course, _ = route.at(arc_m + lead_s * speed_m_s)
    return Setpoint(
        position_ned_m=(north, east, -height_m),
        velocity_ned_m_s=(speed_m_s * math.cos(course), speed_m_s * math.sin(course), 0.0),
    )


def _measure(vehicle: Vehicle, effect: TurnEffect) -> None:
    position, attitude = vehicle.latest(telemetry.Position), vehicle.latest(telemetry.Attitude)
    if position is not None and attitude is not None:
        north_m_s, east_m_s, _ = position.vel_ned_m_s
        effect.update(position.time_us, (north_m_s, east_m_s), attitude.roll_rad, attitude.yaw_rad)


async def _gains(vehicle: Vehicle, flight: PatternFlight) -> PathRollParameters:
    """Lead time of a bend's command and, for banks, gains as fast as the tuning of the aircraft's own
    guidance.
    """
    bank_max_rad = _BANK_SHARE * flight.limits.bank_max_rad
    if not vehicle.firmware.roll_alone:
        period_s = max(1.0, await vehicle.parameters.read_or("NPFG_PERIOD", 10.0))
        damping = max(0.1, await vehicle.parameters.read_or("NPFG_DAMPING", 0.7))
        return PathRollParameters(lead_s=period_s / (4.0 * math.pi * damping), bank_max_rad=bank_max_rad)
    period_s = max(1.0, await vehicle.parameters.read_or("NAVL1_PERIOD", 17.0))
    roll_s = min(3.0, max(0.1, await vehicle.parameters.read_or("RLL2SRV_TCONST", 0.5)))
    return PathRollParameters(
        frequency_rad_s=min(_QUICKEST_RAD_S, math.tau / period_s),
        lead_s=roll_s + _STREAM_S,
        bank_max_rad=bank_max_rad,
    )


class _Stream:
    """Setpoints for the aircraft's place along the route; notes the beginning and the end of the pattern."""

    def __init__(
        self, vehicle: Vehicle, flight: PatternFlight, gains: PathRollParameters, effect: TurnEffect
    ) -> None:
        self._vehicle = vehicle
        self._flight = flight
        self._place = PlaceOnPath(vehicle, flight.route, float(flight.route.arc_m[0]))
        self._effect = effect
        self._law = PathRoll(flight.route, gains, effect)
        self._lead_s = gains.lead_s

    def _go_on(self) -> bool:
        """Update the place; returns False after the pattern's end."""
        notes, place = self._vehicle.notes, self._place
        place.update()
        length_m = self._flight.path.length_m
        if place.arc_m < 0.0:
            return True
        if notes.current != PATTERN:
            notes.begin(PATTERN, self._vehicle.clock.stamp_us)
        notes.progress = min(1.0, place.arc_m / length_m)
        if place.arc_m < length_m:
            return True
        notes.begin("return", self._vehicle.clock.stamp_us)
        return False

    def point(self, _time_s: float) -> AnySetpoint | None:
        """The setpoint for PX4: a point of the path."""
        if not self._go_on():
            return None
        place = self._place
        height_m = self._flight.options.own_altitude_m
        return path_point(self._flight.route, place.arc_m, place.ground_speed_m_s, self._lead_s, height_m)

    def roll(self, _time_s: float) -> AnySetpoint | None:
        """The setpoint for ArduPilot's plane, which accepts no path: the bank that follows it."""
        vehicle = self._vehicle
        if not self._go_on():
            return None
        attitude = vehicle.latest(telemetry.Attitude)
        if attitude is None:
            raise MissionError(f"the vehicle reports no attitude (ATTITUDE); {vehicle.link.last_received()}")
        _measure(vehicle, self._effect)
        return AttitudeSetpoint(
            roll_rad=self._law.roll_rad(self._place, attitude.yaw_rad, vehicle.clock.time_us)
        )
