"""One flight of a team that searches by steps from place to place, including takeoff and landing of every
vehicle.

What is searched for, by which sensor, and where the next place is, belong to the mission: a `StepSearch` and
a `SearchWatch`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final, Generic, Protocol, TypeVar

from autopilot_bridge.mavlink import dialect
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.geodetic_position import NorthEast
from flightsim.foundation.vectors import Vector, wrap_pi
from missions.errors import MissionError
from missions.kind import VehicleKind
from missions.search.options import StepLawKind
from missions.search.steps import BacksteppingLaw, StepLaw, TrajectoryLaw
from missions.teams.layers import Layers
from missions.teams.steering import steering
from missions.vehicle.concurrency import run_concurrently
from missions.vehicle.limits import Limits, MulticopterLimits
from missions.vehicle.setpoint import Setpoint
from missions.vehicle.telemetry import Position
from missions.vehicle.vehicle import Vehicle

HEADING_RAD: Final = 0.0
"""Heading of a multicopter while it searches (paper: the desired angles are 0)."""

SEARCH: Final = "search"
"""Name of the phase in which a vehicle searches."""

_TURN_S: Final = 4.0  # for the turn to the heading of the search
_POSITION_HZ: Final = {StepLawKind.TRAJECTORY: 10.0, StepLawKind.BACKSTEPPING: 50.0}
"""The backstepping law closes a loop over position and velocity; the other one only watches the arrival."""
_SLOWEST_SHARE: Final = 0.2  # of the speed: a step that takes longer is given up
_LEAST_STEP_S: Final = 15.0
_SAME_RAD: Final = math.radians(3.0)  # smaller changes of heading are not commanded
_POSITION_S: Final = 10.0  # longest time without a position, where headings are commanded from it


@dataclass(slots=True, kw_only=True)
class Searcher:
    """One vehicle's part in the search.

    Attributes:
        track: (time us, north m, east m) of its reported positions, some per second.
        began_us, ended_us: begin and end of its search, vehicle time; -1: not yet.
        goal: place of its next scan.
        late_steps: number of steps that were given up because the place was not reached.
    """

    track: list[tuple[int, float, float]] = field(default_factory=list)
    began_us: int = -1
    ended_us: int = -1
    goal: NorthEast = (0.0, 0.0)
    goal_us: int = 0
    late_steps: int = 0


class StepSearchOptions(Protocol):
    """What the flight needs of a mission's options.

    Attributes:
        own_altitude_m: altitude of the vehicle's layer.
        rate_hz: setpoints per vehicle second.
        law: how a multicopter flies a step.
        speed_m_s: largest speed; None is not accepted here.
        acceptance_m: a place counts as reached within this distance.
        step_length_m: usual distance to the next place.
        steps: largest number of steps of a vehicle.
        sensor_limit_s: the search ends when no scan was received for this time.
    """

    @property
    def own_altitude_m(self) -> float: ...
    @property
    def rate_hz(self) -> float: ...
    @property
    def law(self) -> StepLawKind: ...
    @property
    def speed_m_s(self) -> float | None: ...
    @property
    def acceptance_m(self) -> float | None: ...
    @property
    def step_length_m(self) -> float: ...
    @property
    def steps(self) -> int: ...
    @property
    def sensor_limit_s(self) -> float: ...


class StepSearch(Protocol):
    """The state of a search: each vehicle's goal, and when the search is over.

    Attributes:
        reason: why the search is over; "": it is not.
        began_us: time at which the first vehicle began; -1: none has.
    """

    reason: str
    began_us: int

    @property
    def over(self) -> bool:
        """Whether the search is over."""
        ...

    @property
    def progress(self) -> float:
        """Share of the search that is done, 0..1."""
        ...

    def begin(self, index: int, time_us: int) -> NorthEast:
        """A vehicle begins; returns its first place."""
        ...

    def may_step(self, index: int) -> bool:
        """Whether enough is known for the vehicle's next decision."""
        ...

    def step(self, index: int, time_us: int, here: NorthEast) -> NorthEast:
        """A vehicle has reached its goal; returns its next one."""
        ...

    def leave(self, index: int) -> None:
        """A vehicle has ended its search."""
        ...


class SearchWatch(Protocol):
    """The estimators of a search, fed with the messages that the mission receives."""

    def start(self) -> None:
        """Start to process messages."""
        ...

    def stop(self) -> None:
        """Stop processing messages."""
        ...


Options = TypeVar("Options", bound=StepSearchOptions)


class SearchTeam(Generic[Options]):
    """The vehicles of one flight and their shared search. A subclass makes `search` and `watch`, and calls
    `scanned` when its watch has processed a scan.

    Args:
        vehicles: the vehicles, each ready to arm.
        options: options of each vehicle, adapted to it.
        check: refuses what a vehicle can't fly.
        rates_hz: messages that a vehicle must send, beside GLOBAL_POSITION_INT.

    Attributes:
        searchers: one per vehicle.
        gave_up: why the search was given up; "": it was not.
    """

    search: StepSearch
    watch: SearchWatch

    def __init__(
        self,
        vehicles: Sequence[Vehicle],
        options: Sequence[Options],
        *,
        check: Callable[[Options, Limits], None],
        rates_hz: Mapping[str, float] = MappingProxyType({}),
    ) -> None:
        self._vehicles = tuple(vehicles)
        self._options = tuple(options)
        self._check, self._rates_hz = check, rates_hz
        self.searchers = [Searcher() for _ in vehicles]
        self.gave_up = ""
        first = options[0]
        self._layers = Layers(
            vehicles,
            [own.own_altitude_m for own in options],
            busy_s=4.0 * first.steps * first.step_length_m / (first.speed_m_s or 1.0),
        )
        self._frame = LocalFrame(vehicles[0].home)
        self._scan_us = -1

    def _heading_rad(self, index: int) -> float | None:
        """Heading of a multicopter on its way to its goal; None: as before."""
        return None

    def scanned(self) -> None:
        """A scan was processed: the sensor is not silent."""
        self._scan_us = self._vehicles[0].clock.time_us

    async def fly(self) -> None:
        """Fly all vehicles."""
        self.watch.start()
        try:
            await run_concurrently([self._fly_one(index) for index in range(len(self._vehicles))])
        finally:
            self.watch.stop()

    async def _fly_one(self, index: int) -> None:
        vehicle, own = self._vehicles[index], self._options[index]
        notes, clock = vehicle.notes, vehicle.clock
        notes.begin("checks", clock.stamp_us)
        limits = await vehicle.limits(own.own_altitude_m)
        self._check(own, limits)
        await vehicle.commands.set_message_rate("GLOBAL_POSITION_INT", _POSITION_HZ[own.law])
        for name, rate_hz in self._rates_hz.items():
            await vehicle.commands.set_message_rate(name, rate_hz)
        await vehicle.commands.request(dialect.MAVLink_home_position_message, 3.0)
        if vehicle.kind is VehicleKind.FIXED_WING:
            await vehicle.wing.prepare_piloting()
        await self._layers.take_off(index)
        if index == 0:
            self._frame = LocalFrame(vehicle.home)  # arming has set the home again
        if not self.search.over:
            if isinstance(limits, MulticopterLimits):
                await self._search_by_setpoints(index, limits)
            else:
                await self._search_by_headings(index)
        self.search.leave(index)
        if self.search.over:
            self.watch.stop()  # the way home is no part of the search
        vehicle.sensors.release()
        self.searchers[index].ended_us = clock.time_us
        await self._layers.land(index)

    # the search

    def _begin(self, index: int) -> None:
        vehicle, searcher = self._vehicles[index], self.searchers[index]
        vehicle.notes.begin(SEARCH, vehicle.clock.stamp_us)
        now_us = vehicle.clock.time_us
        if self.search.began_us < 0:
            self._scan_us = max(self._scan_us, self._vehicles[0].clock.time_us)
        searcher.began_us = searcher.goal_us = now_us
        searcher.goal = self.search.begin(index, vehicle.clock.stamp_us)

    def _advance(self, index: int, here: NorthEast) -> bool:
        """Process a position: decide when the goal is reached. Returns whether the goal has changed."""
        search, searcher, own = self.search, self.searchers[index], self._options[index]
        vehicle = self._vehicles[index]
        now_us = vehicle.clock.time_us
        if not searcher.track or now_us - searcher.track[-1][0] >= 500_000:
            searcher.track.append((now_us, *here))
        vehicle.notes.progress = search.progress
        self._check_sensors()
        away_m = math.dist(here, searcher.goal)
        if away_m > (own.acceptance_m or 2.0):
            step_m = own.step_length_m
            limit_s = _LEAST_STEP_S + max(step_m, away_m) / (_SLOWEST_SHARE * (own.speed_m_s or 4.0))
            if now_us - searcher.goal_us < limit_s * 1e6:
                return False
            searcher.late_steps += 1
        if search.over or not search.may_step(index):
            return False
        searcher.goal = search.step(index, vehicle.clock.stamp_us, here)
        searcher.goal_us = now_us
        return True

    def _check_sensors(self) -> None:
        """End the search when a sensor has stopped, or no scan could be fused for long: all fly home in
        their layers.
        """
        if self.search.over:
            return
        stopped = next(filter(None, (vehicle.sensors.stopped for vehicle in self._vehicles)), "")
        if stopped:
            self.search.reason = self.gave_up = stopped
            return
        silent_s = (self._vehicles[0].clock.time_us - self._scan_us) * 1e-6
        if silent_s > self._options[0].sensor_limit_s:
            self.search.reason = self.gave_up = f"no scan was fused for {silent_s:.0f} s"

    async def _search_by_setpoints(self, index: int, limits: MulticopterLimits) -> None:
        """Fly from place to place by streamed setpoints; while no scan arrives, the vehicle holds its
        place.
        """
        vehicle, own, searcher = self._vehicles[index], self._options[index], self.searchers[index]
        own_frame = LocalFrame(vehicle.home)
        down_m = -own.own_altitude_m

        def from_home(place: NorthEast) -> Vector:
            there = self._frame.geodetic_from_ned(*place, 0.0)
            north_m, east_m, _ = own_frame.ned_from_geodetic(*there)
            return north_m, east_m, down_m

        def measured() -> Position:
            p = vehicle.latest(Position)
            if p is None:
                raise MissionError(f"the vehicle reports no position; {vehicle.link.last_received()}")
            return p

        def own_place(p: Position) -> Vector:
            return own_frame.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)

        start = own_place(measured())
        law: StepLaw = (TrajectoryLaw if own.law is StepLawKind.TRAJECTORY else BacksteppingLaw)(
            place_ned_m=(start[0], start[1], down_m),
            speed_m_s=own.speed_m_s or 4.0,
            limits=limits,
            yaw_rad=HEADING_RAD,
        )

        def source(time_s: float) -> Setpoint | None:
            if self.search.over:
                return None
            here = measured()
            if time_s >= _TURN_S:
                if searcher.began_us < 0:
                    self._begin(index)
                    law.aim(from_home(searcher.goal), self._heading_rad(index))
                elif self._advance(index, self._team_place(here)):
                    law.aim(from_home(searcher.goal), self._heading_rad(index))
            return law.setpoint(time_s, own_place(here), here.vel_ned_m_s)

        async with vehicle.guided(own.rate_hz) as session:
            await session.follow(source)

    def _team_place(self, position: Position) -> NorthEast:
        """A place in the frame of the team."""
        north_m, east_m, _ = self._frame.ned_from_geodetic(position.lat_deg, position.lon_deg, position.alt_m)
        return north_m, east_m

    async def _search_by_headings(self, index: int) -> None:
        """Fly an aircraft along headings to one place after the other."""
        vehicle, own, searcher = self._vehicles[index], self._options[index], self.searchers[index]
        async with steering(
            vehicle, altitude_m=own.own_altitude_m, speed_m_s=own.speed_m_s or 0.0, rate_hz=own.rate_hz
        ) as flight:
            self._begin(index)
            commanded: float | None = None
            with vehicle.link.messages(dialect.MAVLink_global_position_int_message) as stream:
                while True:
                    await vehicle.link.next_frame(
                        stream, what="position during the search", timeout_s=_POSITION_S
                    )
                    vehicle.link.require_armed("during the search")
                    p = vehicle.latest(Position)
                    if p is None:
                        continue
                    north_m, east_m = self._team_place(p)
                    self._advance(index, (north_m, east_m))
                    if self.search.over:
                        break
                    bearing = math.atan2(searcher.goal[1] - east_m, searcher.goal[0] - north_m)
                    if commanded is None or abs(wrap_pi(bearing - commanded)) > _SAME_RAD:
                        commanded = bearing % math.tau
                        await flight.turn_to(commanded)
