"""Options of a search for one tagged target by cameras."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from estimators.vision_search.parameters import BeliefKind, VisionSearchParameters
from missions.base.options import MAX_SEARCH_TIME_S, MissionOptions, check_positive
from missions.errors import PlanError
from missions.patterns.lissajous import NAMED_PATTERNS
from missions.search.area import Area
from missions.search.options import StepLawKind, check_steps
from missions.search.planner_parameters import PlannerParameters
from missions.vehicle.limits import FixedWingLimits, Limits

MAX_STEPS: Final = 20_000
LARGEST_SIDE_M: Final = 20_000.0
_WINGS_ALTITUDE_M: Final = 90.0
_WINGS_SEPARATION_M: Final = 10.0
_ERRORS: Final = (
    *("place_sigma_m", "height_sigma_m", "yaw_sigma_rad", "tilt_sigma_rad", "mount_sigma_rad"),
    *("place_time_s", "attitude_time_s", "target_walk_m_sqrt_s"),
)
_TURNS: Final = 2.5  # step of an aircraft, in turn radii


class SearchPlannerKind(StrEnum):
    """How the target is searched for."""

    SWEEP = "sweep"
    """Along the legs of a parallel sweep, each vehicle in its own strip."""
    LISSAJOUS = "lissajous"
    """Along a Lissajous curve, the vehicles spread over it."""
    HORIZON = "horizon"
    """Where the next steps are expected to detect the target with the highest probability; with a horizon of
    1 the greedy search.
    """


class LocalizeKind(StrEnum):
    """How the target is localized when the belief has narrowed down."""

    PASSES = "passes"
    """Straight over it, each time in another direction."""
    ORBIT = "orbit"
    """Around it, with the target in view."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VisionSearchOptions(MissionOptions):
    """One vehicle's part in a search. Places are metres north and east of the first vehicle's home.

    Attributes:
        area_m: edges of the searched area: south, west, north, east; the target is in it.
        planner: how the target is searched for.
        curve: the Lissajous curve, L1 to L4.
        spacing_m: of the sweep's legs; None: 0.8 of the ground that a camera sees across the flight.
        view_rad: angle across the picture that `spacing_m` and the planner expect.
        step_m: distance between the places that are planned; None: 20 m, and 2.5 turn radii for an aircraft.
        horizon, beam: of the planner, as in `PlannerParameters`.
        turn_limit_rad: largest change of direction in a step; None: any for a multicopter, 90 degrees for an
            aircraft.
        localize: passes or orbit.
        localize_sigma_m: the target is localized when the longest standard deviation of the belief is below
            this.
        passes: the search ends after this number of passes, or turns of the orbit by 60 degrees, of all
            vehicles together.
        steps: the search ends after this number of steps of a vehicle.
        search_time_s: the search ends after this time.
        speed_m_s: largest ground speed of a multicopter, airspeed of an aircraft; None: 8 m/s, and the
            aircraft's own.
        law: how a multicopter flies a step.
        acceptance_m: a place counts as reached within this distance; None: 0.4 steps.
        sensor_limit_s: the search ends when no frame was received for this time.
        tag_id, tag_size_m: number of the tag, and its side.
        belief, cell_m, particles: of the estimator; cells of None: 1/400 of the longer side, at least 0.5 m.
        target_walk_m_sqrt_s: standard deviation per axis of the target's walk in a second.
        place_sigma_m, height_sigma_m, yaw_sigma_rad, tilt_sigma_rad, mount_sigma_rad: errors of a vehicle's
            pose and of its camera's mount.
        place_time_s, attitude_time_s: their correlation times.
        link_loss: share of the likelihoods that are lost between the vehicles.
        link_delay_s: their mean delay; each message has its own, exponentially distributed.
        link_repeats: how often each is sent, one second apart.
        search_seed: of the random numbers of filter, planner and link.
    """

    altitude_m: float = 60.0
    separation_m: float = 6.0
    area_m: tuple[float, float, float, float] = (-150.0, -150.0, 150.0, 150.0)
    planner: SearchPlannerKind = SearchPlannerKind.SWEEP
    curve: str = "L4"
    spacing_m: float | None = None
    view_rad: float = math.radians(70.0)
    step_m: float | None = None
    horizon: int = 4
    beam: int = 6
    turn_limit_rad: float | None = None
    localize: LocalizeKind = LocalizeKind.PASSES
    localize_sigma_m: float = 15.0
    passes: int = 6
    steps: int = 2000
    search_time_s: float | None = 1800.0
    speed_m_s: float | None = None
    law: StepLawKind = StepLawKind.TRAJECTORY
    acceptance_m: float | None = None
    sensor_limit_s: float = 60.0
    tag_id: int = 0
    tag_size_m: float = 2.0
    belief: BeliefKind = BeliefKind.GRID
    cell_m: float | None = None
    particles: int = 6400
    target_walk_m_sqrt_s: float = 0.0
    place_sigma_m: float = 0.15
    height_sigma_m: float = 0.4
    yaw_sigma_rad: float = math.radians(0.6)
    tilt_sigma_rad: float = math.radians(0.23)
    mount_sigma_rad: float = math.radians(0.29)
    place_time_s: float = 60.0
    attitude_time_s: float = 60.0
    link_loss: float = 0.0
    link_delay_s: float = 0.0
    link_repeats: int = 1
    search_seed: int = 0

    def __post_init__(self) -> None:
        super(VisionSearchOptions, self).__post_init__()
        check_positive(
            altitude_m=self.altitude_m,
            step_m=self.step_m,
            spacing_m=self.spacing_m,
            search_time_s=self.search_time_s,
            speed_m_s=self.speed_m_s,
            acceptance_m=self.acceptance_m,
            sensor_limit_s=self.sensor_limit_s,
            tag_size_m=self.tag_size_m,
            cell_m=self.cell_m,
            localize_sigma_m=self.localize_sigma_m,
        )
        for name, least, most in (
            *(("steps", 1, MAX_STEPS), ("passes", 1, 1000), ("link_repeats", 1, 10)),
            *(("tag_id", 0, 254), ("particles", 10, 10_000_000)),
        ):
            if not least <= getattr(self, name) <= most:
                raise PlanError(f"`{name}` {getattr(self, name)} is not in {least}..{most}")
        if self.search_time_s is not None and not self.search_time_s <= MAX_SEARCH_TIME_S:
            raise PlanError(
                f"`search_time_s` {self.search_time_s:g} s is more than {MAX_SEARCH_TIME_S:g} s, a whole day"
            )
        area = self.area
        for side_m in (area.height_m, area.width_m):
            if not side_m <= LARGEST_SIDE_M:
                raise PlanError(f"`area_m` has a side of {side_m:g} m; accepted: up to {LARGEST_SIDE_M:g} m")
        if not 0.0 <= self.link_loss <= 1.0:
            raise PlanError(f"`link_loss` {self.link_loss:g} is not in 0..1")
        if not 0.0 <= self.link_delay_s <= 60.0:
            raise PlanError(f"`link_delay_s` {self.link_delay_s:g} s is not in 0..60 s")
        if not 0.1 <= self.view_rad <= 2.9:
            raise PlanError(f"`view_rad` {math.degrees(self.view_rad):g} degrees is not in 6..166 degrees")
        if self.curve.upper() not in NAMED_PATTERNS:
            raise PlanError(f"`curve` {self.curve!r} is not known; there are {', '.join(NAMED_PATTERNS)}")
        for name in _ERRORS:
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise PlanError(f"`{name}` {value:g} is not possible; ask for 0 or more")
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
    def step_length_m(self) -> float:
        """Distance between the places that are planned."""
        return 20.0 if self.step_m is None else self.step_m

    @property
    def seen_across_m(self) -> float:
        """Width of the ground across the flight that the lowest vehicle's camera sees: the longer side of the
        picture is across the body.
        """
        return 2.0 * self.altitude_m * math.tan(0.5 * self.view_rad)

    @property
    def own_spacing_m(self) -> float:
        """Distance of the sweep's legs."""
        return 0.8 * self.seen_across_m if self.spacing_m is None else self.spacing_m

    @property
    def planner_parameters(self) -> PlannerParameters:
        """Parameters of the planner with a horizon."""
        return PlannerParameters(
            step_m=self.step_length_m,
            alpha=0.0,
            horizon=self.horizon,
            beam=self.beam,
            turn_limit_rad=math.pi if self.turn_limit_rad is None else self.turn_limit_rad,
        )

    @property
    def estimator_parameters(self) -> VisionSearchParameters:
        """Parameters of the estimators that the mission runs, but for the vehicle on board of which each
        is.
        """
        area = self.area
        south_m, west_m, north_m, east_m = self.area_m
        cell_m = self.cell_m or max(0.5, max(area.height_m, area.width_m) / 400.0)
        return VisionSearchParameters(
            south_m=south_m,
            west_m=west_m,
            north_m=north_m,
            east_m=east_m,
            tag_id=self.tag_id,
            belief=self.belief,
            cell_m=cell_m,
            particles=self.particles,
            walk_m_sqrt_s=self.target_walk_m_sqrt_s,
            target_size_m=self.tag_size_m,
            forward_sigma_m=self.place_sigma_m,
            right_sigma_m=self.place_sigma_m,
            height_sigma_m=self.height_sigma_m,
            yaw_sigma_rad=self.yaw_sigma_rad,
            pitch_sigma_rad=self.tilt_sigma_rad,
            roll_sigma_rad=self.tilt_sigma_rad,
            mount_sigma_rad=self.mount_sigma_rad,
            place_time_s=self.place_time_s,
            attitude_time_s=self.attitude_time_s,
            seed=self.search_seed,
        )

    def for_vehicle(self, limits: Limits) -> "VisionSearchOptions":
        """The same options; those that were not specified get values that suit the vehicle."""
        if not isinstance(limits, FixedWingLimits):
            return self.unless_none(
                step_m=20.0, speed_m_s=8.0, acceptance_m=0.4 * self.step_length_m, turn_limit_rad=math.pi
            )
        speed_m_s = limits.airspeed_trim_m_s if self.speed_m_s is None else self.speed_m_s
        step_m = self.step_m or _TURNS * limits.turn_radius_m(speed_m_s)
        own = self.unless_none(
            step_m=step_m, speed_m_s=speed_m_s, acceptance_m=0.4 * step_m, turn_limit_rad=0.5 * math.pi
        )
        return own.unless_chosen(altitude_m=_WINGS_ALTITUDE_M, separation_m=_WINGS_SEPARATION_M)


def check_vehicle(options: VisionSearchOptions, limits: Limits) -> None:
    """Refuse what one vehicle of the team can't fly.

    Args:
        options: options adapted to the vehicle.
        limits: limits of the vehicle.

    Raises:
        PlanError: names the option to change.
    """
    check_steps(options, limits)
    if isinstance(limits, FixedWingLimits) and options.localize is LocalizeKind.ORBIT:
        raise PlanError(
            "an aircraft with a fixed camera does not see the middle of its turn; ask for `localize` passes"
        )
