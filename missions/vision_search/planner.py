"""Where a vehicle flies next: along a pattern, to where a detection is most probable, or over the target.

Source: the search by probability of detection is that of Bourgault, Furukawa and Durrant-Whyte 2003, which
Tisdale et al. 2008 name for their paths. Without I/O.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.area_belief import AreaBelief
from estimators.tracking.camera_likelihood import FrameLikelihood
from estimators.tracking.camera_sight import CameraSight, SightModel
from estimators.tracking.grid import GridLayout
from estimators.vision_search.estimate import AreaEstimate
from estimators.vision_search.models import sight_model_of
from flightsim.foundation.geodetic_position import NorthEast
from flightsim.foundation.vectors import from_euler, product
from missions.patterns.lissajous import named_lissajous
from missions.patterns.polyline import Polyline
from missions.search.area import Area
from missions.search.planner_parameters import PlannerParameters
from missions.search.sweep import SweepPlanner, sweep_path
from missions.vision_search.options import LocalizeKind, SearchPlannerKind, VisionSearchOptions

__all__ = ["AreaPlanner", "HorizonPlanner", "Localizer", "PathPlanner", "planner_of"]

Array = NDArray[np.float64]

Way = tuple[NorthEast, float]
"""A goal, and the direction in which it is flown to."""

_GOLDEN_RAD: Final = math.pi * (math.sqrt(5.0) - 1.0) / 2.0  # between passes: any number is evenly spread
_CELLS: Final = 48  # of the planner's map, along the longer side
_ORBIT_RAD: Final = math.radians(60.0)
_ORBIT_SHARE: Final = 0.35  # radius of an orbit, in the ground that is seen along the flight
_ALONG_SHARE: Final = 0.5625  # of the picture, 720 to 1280 pixels


class AreaPlanner(Protocol):
    """Chooses the next place of one vehicle while the target is searched for."""

    def next_place(
        self,
        belief: AreaBelief,
        here: NorthEast,
        direction_rad: float | None,
        camera: CameraSight | None,
        others: Sequence[Way] = (),
    ) -> NorthEast:
        """The next place.

        Args:
            belief: of the vehicle.
            here: its place.
            direction_rad: direction of its last step; None: it has none.
            camera: its newest frame; None: there was none.
            others: ways of the other vehicles.
        """
        ...


class PathPlanner:
    """Places along a path, one step apart, whatever is seen; after its end the path is flown back."""

    def __init__(self, path: Polyline, step_m: float) -> None:
        self._sweep = SweepPlanner(path, step_m)

    def next_place(
        self,
        belief: AreaBelief,
        here: NorthEast,
        direction_rad: float | None,
        camera: CameraSight | None,
        others: Sequence[Way] = (),
    ) -> NorthEast:
        return self._sweep.along(here)


@dataclass(frozen=True, slots=True, eq=False)
class _Branch:
    """A sequence of steps, and the probability in each cell that the target is there and was not detected."""

    value: float
    first: NorthEast
    here: NorthEast
    direction_rad: float
    left: Array


class HorizonPlanner:
    """The sequence of steps with the highest probability to detect the target; its first step is flown.

    A step counts with a frame in its middle and one at its end. Of equal sequences (everything near was
    searched) the one that ends nearest to the most probable place is flown.

    Args:
        parameters: step, horizon, beam and limit of turns.
        area: places outside are not flown to.
        model: detector and target.
        altitude_m: of the flight.
    """

    def __init__(
        self, parameters: PlannerParameters, area: Area, model: SightModel, *, altitude_m: float
    ) -> None:
        self._parameters, self._area, self._model = parameters, area, model
        self._altitude_m = altitude_m
        self._layout = GridLayout.over(
            width_m=area.width_m,
            height_m=area.height_m,
            cell_m=max(area.height_m, area.width_m) / _CELLS,
            centre_ne_m=area.centre_ne_m,
        )
        north, east = np.broadcast_arrays(*self._layout.centres())
        self._north, self._east = north.ravel(), east.ravel()

    def next_place(
        self,
        belief: AreaBelief,
        here: NorthEast,
        direction_rad: float | None,
        camera: CameraSight | None,
        others: Sequence[Way] = (),
    ) -> NorthEast:
        if camera is None:
            return self._area.nearest(*here)
        shares = belief.shares(self._layout).ravel()
        p = self._parameters
        for goal, direction in others:  # what these are about to see is theirs
            for k in range(p.horizon):
                shares = shares * self._missed(_at(goal, direction, k * p.step_m), direction, camera)
        branches = self._grown(_Branch(0.0, here, here, 0.0, shares), direction_rad, 0, camera)
        if not branches:  # outside the area, or before its edge: back to its middle
            return self._area.nearest(*self._inward(here))
        for depth in range(1, p.horizon):
            kept = sorted(branches, key=lambda branch: -branch.value)[: p.beam]
            grown = [
                further
                for branch in kept
                for further in self._grown(branch, branch.direction_rad, depth, camera)
            ]
            branches = grown or kept
        most = max(branch.value for branch in branches)
        best = [branch for branch in branches if branch.value >= most - 1e-4 * max(most, 1e-3)]
        peak = belief.mode_ne_m
        return min(best, key=lambda branch: math.dist(branch.here, peak)).first

    def _inward(self, here: NorthEast) -> NorthEast:
        centre = self._area.centre_ne_m
        away_m = math.dist(here, centre)
        share = min(1.0, self._parameters.step_m / away_m) if away_m > 0.0 else 0.0
        return here[0] + share * (centre[0] - here[0]), here[1] + share * (centre[1] - here[1])

    def _grown(
        self, branch: _Branch, direction_rad: float | None, depth: int, camera: CameraSight
    ) -> list[_Branch]:
        """One step to each neighbour."""
        p, grown = self._parameters, []
        for k in range(8):
            direction = k * 0.25 * math.pi
            if direction_rad is not None:
                turn = abs(math.remainder(direction - direction_rad, math.tau))
                if turn > p.turn_limit_rad + 1e-9:
                    continue
            n, e = p.step_m * math.cos(direction), p.step_m * math.sin(direction)
            there = branch.here[0] + n, branch.here[1] + e
            if not self._area.contains(*there):
                continue
            middle = branch.here[0] + 0.5 * n, branch.here[1] + 0.5 * e
            left = branch.left * self._missed(middle, direction, camera)
            left = left * self._missed(there, direction, camera)
            value = branch.value + p.discount**depth * float(branch.left.sum() - left.sum())
            first = there if depth == 0 else branch.first
            grown.append(_Branch(value, first, there, direction, left))
        return grown

    def _missed(self, place: NorthEast, direction_rad: float, camera: CameraSight) -> Array:
        """Probability in each cell that a frame of a level camera, which flies ahead, does not detect the
        target.
        """
        sight = replace(
            camera,
            place_ned_m=(place[0], place[1], -self._altitude_m),
            q_ned_from_mount=product(
                from_euler(0.0, 0.0, direction_rad), from_euler(0.0, -0.5 * math.pi, 0.0)
            ),
            detections=np.zeros((0, 2)),
        )
        reach_m = self._area.height_m + self._area.width_m
        frame = FrameLikelihood.of(sight.blurred(self._layout.cell_m**2 / 12.0), self._model, reach_m)
        return frame.at(self._north, self._east)


class Localizer:
    """The places of one vehicle that localizes: passes over the estimate, or an orbit around it.

    Args:
        options: of the vehicle.
    """

    def __init__(self, options: VisionSearchOptions) -> None:
        self._kind = options.localize
        along_m = _ALONG_SHARE * options.seen_across_m
        self._radius_m = _ORBIT_SHARE * along_m
        # an aircraft needs the way of its turn to be level over the target
        room_m = 1.2 * options.step_length_m if options.turn_limit_rad != math.pi else 0.0
        self._half_m = 0.6 * math.hypot(along_m, options.seen_across_m) + room_m
        self._count, self._index = options.vehicles, options.index
        self._area = options.area
        self._begun = 0
        self._leaving: float | None = None  # direction in which the present pass leaves the target
        self._angle_rad: float | None = None
        self._places = 0  # that were asked for: the vehicle has reached all but the last one

    @property
    def done(self) -> int:
        """Number of passes, or of turns by 60 degrees, that were flown to their end."""
        if self._kind is LocalizeKind.ORBIT:
            return max(0, self._places - 2)
        return max(0, self._places - 1) // 2

    def next_place(self, estimate: AreaEstimate, here: NorthEast) -> NorthEast:
        """The next place; the vehicle is at the one before."""
        self._places += 1
        target = estimate.north_m, estimate.east_m
        if self._kind is LocalizeKind.ORBIT:
            if self._angle_rad is None:
                self._angle_rad = math.atan2(here[1] - target[1], here[0] - target[0])
            else:
                self._angle_rad += _ORBIT_RAD
            return _at(target, self._angle_rad, self._radius_m)
        if self._leaving is not None:
            direction, self._leaving = self._leaving, None
            return _at(target, direction, self._half_m)
        direction = (self._begun * self._count + self._index) * _GOLDEN_RAD
        self._begun += 1
        entry, exit_ = (_at(target, direction + turn, self._half_m) for turn in (math.pi, 0.0))
        if math.dist(here, exit_) < math.dist(here, entry):
            direction, entry = direction + math.pi, exit_
        self._leaving = direction
        return entry


def _at(place: NorthEast, direction_rad: float, distance_m: float) -> NorthEast:
    return place[0] + distance_m * math.cos(direction_rad), place[1] + distance_m * math.sin(direction_rad)


def planner_of(options: VisionSearchOptions) -> AreaPlanner:
    """The planner that one vehicle's options describe."""
    area = options.area
    if options.planner is SearchPlannerKind.HORIZON:
        return HorizonPlanner(
            options.planner_parameters,
            area,
            sight_model_of(options.estimator),
            altitude_m=options.own_altitude_m,
        )
    if options.planner is SearchPlannerKind.LISSAJOUS:
        curve = named_lissajous(options.curve, width_m=area.width_m, height_m=area.height_m)
        start = options.index / options.vehicles
        places = curve.points(np.linspace(start, start + 1.0, 400) * curve.end)
        path = Polyline(tuple((n, e) for n, e in (places + area.centre_ne_m).tolist()))
        return PathPlanner(path, options.step_length_m)
    share = area if options.vehicles == 1 else area.strip(options.index, options.vehicles)
    # legs end half a spacing before the side, but the picture is shorter along them than across
    more_m = max(0.0, 0.5 * options.own_spacing_m - 0.4 * _ALONG_SHARE * options.seen_across_m)
    if share.height_m >= share.width_m:
        share = replace(share, south_m=share.south_m - more_m, north_m=share.north_m + more_m)
    else:
        share = replace(share, west_m=share.west_m - more_m, east_m=share.east_m + more_m)
    path = sweep_path(share, (0.0, 0.0), math.inf, options.own_spacing_m)
    return PathPlanner(path, options.step_length_m)
