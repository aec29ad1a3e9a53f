"""One aircraft's flight of a survey: along the lines as an uploaded mission, or the manoeuvres of a
compensation by attitude setpoints.
"""

import asyncio
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from autopilot_bridge.mission_plan import MissionItem
from estimators.survey.lines import LinePlan, SurveyLine
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import MissionError
from missions.planning.outline import Outline
from missions.planning.way_in import Entry, runway_approach, way_in_items, waypoint_item
from missions.survey.drape import Drape
from missions.survey.inputs import map_frame, terrain_of
from missions.survey.manoeuvres import Programme, manoeuvres
from missions.survey.options import SurveyOptions
from missions.survey.plan import SurveyPath, line_plan, survey_path
from missions.vehicle.firmware import Mode
from missions.vehicle.limits import FixedWingLimits
from missions.vehicle.notes import PATTERN, CommandedPath
from missions.vehicle.setpoint import AttitudeSetpoint
from missions.vehicle.telemetry import Attitude, Position
from missions.vehicle.vehicle import Vehicle

CALIBRATION: Final = "calibration"
"""Name of the phase between the takeoff and the first manoeuvre, and of those between two."""

LEAD_S: Final = 8.0
"""Straight flight before a line, in which the remaining errors of the turn settle."""
_TURN_MARGIN: Final = 1.3
_RUN_OUT_S: Final = 3.0
_ACCEPTANCE_M: Final = 20.0
_TURN_IN_MAX_M: Final = 250.0  # ArduPlane accepts at most 255 as a waypoint's radius
_SLOW: Final = 0.5  # share of the airspeed: slowest ground speed that deadlines allow for
_LEAST_CIRCLE_M: Final = 80.0
_RATES_HZ: Final = {"GLOBAL_POSITION_INT": 10.0, "ATTITUDE": 25.0}
_TAKEOFF_M: Final = 80.0  # ArduPlane takes off to 200 m at most
_CLIMB_S: Final = 120.0
_SLOWEST_CLIMB_M_S: Final = 0.5
_SETPOINT_HZ: Final = 25.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedSurvey:
    """A survey as one aircraft flies it.

    Attributes:
        path: lines, way and waypoints, in the frame of the survey.
        offset_ned_m: origin of the survey's frame, from the vehicle's home.
        turn_radius_m: of the turns.
        speed_m_s: airspeed.
    """

    path: SurveyPath
    offset_ned_m: tuple[float, float, float]
    turn_radius_m: float
    speed_m_s: float

    def places_ned_m(self) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        """The waypoints (n, 3) from the vehicle's home."""
        path = self.path
        return np.column_stack((path.waypoints_m, -path.heights_m)) + np.array(self.offset_ned_m)

    def commanded(self, vehicle: Vehicle, acceptance_m: float) -> CommandedPath:
        """The path with which the flight is compared: from the first line's start to the last one's end."""
        path = self.path
        begin_m, end_m = path.arcs_m[path.first_line], path.arcs_m[path.last_line]
        arc_m = path.path.arc_m
        inside = (arc_m > begin_m) & (arc_m < end_m)
        arcs = np.concatenate(([begin_m], arc_m[inside], [end_m]))
        columns = [np.interp(arcs, arc_m, axis) for axis in path.path.points_m.T]
        points = np.column_stack((*columns, -np.interp(arcs, path.arcs_m, path.heights_m)))
        return CommandedPath(
            origin=vehicle.home,
            points_ned_m=points + np.array(self.offset_ned_m),
            waypoints_ned_m=self.places_ned_m()[path.first_line : path.last_line + 1],
            acceptance_m=acceptance_m,
        )

    @property
    def duration_s(self) -> float:
        return self.path.path.length_m / self.speed_m_s


def planned_survey(options: SurveyOptions, limits: FixedWingLimits, home: GeodeticPosition) -> PlannedSurvey:
    """The survey of an aircraft with these limits.

    Args:
        options: as this aircraft flies them.
        limits: its limits, with the wind to plan for.
        home: its home.
    """
    plan = planned_lines(options, limits)
    speed_m_s = airspeed_m_s(options, limits)
    origin = map_frame(options, home).origin
    north_m, east_m, down_m = LocalFrame(home).ned_from_geodetic(origin.lat_deg, origin.lon_deg, origin.alt_m)
    terrain = terrain_of(options)
    fastest_m_s = limits.true_airspeed_m_s(speed_m_s) + limits.wind_m_s
    radius_m = turn_radius_m(options, limits)
    path = survey_path(
        plan,
        Drape(terrain=terrain, altitude_m=options.own_altitude_m, climb=options.climb),
        turn_radius_m=radius_m,
        lead_m=LEAD_S * fastest_m_s,
        run_out_m=_RUN_OUT_S * fastest_m_s,
    )
    # heights over level ground are above the vehicle's home; those of a terrain have the zero of the map's
    return PlannedSurvey(
        path=path,
        offset_ned_m=(north_m, east_m, 0.0 if terrain is None else down_m),
        turn_radius_m=radius_m,
        speed_m_s=speed_m_s,
    )


def planned_lines(options: SurveyOptions, limits: FixedWingLimits) -> LinePlan:
    """The lines of a survey in the order in which an aircraft with these limits flies them."""
    return line_plan(options, turn_radius_m=turn_radius_m(options, limits))


def turn_radius_m(options: SurveyOptions, limits: FixedWingLimits) -> float:
    """Radius of the turns between lines: with room for the time in which the bank is reversed."""
    return _TURN_MARGIN * limits.path_radius_m(airspeed_m_s(options, limits))


def airspeed_m_s(options: SurveyOptions, limits: FixedWingLimits) -> float:
    """The airspeed of a survey."""
    return limits.airspeed_trim_m_s if options.speed_m_s is None else options.speed_m_s


def outline_of(survey: PlannedSurvey) -> Outline:
    """The path for the checks before the flight."""
    places = [(float(n), float(e), float(d)) for n, e, d in survey.places_ned_m()]
    return Outline(points_ned_m=tuple(places), duration_s=survey.duration_s)


def mission_items(
    vehicle: Vehicle, options: SurveyOptions, survey: PlannedSurvey, limits: FixedWingLimits
) -> list[MissionItem]:
    """The items of the whole flight: takeoff, airspeed, a circle, the waypoints, the landing."""
    places = survey.places_ned_m().tolist()
    radius_m = _turn_in_m(survey.speed_m_s, limits)
    items = way_in_items(
        vehicle,
        Entry.to(survey.path.path.moved(*survey.offset_ned_m[:2]), survey.turn_radius_m),
        airspeed_m_s=survey.speed_m_s,
        takeoff_m=options.own_altitude_m,
        height_m=-places[0][2],
    )
    items += [waypoint_item(vehicle, radius_m, north, east, -down) for north, east, down in places]
    return items + runway_approach(vehicle, options.index, survey.turn_radius_m).items()


FIRST_WAYPOINT: Final = 3
"""Index of the first waypoint in `mission_items`."""


async def fly_lines(
    vehicle: Vehicle, options: SurveyOptions, survey: PlannedSurvey, limits: FixedWingLimits
) -> None:
    """Fly the lines, including takeoff and landing."""
    notes, clock = vehicle.notes, vehicle.clock
    await _prepare(vehicle, options, limits)
    acceptance_m = await vehicle.adapter.acceptance_m(_turn_in_m(survey.speed_m_s, limits))
    items = mission_items(vehicle, options, survey, limits)
    notes.commanded = survey.commanded(vehicle, acceptance_m)
    notes.begin("upload", clock.stamp_us)
    start = await vehicle.plans.upload_mission(items)
    notes.begin("takeoff", clock.stamp_us)
    await vehicle.start_mission()
    slow_m_s = _SLOW * survey.speed_m_s
    away_s = (
        survey.path.path.moved(*survey.offset_ned_m[:2]).reach_m + 10.0 * survey.turn_radius_m
    ) / slow_m_s
    path, lines = survey.path, survey.path.plan.lines
    first, last = (start + FIRST_WAYPOINT + number for number in (path.first_line, path.last_line))
    await vehicle.plans.wait_item_reached(first, 240.0 + 2.0 * options.own_altitude_m + away_s)
    await _passed(vehicle, survey, lines[0], 0.0)
    notes.begin(PATTERN, clock.stamp_us)

    def progress(done: int) -> None:
        notes.progress = min(1.0, max(0.0, (done - first) / max(1, last - first)))

    await vehicle.plans.wait_item_reached(last, 60.0 + path.path.length_m / slow_m_s, progress)
    await _passed(vehicle, survey, lines[-1], lines[-1].length_m)
    vehicle.sensors.release()
    notes.begin("return", clock.stamp_us)
    await vehicle.link.wait_disarmed(600.0 + 2.0 * away_s)
    notes.end(clock.stamp_us)


async def _passed(vehicle: Vehicle, survey: PlannedSurvey, line: SurveyLine, along_m: float) -> None:
    """Wait until the aircraft is abeam of a place on a line; waypoints count as reached before that."""
    frame = LocalFrame(vehicle.home)

    def there() -> bool:
        p = vehicle.latest(Position)
        if p is None:
            return False
        north_m, east_m, _ = frame.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)
        offset = survey.offset_ned_m
        along, _ = line.along_across_m(np.array([north_m - offset[0]]), np.array([east_m - offset[1]]))
        return float(along[0]) >= along_m

    await vehicle.link.wait_until(
        there, what=f"a place on line {line.name}", on=("GLOBAL_POSITION_INT",), timeout_s=60.0
    )


async def fly_manoeuvres(vehicle: Vehicle, options: SurveyOptions, limits: FixedWingLimits) -> None:
    """Fly the manoeuvres of a compensation, including takeoff and landing."""
    notes, clock = vehicle.notes, vehicle.clock
    await _prepare(vehicle, options, limits)
    pilot = await vehicle.wing.prepare_piloting()
    await pilot.prepare(options.own_altitude_m, airspeed_m_s(options, limits))
    notes.begin("takeoff", clock.stamp_us)
    await vehicle.takeoff(min(options.own_altitude_m, _TAKEOFF_M))
    notes.begin("climb", clock.stamp_us)
    await _climb(vehicle, options.own_altitude_m, limits.turn_radius_m(airspeed_m_s(options, limits)))
    notes.begin(CALIBRATION, clock.stamp_us)
    programme = Programme(manoeuvres(options.direction_rad))
    level_rad: list[float] = []

    def source(time_s: float) -> AttitudeSetpoint | None:
        attitude = vehicle.latest(Attitude)
        if attitude is None:
            raise MissionError(f"the vehicle reports no attitude (ATTITUDE); {vehicle.link.last_received()}")
        before = programme.current
        command = programme.command(time_s, yaw_rad=attitude.yaw_rad, airspeed_m_s=pilot.airspeed_true_m_s)
        if command is None:
            return None
        if programme.current is not before:
            label = CALIBRATION if programme.current is None else programme.current.label
            notes.begin(label, clock.stamp_us)
            notes.progress = programme.done / programme.count
        setpoint = pilot.setpoint(clock.time_us, command.roll_rad)
        if not command.pitch_offset_rad:
            level_rad[:] = [*level_rad[-50:], attitude.pitch_rad]
            return setpoint
        level = sum(level_rad) / max(1, len(level_rad))
        base_rad = level if setpoint.pitch_rad is None else setpoint.pitch_rad
        return replace(setpoint, pitch_rad=base_rad + command.pitch_offset_rad)

    async with vehicle.guided(_SETPOINT_HZ) as guided:
        following = asyncio.ensure_future(guided.follow(source))
        try:
            if vehicle.firmware.roll_alone:
                await vehicle.link.wait_until(
                    lambda: (
                        following.done() or vehicle.link.custom_mode == vehicle.firmware.modes[Mode.GUIDED]
                    ),
                    what="guided mode",
                    on=("HEARTBEAT",),
                    timeout_s=10.0,
                )
                await pilot.begin()
            await following
        finally:
            following.cancel()
            await asyncio.gather(following, return_exceptions=True)
    vehicle.sensors.release()
    notes.begin("return", clock.stamp_us)
    radius_m = limits.turn_radius_m(airspeed_m_s(options, limits))
    await vehicle.wing.land_along(runway_approach(vehicle, options.index, radius_m))
    notes.end(clock.stamp_us)


async def _climb(vehicle: Vehicle, altitude_m: float, radius_m: float) -> None:
    """Climb in a circle over home, because takeoffs end lower."""
    home = vehicle.home
    await vehicle.wing.loiter(
        replace(home, alt_m=home.alt_m + altitude_m),
        radius_m=max(_LEAST_CIRCLE_M, radius_m),
        timeout_s=_CLIMB_S + altitude_m / _SLOWEST_CLIMB_M_S,
    )


async def _prepare(vehicle: Vehicle, options: SurveyOptions, limits: FixedWingLimits) -> None:
    """Request what readings are placed with."""
    vehicle.notes.begin("checks", vehicle.clock.stamp_us)
    if options.altitude_m > limits.altitude_max_m:
        vehicle.notes.warn(
            f"the flight at {options.altitude_m:g} m is above {limits.altitude_max_m:g} m, the ceiling of "
            "the open category (EU 2019/947): it needs an authorization"
        )
    if options.terrain_file is not None:  # the height over its ground was checked, which may be below home
        vehicle.allow_below_home = True
    for name, rate_hz in _RATES_HZ.items():
        await vehicle.commands.set_message_rate(name, rate_hz)
    await vehicle.link.wait_until(
        lambda: vehicle.latest(Position) is not None and vehicle.latest(Attitude) is not None,
        what="position and attitude",
        on=("GLOBAL_POSITION_INT", "ATTITUDE"),
        timeout_s=10.0,
    )
    vehicle.wing.note_runway()


def _turn_in_m(speed_m_s: float, limits: FixedWingLimits) -> float:
    """Distance before a waypoint at which the aircraft turns to the next leg."""
    lead_m = limits.true_airspeed_m_s(speed_m_s) * limits.waypoint_lead_s
    return min(_TURN_IN_MAX_M, max(_ACCEPTANCE_M, lead_m))
