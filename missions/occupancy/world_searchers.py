"""A team's search without flights: the world, the map and the search are those of `fly occupancy`, and every
searcher is a point that turns at one rate in the wind.

The errors that remain are those of an aircraft's magnetometer and position, as in `magnetic_encounters`.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from estimators.occupancy.detection import AnomalyDetector
from estimators.occupancy.placed_readings import PlacedReading
from estimators.occupancy.survey_map import SurveyMap
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import MagneticField, MagneticSpec, magnetic_field_of
from flightsim.world_spec import WorldSpec
from missions.embedded.magnetic_encounters import as_published
from missions.occupancy.checks import layout_of, stated_map_error
from missions.occupancy.magnetic_target import MagneticTarget
from missions.occupancy.options import OccupancyOptions
from missions.occupancy.pilot import Motion, Pilot
from missions.occupancy.search import Search
from missions.occupancy.team import investigation_of, start_place
from missions.occupancy.world import drawn_target, occupancy_world

__all__ = ["PointSearch", "search_with_points"]

_STEP_S: Final = 0.1
_AIRSPEED_M_S: Final = 25.0
_TURN_RAD_S: Final = math.tan(math.radians(35.0)) * 9.81 / _AIRSPEED_M_S
_WIND_NE_M_S: Final = (0.0, 5.0)
_HEADING_PENALTY: Final = 0.2
_NOISE_NT: Final = 0.3
_DRIFT_NT: Final = 0.2
_POSITION_M: Final = 0.8
_APART_M: Final = 30.0  # between the searchers at their begin, beside home
_YEAR: Final = 2026.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PointSearch:
    """A finished search.

    Attributes:
        search: the team's.
        target_ne_m: true place of the target; None: there is none.
        time_s: time at which something was named, or the search time.
    """

    search: Search
    target_ne_m: tuple[float, float] | None
    time_s: float

    @property
    def error_m(self) -> float:
        """Distance of what was named from the target; NaN: nothing was named; infinite: there is none."""
        found = self.search.found
        if found is None:
            return math.nan
        return math.inf if self.target_ne_m is None else math.dist(found.place_ne_m, self.target_ne_m)


class _Point:
    """One searcher.

    Args:
        search, index: the team's search and the searcher's number in it.
        options: of the searcher.
        field: true field.
        survey_map: published map.
        rng: of its magnetometer and position.
    """

    def __init__(
        self,
        search: Search,
        index: int,
        options: OccupancyOptions,
        field: MagneticField,
        survey_map: SurveyMap,
        rng: np.random.Generator,
    ) -> None:
        self._search, self._index, self._field, self._map, self._rng = search, index, field, survey_map, rng
        self._height_m = options.own_altitude_m
        self._pilot = Pilot(search, index, start_ne_m=start_place(options))
        self._detector = AnomalyDetector(
            threshold_nt=options.identification.threshold_nt,
            noise_nt=options.identification.noise_nt,
            map_error=stated_map_error(options, survey_map),
        )
        self._north_m, self._east_m = 0.0, _APART_M * index
        self._heading_rad = self._wanted_rad = 0.0
        self._drift_nt = _DRIFT_NT * rng.standard_normal()
        self._off_m = _POSITION_M * rng.standard_normal(2)

    def step(self, time_us: int) -> None:
        """Fly a step, measure, and take the next heading."""
        most = _TURN_RAD_S * _STEP_S
        turn_rad = math.remainder(self._wanted_rad - self._heading_rad, math.tau)
        self._heading_rad += max(-most, min(most, turn_rad))
        velocity = (
            _AIRSPEED_M_S * math.cos(self._heading_rad) + _WIND_NE_M_S[0],
            _AIRSPEED_M_S * math.sin(self._heading_rad) + _WIND_NE_M_S[1],
        )
        self._north_m += velocity[0] * _STEP_S
        self._east_m += velocity[1] * _STEP_S
        north_m, east_m = self._north_m + float(self._off_m[0]), self._east_m + float(self._off_m[1])
        self._measure(time_us, north_m, east_m)
        command = self._pilot.update(
            Motion(
                time_us=time_us,
                north_m=north_m,
                east_m=east_m,
                vel_ne_m_s=velocity,
                yaw_rad=self._heading_rad,
                airspeed_m_s=_AIRSPEED_M_S,
                wind_ne_m_s=_WIND_NE_M_S,
            )
        )
        if command is not None:
            self._wanted_rad = command.heading_rad

    def _measure(self, time_us: int, north_m: float, east_m: float) -> None:
        """Report a reading, as the watch of a vehicle's magnetometer does."""
        total_nt = self._field.total_nt(self._north_m, self._east_m, self._height_m)
        total_nt += self._drift_nt + _NOISE_NT * self._rng.standard_normal()
        map_nt = self._map.total_nt(north_m, east_m, self._height_m)
        if self._search.investigation is not None:
            reading = PlacedReading(
                time_us=time_us, north_m=north_m, east_m=east_m, height_m=self._height_m, total_nt=total_nt
            )
            self._search.report_reading(self._index, reading, map_nt)
            return
        anomaly = self._detector.update(time_us, total_nt, map_nt, north_m, east_m)
        self._search.report_place(self._index, time_us, north_m, east_m, anomalous=self._detector.anomalous)
        if anomaly is not None:
            self._search.report_anomaly(self._index, anomaly, time_us)


def search_with_points(
    options: OccupancyOptions, seed: int, *, false_count: int, absent: bool = False
) -> PointSearch:
    """Search until something is named, or until the search time is over.

    Args:
        options: of the team.
        seed: of the world, which is that of `fly occupancy` with this seed, and of the noise.
        false_count: number of false anomalies.
        absent: whether there is no target.

    Raises:
        PlanError: impossible options.
    """
    streams = RandomStreams(seed)
    team = [
        replace(options, index=k, heading_penalty=_HEADING_PENALTY, speed_m_s=_AIRSPEED_M_S)
        for k in range(options.vehicles)
    ]
    spec = occupancy_world(
        WorldSpec.of_team(options.vehicles, seed=seed),
        options,
        MagneticTarget(absent=absent, false_count=false_count),
    ).magnetic_field
    assert isinstance(spec, MagneticSpec)
    field, published = magnetic_field_of(spec, home=Home(), seed=seed, decimal_year=_YEAR)
    survey_map = as_published(published)
    search = Search(
        layout_of(options),
        options.search,
        [own.decision_parameters for own in team],
        noise_nt=options.identification.noise_nt,
        investigation=investigation_of(team, survey_map),
    )
    points = [
        _Point(search, k, own, field, survey_map, streams.generator("searcher", k))
        for k, own in enumerate(team)
    ]
    search.begin(0)
    steps = round(options.search_time_s / _STEP_S)
    for k in range(1, steps + 1):
        for point in points:
            point.step(round(1e6 * _STEP_S * k))
        if search.found is not None:
            break
    search.finish(round(1e6 * options.search_time_s))
    target_ne_m = None if absent else drawn_target(options, seed)[0]
    time_s = options.search_time_s if search.found is None else search.found_us * 1e-6
    return PointSearch(search=search, target_ne_m=target_ne_m, time_s=time_s)
