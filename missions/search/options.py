"""Options of searches by steps in an area."""

import math
from dataclasses import dataclass, replace
from enum import StrEnum

from flightsim.foundation.options import held, option
from missions.base.options import MAX_SEARCH_TIME_S, MissionOptions
from missions.search.area import Area, Edges
from missions.search.planner_parameters import PlannerParameters


class StepLawKind(StrEnum):
    """How a step is flown by a multicopter."""

    TRAJECTORY = "trajectory"
    """Along a reference within its limits."""
    BACKSTEPPING = "backstepping"


@dataclass(frozen=True, slots=True, kw_only=True)
class StepSearchOptions(MissionOptions):
    """One vehicle's part in a search by steps. Places are metres north and east of the first vehicle's home.
    The searched area is that of the estimator.

    Attributes:
        planning: parameters of the planner, but for what the vehicle's steps are.
        turn_limit_rad: largest change of direction in a step; None: any for a multicopter, 90 degrees for an
            aircraft.
    """

    spacing_m: float | None = option(None, above=0.0, help="Distance of the sweep's legs.")
    step_m: float | None = option(None, above=0.0, help="Distance between planned places.")
    planning: PlannerParameters = held(PlannerParameters())
    turn_limit_rad: float | None = None
    steps: int = option(2000, least=1, most=20_000, help="Steps of a vehicle after which the search ends.")
    search_time_s: float | None = option(
        None, above=0.0, most=MAX_SEARCH_TIME_S, varies="no limit", help="Time after which the search ends."
    )
    speed_m_s: float | None = option(
        None, above=0.0, help="Ground speed of a multicopter, airspeed of an aircraft."
    )
    law: StepLawKind = option(StepLawKind.TRAJECTORY, help="Law by which a multicopter flies a step.")
    acceptance_m: float | None = option(None, above=0.0, help="Distance within which a place is reached.")
    sensor_limit_s: float = option(
        60.0, above=0.0, help="Time without the sensor after which the search is given up."
    )

    @property
    def edges(self) -> Edges:
        """The parameters that have the edges of the area."""
        raise NotImplementedError

    @property
    def area(self) -> Area:
        """The searched area."""
        return Area.of(self.edges)

    @property
    def step_length_m(self) -> float:
        """Distance between planned places."""
        return self.planning.step_m if self.step_m is None else self.step_m

    @property
    def planner_parameters(self) -> PlannerParameters:
        """Parameters of the planner for this vehicle's steps."""
        turn_limit_rad = math.pi if self.turn_limit_rad is None else self.turn_limit_rad
        return replace(self.planning, step_m=self.step_length_m, turn_limit_rad=turn_limit_rad)
