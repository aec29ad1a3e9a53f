"""One flight of a team that searches together, including takeoff and landing of every vehicle."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from autopilot_bridge.mavlink import dialect
from estimators.magnetic_identification.estimator import field_direction
from estimators.magnetic_identification.identifier import Identifier
from estimators.occupancy.detection import Anomaly, AnomalyDetector, MapError
from estimators.occupancy.placed_readings import PlacedReading
from estimators.occupancy.survey_map import SurveyMap
from missions.errors import MissionError
from missions.kind import VehicleKind
from missions.occupancy.checks import check_map, check_reach, check_vehicle, layout_of, stated_map_error
from missions.occupancy.field_watch import FieldWatch
from missions.occupancy.investigation import Investigation
from missions.occupancy.noise_check import require_quiet
from missions.occupancy.options import OccupancyOptions
from missions.occupancy.parameters import Identify
from missions.occupancy.pilot import Motion, Pilot
from missions.occupancy.search import Search
from missions.teams.layers import Layers
from missions.teams.steering import Steering, steering
from missions.vehicle.concurrency import run_concurrently
from missions.vehicle.telemetry import Attitude, Position
from missions.vehicle.vehicle import Vehicle

SEARCH: Final = "search"
"""Name of the phase in which a vehicle searches."""

_FIELD_YEAR: Final = 2026.0  # of the main field, whose direction changes little

_POSITION_S: Final = 10.0  # longest time without a position, where headings are commanded from it
_RING: Final = 0.25  # of the area: distance from its centre at which the searchers of a team start


@dataclass(slots=True, kw_only=True)
class Searcher:
    """One vehicle's part in the search.

    Attributes:
        pilot: its legs and heading commands.
        track: (team time us, north m, east m) of each placed reading of the search, by the vehicle's own
            estimate.
        anomalies: detected anomalies, at team times.
        watch: processing of its magnetometer.
        began_us, ended_us: begin and end of its search, vehicle time; -1: not yet.
    """

    pilot: Pilot
    track: list[tuple[int, float, float]] = field(default_factory=list)
    anomalies: list[Anomaly] = field(default_factory=list)
    watch: FieldWatch | None = None
    began_us: int = -1
    ended_us: int = -1


class SearchTeam:
    """The vehicles of one flight and their shared data.

    Attributes:
        search: the shared map and the found anomalies.
        searchers: one per vehicle.
        began_us: team time at which the first vehicle began to search; -1: none has.
    """

    def __init__(
        self, vehicles: Sequence[Vehicle], options: Sequence[OccupancyOptions], survey_map: SurveyMap
    ) -> None:
        """Store the arguments; no message is sent.

        Args:
            vehicles: the vehicles, each ready to arm.
            options: options of each vehicle, adapted to it.
            survey_map: the published map.

        Raises:
            PlanError: the map has no data somewhere in the area.
        """
        first = options[0]
        check_map(first, survey_map)
        self.search = Search(
            layout_of(first),
            first.search,
            [own.decision_parameters for own in options],
            noise_nt=first.identification.noise_nt,
            investigation=investigation_of(options, survey_map),
        )
        self.searchers = [
            Searcher(pilot=Pilot(self.search, k, start_ne_m=start_place(own)))
            for k, own in enumerate(options)
        ]
        self.began_us = -1
        self._vehicles = tuple(vehicles)
        self._options = tuple(options)
        self._map = survey_map
        self._frame = survey_map.frame()
        self._layers = Layers(vehicles, [own.own_altitude_m for own in options], busy_s=first.search_time_s)
        # vehicles that are not embedded boot at different times: the first one's clock is the team's
        now_us = self._vehicles[0].clock.time_us
        self._offsets_us = [now_us - vehicle.clock.stamp_us for vehicle in self._vehicles]

    @property
    def map_error(self) -> MapError:
        """Error of the published map that the team uses."""
        return stated_map_error(self._options[0], self._map)

    @property
    def stopped(self) -> str:
        """Which vehicle's magnetometer has stopped; "": none."""
        return next(filter(None, (vehicle.sensors.stopped for vehicle in self._vehicles)), "")

    @property
    def over(self) -> bool:
        """Whether the target is found, the search time is over, or a magnetometer has stopped."""
        if self.search.found is not None or self.stopped:
            return True
        limit_us = self.began_us + round(self._options[0].search_time_s * 1e6)
        return self.began_us >= 0 and self._vehicles[0].clock.time_us >= limit_us

    async def fly(self) -> None:
        """Fly all vehicles."""
        await run_concurrently([self._fly_one(index) for index in range(len(self._vehicles))])

    async def _fly_one(self, index: int) -> None:
        vehicle, own = self._vehicles[index], self._options[index]
        notes, clock = vehicle.notes, vehicle.clock
        notes.begin("checks", clock.stamp_us)
        await self._check(vehicle, own)
        await self._layers.take_off(index)
        notes.begin(SEARCH, clock.stamp_us)
        if not self.over:
            speed_m_s = own.speed_m_s or 0.0
            async with steering(
                vehicle, altitude_m=own.own_altitude_m, speed_m_s=speed_m_s, rate_hz=own.rate_hz
            ) as flight:
                await self._search(index, flight)
        vehicle.sensors.release()
        self.search.leave(index)
        await self._layers.land(index)

    async def _check(self, vehicle: Vehicle, own: OccupancyOptions) -> None:
        """Check what needs a received vehicle, while the vehicle still stands on the ground."""
        limits = await vehicle.limits(own.own_altitude_m)
        check_vehicle(own, limits)
        check_reach(own, limits, self._frame, vehicle.home)
        await require_quiet(vehicle, threshold_nt=own.identification.threshold_nt)
        if vehicle.kind is VehicleKind.FIXED_WING:
            await vehicle.wing.prepare_piloting()

    async def _search(self, index: int, flight: Steering) -> None:
        """Fly from cell to cell until the search is over."""
        vehicle, searcher = self._vehicles[index], self.searchers[index]
        clock = vehicle.clock
        if self.began_us < 0:
            self.began_us = self._vehicles[0].clock.time_us
            self.search.begin(self.began_us)
        searcher.began_us = clock.time_us
        watch = searcher.watch = self._watch(index)
        watch.start()
        try:
            with vehicle.link.messages(dialect.MAVLink_global_position_int_message) as stream:
                while True:
                    await vehicle.link.next_frame(
                        stream, what="position during the search", timeout_s=_POSITION_S
                    )
                    if self.over:
                        self.search.finish(self._vehicles[0].clock.time_us)
                        break
                    vehicle.link.require_armed("during the search")
                    command = searcher.pilot.update(self._motion(vehicle))
                    if command is not None:
                        await flight.turn_to(command.heading_rad)
                    self._note_progress(vehicle)
        finally:
            watch.stop()
            searcher.ended_us = clock.time_us

    def _note_progress(self, vehicle: Vehicle) -> None:
        elapsed_s = (self._vehicles[0].clock.time_us - self.began_us) * 1e-6
        vehicle.notes.progress = min(1.0, max(0.0, elapsed_s / self._options[0].search_time_s))

    def _watch(self, index: int) -> FieldWatch:
        searcher, offset_us = self.searchers[index], self._offsets_us[index]

        def on_sample(reading: PlacedReading, map_nt: float, anomalous: bool) -> None:
            time_us = reading.time_us + offset_us
            searcher.track.append((time_us, reading.north_m, reading.east_m))
            if self.search.investigation is not None:
                self.search.report_reading(index, replace(reading, time_us=time_us), map_nt)
                return
            self.search.report_place(index, time_us, reading.north_m, reading.east_m, anomalous=anomalous)

        def on_anomaly(seen: Anomaly) -> None:
            anomaly = replace(seen, time_us=seen.time_us + offset_us)
            searcher.anomalies.append(anomaly)
            if self.search.investigation is not None:
                return  # its own filters report passes
            last_us = searcher.track[-1][0]
            self.search.report_anomaly(index, anomaly, last_us)

        return FieldWatch(
            self._vehicles[index],
            self._map,
            AnomalyDetector(
                threshold_nt=self._options[index].identification.threshold_nt,
                noise_nt=self._options[index].identification.noise_nt,
                map_error=self.map_error,
            ),
            on_sample=on_sample,
            on_anomaly=on_anomaly,
        )

    def _motion(self, vehicle: Vehicle) -> Motion:
        place, attitude = vehicle.latest(Position), vehicle.latest(Attitude)
        if place is None or attitude is None:
            raise MissionError(f"the vehicle reports no position or attitude; {vehicle.link.last_received()}")
        wings = vehicle.kind is VehicleKind.FIXED_WING
        wind = vehicle.wing.wind_ne_m_s() if wings else None
        pilot = vehicle.wing.pilot if wings else None
        airspeed_m_s = math.nan if pilot is None else pilot.airspeed_true_m_s
        north_m, east_m, _ = self._frame.ned_from_geodetic(place.lat_deg, place.lon_deg, place.alt_m)
        return Motion(
            time_us=place.time_us,
            north_m=north_m,
            east_m=east_m,
            vel_ne_m_s=place.vel_ned_m_s[:2],
            yaw_rad=attitude.yaw_rad,
            airspeed_m_s=airspeed_m_s if math.isfinite(airspeed_m_s) else 0.0,
            wind_ne_m_s=(0.0, 0.0) if wind is None else wind,
        )


def investigation_of(options: Sequence[OccupancyOptions], survey_map: SurveyMap) -> Investigation | None:
    """The identification of a team; None when anomalies count by threshold."""
    first = options[0]
    if first.identify is Identify.THRESHOLD:
        return None
    map_error = stated_map_error(first, survey_map)
    return Investigation(
        first.identify,
        Identifier(
            first.identification, map_error=map_error, field_ned=field_direction(survey_map.home, _FIELD_YEAR)
        ),
        searchers=len(options),
        layout=layout_of(first),
        noise_nt=first.identification.noise_nt,
        map_error=map_error,
        target_prior=first.identification.target_prior,
    )


def start_place(options: OccupancyOptions) -> tuple[float, float]:
    """Start of a vehicle's search; those of a team are on an ellipse around the area's centre."""
    north_m, east_m = options.area_ne_m
    angle_rad = math.tau * options.index / options.vehicles
    return (
        north_m + _RING * options.height_m * math.cos(angle_rad),
        east_m + _RING * options.width_m * math.sin(angle_rad),
    )
