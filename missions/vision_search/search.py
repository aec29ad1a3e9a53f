"""The search of a team: each vehicle's belief and goal, and when the search is over. Without I/O."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.camera_sight import CameraSight
from estimators.tracking.grid import GridLayout
from estimators.vision_search import AreaEstimate, BeliefKind, VisionSearchEstimator
from flightsim.foundation.geodetic_position import NorthEast
from missions.vision_search.options import VisionSearchOptions
from missions.vision_search.planner import Localizer, planner_of

__all__ = ["Moment", "VisionSearch"]

Array = NDArray[np.float64]

_MOMENTS: Final = 48
_CELLS: Final = 120  # of a moment's map, along the longer side
_CELLS_OF_PARTICLES: Final = 40


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moment:
    """The first vehicle's belief at a time, for the picture.

    Attributes:
        time_us: time of the frame.
        shares: (rows, columns) probability in each cell of `VisionSearch.layout`.
        estimate: of that time.
        places: where each vehicle was, (north m, east m, heading rad); None: it has not begun.
    """

    time_us: int
    shares: Array
    estimate: AreaEstimate
    places: tuple[tuple[float, float, float] | None, ...]


class VisionSearch:
    """The state of a team's search.

    A vehicle searches by its planner until its own belief is narrow, and then localizes. When the belief
    becomes wide again (the detection was false, or the target has walked away) it searches on.

    Args:
        estimators: of each vehicle.
        options: of each vehicle, adapted to it.
        system_ids: of the vehicles.

    Attributes:
        layout: cells of the moments.
        states: estimates of each vehicle, in order.
        moments: beliefs of the first vehicle at evenly spread times.
        directions: of each vehicle's way to its goal, rad; None: it has none.
        steps: number of decisions of each vehicle.
        began_us: time at which the first vehicle began; -1: none has.
        localized_us: time at which the first belief was narrow; -1: none was.
        reason: why the search is over; "": it is not.
    """

    def __init__(
        self,
        estimators: Sequence[VisionSearchEstimator],
        options: Sequence[VisionSearchOptions],
        system_ids: Sequence[int],
    ) -> None:
        self._system_ids = tuple(system_ids)
        self._estimators, self._options = tuple(estimators), tuple(options)
        area = options[0].area
        cells = _CELLS_OF_PARTICLES if options[0].estimator.belief is BeliefKind.PARTICLES else _CELLS
        self.layout = GridLayout.over(
            width_m=area.width_m,
            height_m=area.height_m,
            cell_m=max(area.height_m, area.width_m) / cells,
            centre_ne_m=area.centre_ne_m,
        )
        count = len(options)
        self.states: list[list[AreaEstimate]] = [[] for _ in range(count)]
        self.moments: list[Moment] = []
        self.steps = [0] * count
        self.began_us = self.localized_us = -1
        self.reason = ""
        self._planners = [planner_of(own) for own in options]
        self._localizers = [Localizer(own) for own in options]
        self._localizing = [False] * count
        self._goals: list[NorthEast | None] = [None] * count
        self.directions: list[float | None] = [None] * count
        self._frames_at_step = [0] * count
        self._flying = [False] * count
        self._every, self._left_out = 1, 0

    @property
    def over(self) -> bool:
        """Whether the search is over."""
        return bool(self.reason)

    @property
    def passes(self) -> int:
        """Number of passes that all vehicles have flown."""
        return sum(localizer.done for localizer in self._localizers)

    @property
    def progress(self) -> float:
        """Share of the passes, or of the search time before the first one, at most a half."""
        options = self._options[0]
        if self.passes:
            return min(1.0, 0.5 + 0.5 * self.passes / options.passes)
        limit_s = options.search_time_s
        if limit_s is None or self.began_us < 0 or not self.states[0]:
            return 0.0
        return 0.5 * min(1.0, (self.states[0][-1].time_us - self.began_us) * 1e-6 / limit_s)

    def begin(self, index: int, time_us: int) -> NorthEast:
        """A vehicle begins; returns its first place."""
        if self.began_us < 0:
            self.began_us = time_us
        self._flying[index] = True
        planner, estimator = self._planners[index], self._estimators[index]
        goal = planner.next_place(
            estimator.belief, (0.0, 0.0), None, self._camera(index), self._others(index)
        )
        self._goals[index] = goal
        self.directions[index] = math.atan2(goal[1], goal[0])
        return goal

    def _camera(self, index: int) -> CameraSight | None:
        """The vehicle's newest frame."""
        return self._estimators[index].newest.get(self._system_ids[index])

    def _others(self, index: int) -> list[tuple[NorthEast, float]]:
        """Ways of the other vehicles in the air."""
        return [
            (goal, direction)
            for other, (goal, direction) in enumerate(zip(self._goals, self.directions, strict=True))
            if other != index and self._flying[other] and goal is not None and direction is not None
        ]

    def observed(
        self,
        index: int,
        estimate: AreaEstimate,
        places: Callable[[], tuple[tuple[float, float, float] | None, ...]],
    ) -> None:
        """A vehicle's belief has a new estimate; stores it.

        Args:
            index: of the vehicle.
            estimate: of its belief.
            places: where each vehicle is.
        """
        options = self._options[0]
        self.states[index].append(estimate)
        self._localizing[index] = estimate.detections > 0 and estimate.sigma_m < options.localize_sigma_m
        if self._localizing[index] and self.localized_us < 0:
            self.localized_us = estimate.time_us
        if index == 0:
            self._keep(estimate, places)
        if self.began_us < 0:
            return
        limit_s = options.search_time_s
        if limit_s is not None and estimate.time_us - self.began_us > limit_s * 1e6:
            self.reason = self.reason or "the search time is over"

    def _keep(
        self, estimate: AreaEstimate, places: Callable[[], tuple[tuple[float, float, float] | None, ...]]
    ) -> None:
        self._left_out += 1
        if self._left_out < self._every:
            return
        self._left_out = 0
        shares = self._estimators[0].belief.shares(self.layout)
        self.moments.append(
            Moment(time_us=estimate.time_us, shares=shares, estimate=estimate, places=places())
        )
        if len(self.moments) >= 2 * _MOMENTS:
            del self.moments[1::2]
            self._every *= 2

    def may_step(self, index: int) -> bool:
        """Whether a frame was used since the vehicle's last decision: without one nothing is known about
        where it has flown.
        """
        return self._estimators[index].frames > self._frames_at_step[index]

    def step(self, index: int, time_us: int, here: NorthEast) -> NorthEast:
        """A vehicle has reached its goal; returns its next one."""
        options, estimator = self._options[index], self._estimators[index]
        self.steps[index] += 1
        if self.steps[index] > options.steps:
            self.reason = self.reason or "all steps are taken"
        if self.passes >= options.passes:
            self.reason = self.reason or "all passes are flown"
        if self.over:
            return here
        self._frames_at_step[index] = estimator.frames
        if self._localizing[index]:
            there = self._localizers[index].next_place(self.states[index][-1], here)
        else:
            there = self._planners[index].next_place(
                estimator.belief, here, self.directions[index], self._camera(index), self._others(index)
            )
        if self.passes >= options.passes:
            self.reason = "all passes are flown"
            return here
        self.directions[index] = math.atan2(there[1] - here[1], there[0] - here[0])
        self._goals[index] = there
        return there

    def leave(self, index: int) -> None:
        """A vehicle has ended its search."""
        self._flying[index] = False
