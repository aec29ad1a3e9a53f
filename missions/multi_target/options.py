"""Options of a search for an unknown number of targets."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from estimators.multi_target.parameters import Belief, MultiTargetParameters
from estimators.tracking.motion import MotionKind
from missions.base.options import MAX_SEARCH_TIME_S, MissionOptions, check_positive
from missions.errors import PlanError
from missions.search.area import Area
from missions.search.options import StepLawKind, check_steps
from missions.search.planner_parameters import Exploration, PlannerParameters
from missions.vehicle.limits import FixedWingLimits, Limits

MAX_STEPS: Final = 10_000
LARGEST_SIDE_M: Final = 20_000.0
_TURNS: Final = 2.5  # step of an aircraft, in turn radii


class PlannerKind(StrEnum):
    """How the next place is chosen."""

    EXPLORING = "exploring"
    """Information and exploration together (the paper's planner)."""
    INFORMATION = "information"
    """Information alone."""
    SWEEP = "sweep"
    """Along the legs of a parallel sweep, whatever is detected."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiTargetOptions(MissionOptions):
    """One vehicle's part in a search. Places are metres north and east of the first vehicle's home.

    Attributes:
        area_m: edges of the searched area: south, west, north, east (paper: -30..270 m).
        start_ne_m: place of the first scan (paper: 10, 10); each further vehicle of a team starts a step
            farther east.
        planner: how the next place is chosen.
        step_m, alpha, exploration, horizon, beam: of the exploring planner, as in `PlannerParameters`; a step
            of None: 9 m for a multicopter, 2.5 turn radii for an aircraft.
        turn_limit_rad: largest change of direction in a step; None: any for a multicopter, 90 degrees for an
            aircraft.
        spacing_m: track spacing of the sweep; None: so that the steps are just enough for one pass.
        steps: the search ends after this number of steps of a vehicle (paper: 240).
        search_time_s: the search ends after this time; None: no limit.
        undetected: the search ends when the expected number of targets that were never detected, and of those
            that are detected and not found yet, is below this; None: never.
        speed_m_s: largest ground speed of a multicopter, airspeed of an aircraft; None: 4 m/s, and the
            aircraft's own.
        law: how a multicopter flies a step.
        acceptance_m: a place counts as reached within this distance; None: 2 m, and 0.4 steps for an
            aircraft.
        belief: how the intensity of targets is represented.
        expected_targets: number of targets in the area that is expected before the search.
        motion: how targets move.
        gain, field_of_view_m: of the sensor: probability to detect a target below, and the scales of its fall
            forward and right (the paper's G, F_X, F_Y).
        range_sigma_m, bearing_sigma_rad: noise of the sensor.
        place_sigma_m, heading_sigma_rad: errors of the vehicle's own place and heading.
        clutter_per_scan: mean number of false detections.
        found_width_m, found_mass, found_distance_m: T_W, T_m and T_z of the paper.
        sensor_limit_s: the search ends when no scan was received for this time.
        search_seed: of the random numbers of filter and planner.
    """

    altitude_m: float = 20.0
    separation_m: float = 4.0
    area_m: tuple[float, float, float, float] = (-30.0, -30.0, 270.0, 270.0)
    start_ne_m: tuple[float, float] = (10.0, 10.0)
    planner: PlannerKind = PlannerKind.EXPLORING
    step_m: float | None = None
    alpha: float = 0.3
    exploration: Exploration = Exploration.VIEW
    horizon: int = 3
    beam: int = 6
    turn_limit_rad: float | None = None
    spacing_m: float | None = None
    steps: int = 240
    search_time_s: float | None = None
    undetected: float | None = None
    speed_m_s: float | None = None
    law: StepLawKind = StepLawKind.TRAJECTORY
    acceptance_m: float | None = None
    belief: Belief = Belief.PARTICLES
    expected_targets: float = 18.0
    motion: MotionKind = MotionKind.STATIC
    gain: float = 0.98
    field_of_view_m: tuple[float, float] = (15.0, 15.0)
    range_sigma_m: float = 0.5
    bearing_sigma_rad: float = math.radians(1.7)
    place_sigma_m: float = 0.3
    heading_sigma_rad: float = 0.02
    clutter_per_scan: float = 0.0
    found_width_m: float = 0.5
    found_mass: float = 0.9
    found_distance_m: float = 4.0
    sensor_limit_s: float = 120.0
    search_seed: int = 0

    def __post_init__(self) -> None:
        super(MultiTargetOptions, self).__post_init__()
        check_positive(
            altitude_m=self.altitude_m,
            step_m=self.step_m,
            spacing_m=self.spacing_m,
            search_time_s=self.search_time_s,
            undetected=self.undetected,
            speed_m_s=self.speed_m_s,
            acceptance_m=self.acceptance_m,
            expected_targets=self.expected_targets,
            sensor_limit_s=self.sensor_limit_s,
        )
        if not 1 <= self.steps <= MAX_STEPS:
            raise PlanError(f"`steps` {self.steps} is not in 1..{MAX_STEPS}")
        if self.search_time_s is not None and not self.search_time_s <= MAX_SEARCH_TIME_S:
            raise PlanError(
                f"`search_time_s` {self.search_time_s:g} s is more than {MAX_SEARCH_TIME_S:g} s, a whole day"
            )
        area = self.area
        for side_m in (area.height_m, area.width_m):
            if not side_m <= LARGEST_SIDE_M:
                raise PlanError(f"`area_m` has a side of {side_m:g} m; accepted: up to {LARGEST_SIDE_M:g} m")
        if not area.contains(*self.start_ne_m):
            raise PlanError(
                f"`start_ne_m` {self.start_ne_m[0]:g},{self.start_ne_m[1]:g} is not in the area; choose a "
                "place inside `area_m`"
            )
        for name in ("place_sigma_m", "heading_sigma_rad"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise PlanError(f"`{name}` {getattr(self, name):g} is not possible; ask for 0 or more")
        try:  # these constructors refuse impossible values
            _ = self.estimator_parameters, self.planner_parameters
        except ValueError as error:
            raise PlanError(f"the search can't be made: {error}") from None

    @property
    def area(self) -> Area:
        """The searched area."""
        south_m, west_m, north_m, east_m = self.area_m
        return Area(south_m=south_m, west_m=west_m, north_m=north_m, east_m=east_m)

    @property
    def own_start_ne_m(self) -> tuple[float, float]:
        """Place of this vehicle's first scan."""
        area, step_m = self.area, self.planner_parameters.step_m
        return area.nearest(self.start_ne_m[0], self.start_ne_m[1] + self.index * step_m)

    @property
    def planner_parameters(self) -> PlannerParameters:
        """Parameters of the exploring planner; of the planner by information alone, alpha is 0."""
        return PlannerParameters(
            step_m=9.0 if self.step_m is None else self.step_m,
            alpha=0.0 if self.planner is PlannerKind.INFORMATION else self.alpha,
            exploration=self.exploration,
            horizon=self.horizon,
            beam=self.beam,
            turn_limit_rad=math.pi if self.turn_limit_rad is None else self.turn_limit_rad,
        )

    @property
    def step_length_m(self) -> float:
        """Distance to the next scan."""
        return self.planner_parameters.step_m

    @property
    def estimator_parameters(self) -> MultiTargetParameters:
        """Parameters of the estimator that the mission runs; the same as those of `estimator_settings`."""
        south_m, west_m, north_m, east_m = self.area_m
        return MultiTargetParameters(
            south_m=south_m,
            west_m=west_m,
            north_m=north_m,
            east_m=east_m,
            gain=self.gain,
            forward_scale_m=self.field_of_view_m[0],
            right_scale_m=self.field_of_view_m[1],
            range_sigma_m=self.range_sigma_m,
            bearing_sigma_rad=self.bearing_sigma_rad,
            place_sigma_m=self.place_sigma_m,
            heading_sigma_rad=self.heading_sigma_rad,
            clutter_per_scan=self.clutter_per_scan,
            belief=self.belief,
            expected_targets=self.expected_targets,
            motion=self.motion,
            found_width_m=self.found_width_m,
            found_mass=self.found_mass,
            found_distance_m=self.found_distance_m,
            seed=self.search_seed,
        )

    def for_vehicle(self, limits: Limits) -> "MultiTargetOptions":
        """The same options; those that were not specified get values that suit the vehicle."""
        if not isinstance(limits, FixedWingLimits):
            step_m = 9.0 if self.step_m is None else self.step_m
            return self.unless_none(step_m=step_m, speed_m_s=4.0, acceptance_m=min(2.0, 0.4 * step_m))
        speed_m_s = limits.airspeed_trim_m_s if self.speed_m_s is None else self.speed_m_s
        step_m = self.step_m or _TURNS * limits.turn_radius_m(speed_m_s)
        own = self.unless_none(
            step_m=step_m, speed_m_s=speed_m_s, acceptance_m=0.4 * step_m, turn_limit_rad=0.5 * math.pi
        )
        return own if self.chosen("altitude_m") else own.unless_chosen(altitude_m=60.0)


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
