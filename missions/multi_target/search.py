"""The search of a team: the shared belief, each vehicle's goal, and when the search is over. Without I/O."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.multi_target.estimate import TargetRow
from estimators.multi_target.search_belief import SearchBelief
from estimators.scene_items import Item, PointSet, Role
from estimators.tracking.information import condensed
from estimators.tracking.range_bearing import Viewpoint
from flightsim.foundation.geodetic_position import NorthEast
from missions.multi_target.ergodic import ErgodicPlanner
from missions.multi_target.options import MultiTargetOptions, PlannerKind
from missions.multi_target.planner import ExploringPlanner, SearchPlanner
from missions.multi_target.revisit import RevisitPlanner
from missions.search.sweep import SweepPlanner, sweep_path
from missions.search.team import HEADING_RAD

__all__ = ["Moment", "SearchState", "Step", "TargetSearch", "planner_of"]

Array = NDArray[np.float64]


_MOMENTS: Final = 64
_CELL_M: Final = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A decision of one vehicle.

    Attributes:
        time_us: time of the decision.
        vehicle: index of the vehicle.
        here: its place, as it reports it.
        there: the place of the next scan.
    """

    time_us: int
    vehicle: int
    here: NorthEast
    there: NorthEast


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchState:
    """The state after a scan, for the figures.

    Attributes:
        time_us: time of the scan.
        targets: found targets and those that are detected.
        expected_undetected: expected number of targets that were never detected.
    """

    time_us: int
    targets: tuple[TargetRow, ...]
    expected_undetected: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moment:
    """The intensity at a time, for the picture: north, east and mass (n,)."""

    time_us: int
    points: tuple[Array, Array, Array]


def planner_of(options: MultiTargetOptions) -> SearchPlanner:
    """The planner that one vehicle's options describe."""
    parameters, area = options.planner_parameters, options.area
    if options.planner is PlannerKind.ERGODIC:
        return ErgodicPlanner(area, parameters.step_m, parameters.turn_limit_rad)
    if options.planner in (PlannerKind.SWEEP, PlannerKind.REVISIT):
        share = area if options.vehicles == 1 else area.strip(options.index, options.vehicles)
        path = sweep_path(share, options.own_start_ne_m, parameters.step_m * options.steps, options.spacing_m)
        along = SweepPlanner if options.planner is PlannerKind.SWEEP else RevisitPlanner
        return along(path, parameters.step_m)
    heading_rad = HEADING_RAD if options.turn_limit_rad is None else None  # an aircraft flies where it looks
    return ExploringPlanner(
        parameters, area, heading_rad=heading_rad, seed=options.estimator.seed * 256 + options.index
    )


class TargetSearch:
    """The state of a team's search.

    Args:
        belief: the belief, to which the estimator reports scans.
        options: of each vehicle, adapted to it.
        planners: of each vehicle; None: those that the options describe.

    Attributes:
        steps: decisions in order.
        states: after each scan.
        moments: intensities at evenly spread times, with the newest.
        began_us: time at which the first vehicle began; -1: none has.
        reason: why the search is over; "": it is not.
    """

    def __init__(
        self,
        belief: SearchBelief,
        options: Sequence[MultiTargetOptions],
        planners: Sequence[SearchPlanner] | None = None,
    ) -> None:
        self.belief = belief
        self.steps: list[Step] = []
        self.states: list[SearchState] = []
        self.moments: list[Moment] = []
        self.began_us = -1
        self.reason = ""
        self._options = tuple(options)
        self._planners = tuple(planners or (planner_of(own) for own in options))
        self._goals: list[NorthEast | None] = [None] * len(options)
        self._taken = [0] * len(options)
        self._directions: list[float | None] = [None] * len(options)
        self._scans_at_step = [0] * len(options)
        self._every = 1
        self._left_out = 0

    @property
    def over(self) -> bool:
        """Whether the search is over."""
        return bool(self.reason)

    @property
    def progress(self) -> float:
        """Share of the steps that were taken, 0..1."""
        return min(1.0, max(self._taken, default=0) / self._options[0].steps)

    def begin(self, index: int, time_us: int) -> NorthEast:
        """A vehicle begins; returns the place of its first scan."""
        if self.began_us < 0:
            self.began_us = time_us
        goal = self._goals[index] = self._options[index].own_start_ne_m
        return goal

    def scanned(self, time_us: int, targets: tuple[TargetRow, ...]) -> None:
        """A scan was fused; store the state."""
        belief, options = self.belief, self._options[0]
        undetected = belief.expected_undetected
        self.states.append(SearchState(time_us=time_us, targets=targets, expected_undetected=undetected))
        self._left_out += 1
        if self._left_out >= self._every:
            self._left_out = 0
            self.moments.append(
                Moment(time_us=time_us, points=condensed(*belief.intensity.points(), cell_m=_CELL_M))
            )
            if len(self.moments) >= 2 * _MOMENTS:
                del self.moments[1::2]
                self._every *= 2
        if self.began_us < 0:
            return
        if options.search_time_s is not None and time_us - self.began_us > options.search_time_s * 1e6:
            self.reason = "the search time is over"
        left = undetected + belief.intensity.expected_targets
        if options.undetected is not None and self.steps and left < options.undetected:
            self.reason = f"{left:.2g} targets are expected to be left"

    def may_step(self, index: int) -> bool:
        """Whether a scan was fused since the vehicle's last decision: without one nothing is known about
        where it has flown.
        """
        return self.belief.scans > self._scans_at_step[index]

    def step(self, index: int, time_us: int, here: NorthEast) -> NorthEast:
        """A vehicle has reached its goal; returns its next one."""
        self._taken[index] += 1
        if self._taken[index] > self._options[index].steps:
            self.reason = self.reason or "all steps are taken"
        if self.over:
            return here
        self._scans_at_step[index] = self.belief.scans
        others = [
            Viewpoint(north_m=goal[0], east_m=goal[1], heading_rad=HEADING_RAD)
            for other, goal in enumerate(self._goals)
            if goal is not None and other != index
        ]
        start = self._goals[index] or here
        if math.dist(start, here) > self._options[index].planner_parameters.step_m:
            start = here  # the goal was not reached
        there = self._planners[index].next_place(self.belief, start, self._directions[index], others)
        self._directions[index] = math.atan2(there[1] - start[1], there[0] - start[0])
        self._goals[index] = there
        self.steps.append(Step(time_us=time_us, vehicle=index, here=here, there=there))
        return there

    def shown_goals(self) -> dict[str, Item]:
        """Where each vehicle scans next, for viewers."""
        goals = [(k, goal) for k, goal in enumerate(self._goals) if goal is not None]
        labels = [f"next scan of {k + 1}" for k, _ in goals]
        places = [goal for _, goal in goals]
        return {"goals": PointSet.on_ground(places, labels=labels, role=Role.COMMANDED)}

    def leave(self, index: int) -> None:
        """A vehicle has ended its search."""
        self._goals[index] = None
