"""Options of an occupancy-map search."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from estimators.errors import EstimatorError
from estimators.magnetic_identification.classes import GaussianClass
from estimators.magnetic_identification.parameters import FALSE_ANOMALIES, TARGETS, IdentificationParameters
from estimators.occupancy.detection import DetectionModel, MapError
from estimators.occupancy.survey_map import SurveyMap, load_survey_map, map_error_of
from estimators.tracking.grid import GridLayout
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.base.options import MAX_SEARCH_TIME_S, MissionOptions, check_positive
from missions.errors import PlanError
from missions.occupancy.decision import DecisionParameters
from missions.occupancy.search import SearchParameters
from missions.occupancy.suspect import Identify
from missions.vehicle.limits import FixedWingLimits, Limits

LARGEST_SIDE_M: Final = 50_000.0
LEAST_SIGMAS: Final = 3.0
"""Smallest ratio of threshold to noise; below it, noise alone exceeds the threshold."""

_PENALTY_OF_WINGS: Final = 0.2
_PENALTY_OF_MULTICOPTERS: Final = 0.05
_MULTICOPTER_M_S: Final = 10.0
_SHARE_OF_SPEED: Final = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class OccupancyOptions(MissionOptions):
    """One vehicle's part in a search with a shared occupancy map. Places are metres from the map's home.

    Attributes:
        width_m, height_m: size of the searched area, east and north.
        area_ne_m: centre of the searched area.
        cell_m: side of a cell.
        neighbourhood: number of cells in each direction that a decision considers.
        heading_penalty: alpha of equation 9; None: depends on the kind of vehicle, small for a multicopter.
        detection_probability: probability to detect a target in a pass directly over it.
        detection_range_m: standard deviation of the fall-off with distance.
        threshold_nt: threshold of the differential measurement; a larger value is an anomaly.
        noise_nt: standard deviation of the differential measurement where there is no target.
        map_error_nt: standard deviation of the published map; None: the value in the map file, or 1 nT when
            the file has none.
        confirmations: number of passes that must detect an anomaly at one place.
        raise_radius_m: scores are raised within this distance of an anomaly.
        search_time_s: the search is given up after this time.
        speed_m_s: airspeed of an aircraft, ground speed of a multicopter; None: the vehicle's default.
        identify: how an anomaly is found to be the target.
        targets, false_anomalies: classes of anomalies, for `identify` other than THRESHOLD
            (`IdentificationParameters`).
        particles: number of particles of each class.
        map_file: published magnetic map; None: the map that the
            embedded world publishes.
    """

    altitude_m: float = 80.0
    separation_m: float = 15.0
    width_m: float = 2400.0
    height_m: float = 2400.0
    area_ne_m: tuple[float, float] = (0.0, 0.0)
    cell_m: float = 200.0
    neighbourhood: int = 1
    heading_penalty: float | None = None
    detection_probability: float = 0.95
    detection_range_m: float = 80.0
    threshold_nt: float = 3.0
    noise_nt: float = 0.5
    map_error_nt: float | None = None
    confirmations: int = 2
    raise_radius_m: float = 300.0
    search_time_s: float = 900.0
    speed_m_s: float | None = None
    identify: Identify = Identify.THRESHOLD
    targets: tuple[str, ...] = TARGETS
    false_anomalies: tuple[str, ...] = FALSE_ANOMALIES
    particles: int = 4000
    map_file: str | None = None

    def __post_init__(self) -> None:
        super(OccupancyOptions, self).__post_init__()
        check_positive(
            altitude_m=self.altitude_m,
            search_time_s=self.search_time_s,
            noise_nt=self.noise_nt,
            threshold_nt=self.threshold_nt,
            speed_m_s=self.speed_m_s,
        )
        for name, side_m in (("width_m", self.width_m), ("height_m", self.height_m)):
            if not 0.0 < side_m <= LARGEST_SIDE_M:
                raise PlanError(
                    f"`{name}` {side_m:g} m is not possible; ask for more than 0, up to {LARGEST_SIDE_M:g} m"
                )
        if not all(math.isfinite(value) for value in self.area_ne_m):
            raise PlanError(
                f"`area_ne_m` {self.area_ne_m[0]:g},{self.area_ne_m[1]:g} is not a place; give NORTH,EAST"
            )
        if not self.search_time_s <= MAX_SEARCH_TIME_S:
            raise PlanError(
                f"`search_time_s` {self.search_time_s:g} s is more than {MAX_SEARCH_TIME_S:g} s, a whole day"
            )
        if not self.threshold_nt >= LEAST_SIGMAS * self.noise_nt:
            raise PlanError(
                f"`threshold_nt` {self.threshold_nt:g} nT is below {LEAST_SIGMAS:g} standard deviations of "
                "the "
                f"noise, {LEAST_SIGMAS * self.noise_nt:g} nT: noise would make anomalies; raise "
                "`threshold_nt`, "
                "or give the `noise_nt` of a better magnetometer"
            )
        try:  # these constructors refuse impossible values
            _ = self.layout, self.search_parameters, self.decision_parameters
            if self.map_error_nt is not None:
                MapError(sigma_nt=self.map_error_nt)
        except EstimatorError as error:
            raise PlanError(str(error)) from None
        if self.identify is not Identify.THRESHOLD:
            try:
                classes = self.identification.classes
            except ValueError as error:
                raise PlanError(f"`identify={self.identify}`: {error}") from None
            sought = [of for of in classes if of.sought]
            if self.identify is Identify.TRACE and not any(isinstance(of, GaussianClass) for of in sought):
                raise PlanError(
                    f"`identify=trace`: no class that is sought ({', '.join(of.name for of in sought)}) is "
                    "Gaussian, and the paper's confidence is computed for a Gaussian only; ask for "
                    "`identify=bayes`"
                )

    @property
    def identification(self) -> IdentificationParameters:
        """Parameters of the identification."""
        return IdentificationParameters(
            targets=self.targets,
            false_anomalies=self.false_anomalies,
            particles=self.particles,
            threshold_nt=self.threshold_nt,
            noise_nt=self.noise_nt,
            map_error_nt=self.map_error_nt,
        )

    @property
    def layout(self) -> GridLayout:
        """The cells."""
        return GridLayout.over(
            width_m=self.width_m, height_m=self.height_m, cell_m=self.cell_m, centre_ne_m=self.area_ne_m
        )

    @property
    def search_parameters(self) -> SearchParameters:
        """Parameters of the team's search."""
        return SearchParameters(
            detection=DetectionModel(
                probability_overhead=self.detection_probability, range_m=self.detection_range_m
            ),
            raise_radius_m=self.raise_radius_m,
            confirmations=self.confirmations,
            noise_nt=self.noise_nt,
        )

    def map_error(self, survey_map: SurveyMap) -> MapError:
        """Error of a published map: specified by the user, else stated by the map, else that of a careful
        survey.
        """
        return map_error_of(survey_map, self.map_error_nt)

    @property
    def decision_parameters(self) -> DecisionParameters:
        """Parameters of this vehicle's decisions."""
        penalty = _PENALTY_OF_WINGS if self.heading_penalty is None else self.heading_penalty
        return DecisionParameters(neighbourhood=self.neighbourhood, heading_penalty=penalty)

    def for_vehicle(self, limits: Limits) -> "OccupancyOptions":
        """The same options; those that were not specified get the decision parameters and the speed of the
        kind of vehicle.
        """
        if isinstance(limits, FixedWingLimits):
            penalty, speed_m_s = _PENALTY_OF_WINGS, limits.airspeed_trim_m_s
        else:
            penalty = _PENALTY_OF_MULTICOPTERS
            speed_m_s = min(_MULTICOPTER_M_S, _SHARE_OF_SPEED * limits.speed_m_s)
        return replace(
            self,
            heading_penalty=penalty if self.heading_penalty is None else self.heading_penalty,
            speed_m_s=speed_m_s if self.speed_m_s is None else self.speed_m_s,
        )


def read_map(path: str) -> SurveyMap:
    """The published map in a file.

    Raises:
        PlanError: the file does not exist or is not a map, or the map has no data.
    """
    try:
        return load_survey_map(Path(path))
    except EstimatorError as error:
        raise PlanError(str(error)) from None


def check_map(options: OccupancyOptions, survey_map: SurveyMap) -> None:
    """Refuse a searched area that the map doesn't cover completely.

    Raises:
        PlanError: names the area that the map covers.
    """
    layout = options.layout
    try:
        survey_map.require_data(
            south_m=layout.south_m,
            north_m=layout.north_m,
            west_m=layout.west_m,
            east_m=layout.east_m,
            what=f"the searched area (`width_m, height_m` {options.width_m:g}x{options.height_m:g})",
        )
    except EstimatorError as error:
        raise PlanError(str(error)) from None


def check_vehicle(options: OccupancyOptions, limits: Limits) -> None:
    """Refuse what one vehicle of the team can't fly.

    Args:
        options: options adapted to the vehicle.
        limits: limits of the vehicle, with the wind to plan for.

    Raises:
        PlanError: names the option to change.
    """
    limits.check_separation(options.separation_m, options.vehicles)
    limits.check_altitude(options.own_altitude_m)
    north_m, east_m = options.area_ne_m
    reach_m = math.hypot(abs(north_m) + 0.5 * options.height_m, abs(east_m) + 0.5 * options.width_m)
    if not reach_m <= limits.reach_m:
        raise PlanError(
            f"the searched area reaches {reach_m:.0f} m from the map's home, more than {limits.reach_m:g} m; "
            "ask for a smaller `width_m, height_m`, or an `area_ne_m` nearer to it"
        )
    speed_m_s = options.speed_m_s
    if speed_m_s is None:
        raise PlanError("the options are not those of a vehicle yet: call for_vehicle")
    if not isinstance(limits, FixedWingLimits):
        limits.check_speed(speed_m_s)
        return
    limits.check_airspeed(speed_m_s)
    radius_m = limits.turn_radius_m(speed_m_s)
    if options.neighbourhood * options.cell_m < radius_m:
        larger_m = 10.0 * math.ceil(0.1 * radius_m / options.neighbourhood)
        raise PlanError(
            f"`cell_m` {options.cell_m:g} m is too small for an aircraft whose turns have a radius of "
            f"{radius_m:.0f} m at {speed_m_s:g} m/s in {limits.wind_m_s:.3g} m/s of wind: the cells "
            f"beside it are out of reach; ask for `cell_m` {larger_m:g} or more, a larger `neighbourhood`, "
            "or less `speed_m_s`"
        )


def check_reach(options: OccupancyOptions, limits: Limits, frame: LocalFrame, home: GeodeticPosition) -> None:
    """Refuse an area that is too far from the vehicle's home.

    Args:
        options: options of the vehicle.
        limits: limits of the vehicle.
        frame: local frame of the map.
        home: home of the vehicle.

    Raises:
        PlanError: names the distance and what to change.
    """
    north_m, east_m, _ = frame.ned_from_geodetic(home.lat_deg, home.lon_deg, home.alt_m)
    layout = options.layout
    farthest_m = max(
        math.hypot(edge_n_m - north_m, edge_e_m - east_m)
        for edge_n_m in (layout.south_m, layout.north_m)
        for edge_e_m in (layout.west_m, layout.east_m)
    )
    if not farthest_m <= limits.reach_m:
        raise PlanError(
            f"the searched area reaches {farthest_m:.0f} m from the vehicle's home, which is at north "
            f"{north_m:.0f} m, east {east_m:.0f} m of the map's home; accepted: up to {limits.reach_m:g} m. "
            "Choose `area_ne_m`, a smaller `width_m, height_m`, or the map of this place"
        )
