"""Planners of a search: where a vehicle takes its next scan. Without I/O.

Source: Yousuf, Lendek and Busoniu, section 4. The horizon of more than one step and the planning of several
vehicles in turn are what the paper names as future work.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from estimators.multi_target.search_belief import SearchBelief
from estimators.tracking.range_bearing import Viewpoint
from missions.errors import PlanError
from missions.multi_target.objective import Exploration, Outlook, SearchObjective
from missions.patterns.polyline import Polyline

__all__ = ["Area", "ExploringPlanner", "PlannerParameters", "SearchPlanner", "SweepPlanner"]

Array = NDArray[np.float64]
Place = tuple[float, float]
"""North and east of the origin, metres."""

_SAME: Final = 1e-12  # values that differ by less are equal


@dataclass(frozen=True, slots=True, kw_only=True)
class Area:
    """The searched rectangle, metres from the origin."""

    south_m: float
    west_m: float
    north_m: float
    east_m: float

    def __post_init__(self) -> None:
        edges = (self.south_m, self.west_m, self.north_m, self.east_m)
        if not (all(map(math.isfinite, edges)) and self.north_m > self.south_m and self.east_m > self.west_m):
            raise PlanError(
                f"`area_m` {','.join(f'{edge:g}' for edge in edges)} is not an area; "
                "give SOUTH,WEST,NORTH,EAST"
            )

    def contains(self, north_m: float, east_m: float) -> bool:
        """Whether a place is inside, edges included."""
        return self.south_m <= north_m <= self.north_m and self.west_m <= east_m <= self.east_m

    def nearest(self, north_m: float, east_m: float) -> Place:
        """The place inside that is nearest to a place."""
        return (min(max(north_m, self.south_m), self.north_m), min(max(east_m, self.west_m), self.east_m))

    def strip(self, index: int, count: int) -> "Area":
        """One of `count` equal strips of the longer side, from the south or from the west."""
        if self.height_m >= self.width_m:
            side_m = self.height_m / count
            south_m = self.south_m + index * side_m
            return replace(self, south_m=south_m, north_m=south_m + side_m)
        side_m = self.width_m / count
        west_m = self.west_m + index * side_m
        return replace(self, west_m=west_m, east_m=west_m + side_m)

    @property
    def centre_ne_m(self) -> Place:
        return 0.5 * (self.south_m + self.north_m), 0.5 * (self.west_m + self.east_m)

    @property
    def height_m(self) -> float:
        return self.north_m - self.south_m

    @property
    def width_m(self) -> float:
        return self.east_m - self.west_m


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerParameters:
    """Parameters of the exploring planner.

    Attributes:
        step_m: distance to the next scan; also along the diagonals (paper: 9 m).
        alpha: weight of the exploration against the information, nats (not given in the paper).
        exploration: what the exploration of a scan is.
        horizon: number of steps that are planned; the first one is flown.
        beam: number of sequences of steps that are kept at each depth.
        discount: weight of a step against the one before it.
        turn_limit_rad: largest change of the direction of flight in a step; pi: any.
    """

    step_m: float = 9.0
    alpha: float = 1.0
    exploration: Exploration = Exploration.PLACE
    horizon: int = 1
    beam: int = 6
    discount: float = 0.9
    turn_limit_rad: float = math.pi

    def __post_init__(self) -> None:
        if not (math.isfinite(self.step_m) and self.step_m > 0.0):
            raise PlanError(f"`step_m` {self.step_m:g} is not possible; ask for more than 0")
        if not (math.isfinite(self.alpha) and self.alpha >= 0.0):
            raise PlanError(f"`alpha` {self.alpha:g} is not possible; ask for 0 or more")
        if not 1 <= self.horizon <= 8:
            raise PlanError(f"`horizon` {self.horizon} is not in 1..8")
        if not 1 <= self.beam <= 100:
            raise PlanError(f"`beam` {self.beam} is not in 1..100")
        if not 0.0 < self.discount <= 1.0:
            raise PlanError(f"discount {self.discount:g} is not in 0..1, or is 0")
        if not 0.25 * math.pi <= self.turn_limit_rad <= math.pi:
            raise PlanError(
                f"turn_limit_rad {math.degrees(self.turn_limit_rad):g} degrees is not in 45..180 degrees"
            )


class SearchPlanner(Protocol):
    """Chooses the next place of one vehicle."""

    def next_place(
        self, belief: SearchBelief, here: Place, direction_rad: float | None, others: Sequence[Viewpoint]
    ) -> Place:
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
    first: Place
    here: Place
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
        self, belief: SearchBelief, here: Place, direction_rad: float | None, others: Sequence[Viewpoint]
    ) -> Place:
        p = self._parameters
        objective = SearchObjective(
            belief.sensor,
            belief.intensity.points(),
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
        self, objective: SearchObjective, outlook: Outlook, here: Place, direction_rad: float | None
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


def _turn(direction_rad: float, here: Place, there: Place) -> float:
    bearing = math.atan2(there[1] - here[1], there[0] - here[0])
    return abs(math.remainder(bearing - direction_rad, math.tau))


class SweepPlanner:
    """The baseline: places along a path, one step apart, whatever is detected. After its end the path is
    flown back.

    Args:
        path: from the origin.
        step_m: distance between places.
    """

    def __init__(self, path: Polyline, step_m: float) -> None:
        vertices = np.asarray(path.vertices_m)
        along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(vertices, axis=0).T))))
        at = np.arange(0.0, along[-1] + 1e-9, step_m)
        north, east = (np.interp(at, along, vertices[:, axis]) for axis in (0, 1))
        forth = list(zip(north.tolist(), east.tolist(), strict=True))
        self._places = forth + forth[-2:0:-1]
        self._step_m = step_m
        self._next = 0

    def next_place(
        self, belief: SearchBelief, here: Place, direction_rad: float | None, others: Sequence[Viewpoint]
    ) -> Place:
        return self.along(here)

    def along(self, here: Place) -> Place:
        """The next place from a place."""
        target = self._places[self._next % len(self._places)]
        away_m = math.dist(here, target)
        if away_m > 1.5 * self._step_m:  # the way to the path, in steps too
            share = self._step_m / away_m
            return here[0] + share * (target[0] - here[0]), here[1] + share * (target[1] - here[1])
        self._next += 1
        return target
