"""Planners of a search: where a vehicle takes its next scan. Without I/O.

Source: Yousuf, Lendek and Busoniu, section 4. The horizon of more than one step and the planning of several
vehicles in turn are what the paper names as future work.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from estimators.multi_target.search_belief import SearchBelief
from estimators.tracking.range_bearing import Viewpoint
from flightsim.foundation.geodetic_position import NorthEast
from missions.multi_target.objective import Outlook, SearchObjective
from missions.search.area import Area
from missions.search.planner_parameters import PlannerParameters

__all__ = ["ExploringPlanner", "SearchPlanner"]

Array = NDArray[np.float64]

_SAME: Final = 1e-12  # values that differ by less are equal


class SearchPlanner(Protocol):
    """Chooses the next place of one vehicle."""

    def next_place(
        self, belief: SearchBelief, here: NorthEast, direction_rad: float | None, others: Sequence[Viewpoint]
    ) -> NorthEast:
        """The place of the next scan.

        Args:
            belief: of all vehicles.
            here: place of the vehicle.
            direction_rad: direction of its last step; None: it has none.
            others: the scans that the other vehicles are about to take.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False)
class _Branch:
    """A sequence of steps."""

    value: float
    first: NorthEast
    here: NorthEast
    direction_rad: float
    outlook: Outlook


class ExploringPlanner:
    """The paper's planner: the best of the eight neighbours, or of the sequences of steps that begin with
    them.

    Args:
        parameters: of the planner.
        area: places outside are not flown to.
        heading_rad: heading of the vehicle while it searches (paper: 0); None: along the step.
        seed: of the choice among equal values, such as those of the information when no target is detected.
    """

    def __init__(
        self, parameters: PlannerParameters, area: Area, *, heading_rad: float | None = 0.0, seed: int = 0
    ) -> None:
        self._parameters = parameters
        self._area = area
        self._heading_rad = heading_rad
        self._rng = np.random.default_rng(np.random.SeedSequence(seed))

    def next_place(
        self, belief: SearchBelief, here: NorthEast, direction_rad: float | None, others: Sequence[Viewpoint]
    ) -> NorthEast:
        p = self._parameters
        objective = SearchObjective(
            belief.sensor,
            belief.points(),
            belief.exploration,
            p.alpha,
            kind=p.exploration,
            targets_per_m2=belief.parameters.birth_per_m2,
        )
        branches = self._grown(objective, objective.outlook(others), here, direction_rad)
        if not branches:  # outside the area: back to it
            return self._area.nearest(*here)
        for depth in range(1, p.horizon):
            kept = sorted(branches, key=lambda branch: -branch.value)[: p.beam]
            grown = []
            for branch in kept:
                outlook = objective.after(branch.outlook, self._view(branch))
                grown += [
                    _Branch(
                        branch.value + p.discount**depth * further.value,
                        branch.first,
                        further.here,
                        further.direction_rad,
                        outlook,
                    )
                    for further in self._grown(objective, outlook, branch.here, branch.direction_rad)
                ]
            branches = grown or kept
        most = max(branch.value for branch in branches)
        best = [branch for branch in branches if branch.value >= most - _SAME]
        if direction_rad is not None and len(best) > 1:  # among equals: straight on
            turns = [_turn(direction_rad, here, branch.first) for branch in best]
            best = [b for b, turn in zip(best, turns, strict=True) if turn <= min(turns) + 1e-6]
        return best[int(self._rng.integers(len(best)))].first

    def _view(self, branch: _Branch) -> Viewpoint:
        """The scan at the end of a sequence of steps."""
        heading_rad = branch.direction_rad if self._heading_rad is None else self._heading_rad
        return Viewpoint(north_m=branch.here[0], east_m=branch.here[1], heading_rad=heading_rad)

    def _grown(
        self, objective: SearchObjective, outlook: Outlook, here: NorthEast, direction_rad: float | None
    ) -> list[_Branch]:
        """One step to each neighbour."""
        p = self._parameters
        directions = [
            k * 0.25 * math.pi
            for k in range(8)
            if direction_rad is None
            or abs(math.remainder(k * 0.25 * math.pi - direction_rad, math.tau)) <= p.turn_limit_rad + 1e-9
        ]
        steps = [
            (direction, (here[0] + p.step_m * math.cos(direction), here[1] + p.step_m * math.sin(direction)))
            for direction in directions
        ]
        steps = [(direction, place) for direction, place in steps if self._area.contains(*place)]
        if not steps:
            return []
        fixed = self._heading_rad
        headings = np.array([direction if fixed is None else fixed for direction, _ in steps])
        values = objective.values(outlook, np.array([place for _, place in steps]), headings)
        return [
            _Branch(value, place, place, direction, outlook)
            for value, (direction, place) in zip(values.tolist(), steps, strict=True)
        ]


def _turn(direction_rad: float, here: NorthEast, there: NorthEast) -> float:
    bearing = math.atan2(there[1] - here[1], there[0] - here[0])
    return abs(math.remainder(bearing - direction_rad, math.tau))
