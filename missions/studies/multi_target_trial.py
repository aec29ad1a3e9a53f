"""The trial of the study `multi-target`: one search in an embedded world, flown or by a point.

The two experiments of Yousuf, Lendek and Busoniu, section 5. What the paper does not give is chosen here and
named in docs/multi_target.md: places of the targets, terrain, noise.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.multi_target.parameters import Belief, MultiTargetParameters
from flightsim.world_spec import WorldSpec
from missions.base.request import RunRequest
from missions.multi_target.figures import score_figures
from missions.multi_target.options import MultiTargetOptions, PlannerKind
from missions.multi_target.target_field import TargetField
from missions.multi_target.world import multi_target_world, terrain_targets_world, world_deviating
from missions.multi_target.world_searchers import search_with_point
from missions.search.area import edges
from missions.search.planner_parameters import Exploration, PlannerParameters
from missions.studies.flights import fly_trial
from missions.studies.multi_target_worlds import WORLDS
from missions.studies.options import Experiments, Planners
from missions.studies.study import run_of

__all__ = ["EXPERIMENTS", "STEP_S", "Experiment", "Found", "MultiTargetCell", "SearchTrial"]

Array = NDArray[np.float64]

STEP_S: Final = 2.6
"""Time of a step in the paper, which has one scan per step: so is the time between scans."""

_POINTS: Final = 61
_WITHIN: Final = math.sqrt(-2.0 * math.log(0.05))
"""Radius that holds 95 % of the errors in the plane, in standard deviations per axis."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """One experiment of the paper.

    Attributes:
        area_m: south, west, north, east.
        targets, clusters: of the paper; so many targets the filter expects.
        counts, groups: numbers of targets and of clusters that are drawn with a terrain for each run; None:
            those of the paper, at places that are drawn.
        steps: length of a search.
    """

    area_m: tuple[float, float, float, float]
    targets: int
    clusters: int
    counts: range | None = None
    groups: range | None = None
    steps: int

    @property
    def time_s(self) -> Array:
        """The times at which found targets are counted: to the end of the paper's steps."""
        return np.linspace(0.0, STEP_S * self.steps, _POINTS)

    def options(self, planner: PlannerKind, planning: PlannerParameters, **known: Any) -> MultiTargetOptions:
        """The search.

        Args:
            planner, planning: how the next place is chosen.
            known: parameters of the estimator besides the area and the expected number.
        """
        estimator = MultiTargetParameters(**edges(self.area_m), expected_targets=float(self.targets), **known)
        return MultiTargetOptions(steps=self.steps, planner=planner, planning=planning, estimator=estimator)

    def world(self, options: MultiTargetOptions, seed: int) -> WorldSpec:
        """The true world of a run."""
        world = WorldSpec.of_team(1, seed=seed)
        if self.counts is not None and self.groups is not None:
            world = terrain_targets_world(world, options, counts=self.counts, clusters=self.groups)
        field = TargetField(count=self.targets, clusters=self.clusters, scan_period_s=STEP_S)
        return multi_target_world(world, options, field)


EXPERIMENTS: Final[Mapping[str, Experiment]] = MappingProxyType(
    {
        Experiments.E1: Experiment(area_m=(-30.0, -30.0, 270.0, 270.0), targets=18, clusters=3, steps=240),
        Experiments.E2: Experiment(
            area_m=(-30.0, -30.0, 250.0, 250.0),
            targets=14,
            clusters=2,
            counts=range(8, 21),
            groups=range(1, 4),
            steps=100,
        ),
    }
)

_KINDS: Final[Mapping[Planners, PlannerKind]] = MappingProxyType(
    {
        Planners.PROPOSED: PlannerKind.EXPLORING,
        Planners.PAPER: PlannerKind.EXPLORING,
        Planners.LAWNMOWER: PlannerKind.SWEEP,
        Planners.INFORMATION: PlannerKind.INFORMATION,
        Planners.REVISIT: PlannerKind.REVISIT,
        Planners.ERGODIC: PlannerKind.ERGODIC,
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiTargetCell:
    """Parameters of a trial: values of `Experiments`, `SearchWorlds`, `Belief` and `Planners`."""

    experiment: str
    world: str
    belief: str
    planner: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """The result of a search.

    Attributes:
        completed: the search was flown, and passed its checks.
        reason: why not; "" otherwise.
        found_over_time: number of true targets within 4 m of a found one, at the times of the experiment.
        area: mean of that over time, as a share of all targets: the area under the curve.
        targets: number of true targets.
        found: number of them that were found at the end.
        false: number of found targets that are none.
        all_found: whether all were found.
        gospa_m: GOSPA at the end, cut-off 10 m.
        gospa_missed, gospa_false: true targets without a reported one, and the reverse.
        cardinality_error: expected number of targets, with those that were never detected, less the true one.
        stated: of each reported target, the probability that there is one, at most 1.
        right: of each reported target, whether it is within 4 m of a true one of its own.
        inside: of each of these that is right, whether the error is within the stated 95 % ellipse.
        step_s: mean time of a step.
        sim_time_s: time from boot to the end.
    """

    completed: bool
    reason: str
    found_over_time: tuple[float, ...]
    area: float
    targets: int
    found: int
    false: int
    all_found: bool
    gospa_m: float
    gospa_missed: int
    gospa_false: int
    cardinality_error: float
    stated: tuple[float, ...]
    right: tuple[float, ...]
    inside: tuple[float, ...]
    step_s: float
    sim_time_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchTrial:
    """One search of an experiment by a planner.

    Attributes:
        planning: of the proposed planner.
        points: the vehicle is a point, and nothing is flown.
    """

    planning: PlannerParameters = MultiTargetOptions().planning
    points: bool = False

    def __call__(self, cell: MultiTargetCell, seed: int) -> Found:
        """Search. The same seed has the same targets and the same sensor noise for all planners."""
        experiment, planner = EXPERIMENTS[cell.experiment], Planners(cell.planner)
        setting = WORLDS[cell.world].setting
        options = experiment.options(
            _KINDS[planner],
            self._planning(planner),
            belief=Belief(cell.belief),
            clutter_per_scan=setting.expected_clutter,
            seed=run_of(seed)[1],
        )
        world = world_deviating(experiment.world(options, seed), options, setting.deviation)
        if not self.points:
            result = fly_trial("multi-target", RunRequest(options=options, world=world))
            return _row(experiment, result.summary, result.outcome == "completed", result.reason)
        done = search_with_point(options, world)
        belief = done.belief
        summary = {
            **score_figures(done.score),
            "targets_found": len(belief.found),
            "targets_expected": belief.expected_targets,
            "targets_expected_undetected": belief.expected_undetected,
            "step_s_mean": STEP_S,
            "sim_time_s": STEP_S * experiment.steps,
        }
        return _row(experiment, summary, True, "")

    def _planning(self, planner: Planners) -> PlannerParameters:
        """The baselines plan as the paper's."""
        if planner is Planners.PAPER:
            return replace(self.planning, horizon=1, alpha=1.0, exploration=Exploration.PLACE)
        return self.planning if planner is Planners.PROPOSED else replace(self.planning, horizon=1)


def _row(experiment: Experiment, summary: Mapping[str, Any], completed: bool, reason: str) -> Found:
    rises = np.array(summary["found_right_s"] or [], dtype=np.float64).reshape(-1, 2)
    index = np.searchsorted(rises[:, 0], experiment.time_s, side="right")
    found = np.concatenate(([0.0], rises[:, 1]))[index]
    right, true = int(summary["targets_found_right"]), int(summary["targets_true"])
    reported = summary["targets_reported"]
    return Found(
        completed=completed,
        reason=reason,
        found_over_time=tuple(found.tolist()),
        area=float(np.mean(found)) / true,
        targets=true,
        found=right,
        false=int(summary["targets_found"]) - right,
        all_found=right == true,
        gospa_m=float(summary["gospa_end_m"]),
        gospa_missed=int(summary["gospa_missed"]),
        gospa_false=int(summary["gospa_false"]),
        cardinality_error=summary["targets_expected"] + summary["targets_expected_undetected"] - true,
        stated=tuple(min(1.0, row["mass"]) for row in reported),
        right=tuple(float(row["error_m"] is not None) for row in reported),
        inside=tuple(
            float(row["error_m"] <= _WITHIN * row["width_m"])
            for row in reported
            if row["error_m"] is not None
        ),
        step_s=float(summary["step_s_mean"] or math.nan),
        sim_time_s=float(summary["sim_time_s"]),
    )
