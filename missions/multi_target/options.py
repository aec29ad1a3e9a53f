"""Options of a search for an unknown number of targets."""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from estimators.multi_target.parameters import MultiTargetParameters
from flightsim.foundation.options import Shown, held, option, other_default
from missions.errors import PlanError
from missions.search.area import EDGES
from missions.search.options import StepSearchOptions
from missions.search.planner_parameters import Exploration, PlannerParameters

LARGEST_SIDE_M: Final = 20_000.0


class PlannerKind(StrEnum):
    """How the next place is chosen."""

    EXPLORING = "exploring"
    """Information and exploration together (the paper's planner)."""
    INFORMATION = "information"
    """Information alone."""
    SWEEP = "sweep"
    """Along the legs of a parallel sweep, whatever is detected."""
    REVISIT = "revisit"
    """Along the same legs, with detours to targets that are detected and not found."""
    ERGODIC = "ergodic"
    """By ergodic coverage of the targets that are expected and not found."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiTargetOptions(StepSearchOptions):
    """One vehicle's part in a search. Places are metres north and east of the first vehicle's home.

    Attributes:
        planning: parameters of the exploring planner.
        turn_limit_rad: largest change of direction in a step; None: any for a multicopter, 90 degrees for an
            aircraft.
        estimator: parameters of the estimator that the mission runs; the area that is searched is theirs.
    """

    altitude_m: float = other_default(20.0, above=0.0, varies="aircraft: 60")
    start_ne_m: tuple[float, float] = option(
        (10.0, 10.0),
        metavar="NORTH,EAST",
        help="Place of the first scan, m; other vehicles begin east of it.",
    )
    planner: PlannerKind = option(
        PlannerKind.EXPLORING,
        help="Planner: information and exploration, information alone, a sweep, a sweep with detours, "
        "or ergodic coverage.",
    )
    step_m: float | None = other_default(None, varies="9; aircraft: 2.5 turn radii")
    planning: PlannerParameters = held(
        PlannerParameters(alpha=0.3, exploration=Exploration.VIEW, horizon=3),
        alpha="alpha",
        exploration="exploration",
        horizon="horizon",
        beam="beam",
    )
    spacing_m: float | None = other_default(None, varies="one pass in all steps")
    steps: int = other_default(240)
    undetected: float | None = option(
        None, above=0.0, varies="never", help="Number of targets expected to be left with which it ends."
    )
    speed_m_s: float | None = other_default(None, varies="4; aircraft: its own")
    acceptance_m: float | None = other_default(None, varies="2; aircraft: 0.4 steps")
    sensor_limit_s: float = other_default(120.0)
    estimator: MultiTargetParameters = held(
        MultiTargetParameters(),
        area=EDGES,
        belief="belief",
        expected_targets="expected_targets",
        motion="motion",
        gain="gain",
        field_of_view=Shown(
            fields=("forward_scale_m", "right_scale_m"),
            together=True,
            metavar="FORWARD[,RIGHT]",
            separators="x,",
            lone="same",
            help="Scales of the sensor's fall ahead of and beside the vehicle, m.",
        ),
        range_sigma="range_sigma_m",
        bearing_sigma="bearing_sigma_rad",
        clutter="clutter_per_scan",
        found_width="found_width_m",
        found_mass="found_mass",
        found_distance="found_distance_m",
        search_seed="seed",
    )

    def check_together(self) -> None:
        self.area.check_sides(LARGEST_SIDE_M)
        if not self.area.contains(*self.start_ne_m):
            raise PlanError(
                f"`start_ne_m` {self.start_ne_m[0]:g},{self.start_ne_m[1]:g} is not in the area; choose a "
                "place inside `area_m`"
            )

    @property
    def edges(self) -> MultiTargetParameters:
        return self.estimator

    @property
    def own_start_ne_m(self) -> tuple[float, float]:
        """Place of this vehicle's first scan."""
        return self.area.nearest(self.start_ne_m[0], self.start_ne_m[1] + self.index * self.step_length_m)

    @property
    def planner_parameters(self) -> PlannerParameters:
        """Parameters of the planner for this vehicle's steps; by information alone, alpha is 0."""
        # zero-argument super() does not reach the base of a dataclass with slots
        parameters = super(MultiTargetOptions, self).planner_parameters
        return replace(parameters, alpha=0.0) if self.planner is PlannerKind.INFORMATION else parameters
