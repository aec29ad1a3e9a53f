"""The trial of the study `multi-target`: one search in an embedded world.

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

from estimators.multi_target.parameters import MultiTargetParameters
from flightsim.world_spec import WorldSpec
from missions.base.request import RunRequest
from missions.multi_target.options import MultiTargetOptions, PlannerKind
from missions.multi_target.target_field import TargetField
from missions.multi_target.world import multi_target_world, terrain_targets_world
from missions.search.area import edges
from missions.search.planner_parameters import PlannerParameters
from missions.studies.flights import fly_trial
from missions.studies.study import run_of

__all__ = ["EXPERIMENTS", "MAPS", "PLANNERS", "Cell", "Experiment", "Found", "SearchTrial"]

Array = NDArray[np.float64]

MAPS: Final = 6
"""Terrains of the second experiment; run k is flown on the terrain k modulo 6."""

PLANNERS: Final[Mapping[str, PlannerKind]] = MappingProxyType(
    {
        "proposed": PlannerKind.EXPLORING,
        "lawnmower": PlannerKind.SWEEP,
        "information": PlannerKind.INFORMATION,
    }
)

STEP_S: Final = 2.6
"""Time of a step in the paper, which has one scan per step: so is the time between scans."""

_POINTS: Final = 61


@dataclass(frozen=True, slots=True, kw_only=True)
class Experiment:
    """One experiment of the paper.

    Attributes:
        area_m: south, west, north, east.
        targets, clusters: true targets.
        steps: length of a search.
    """

    area_m: tuple[float, float, float, float]
    targets: int
    clusters: int
    steps: int

    @property
    def time_s(self) -> Array:
        """The times at which found targets are counted: to the end of the paper's steps."""
        return np.linspace(0.0, STEP_S * self.steps, _POINTS)


EXPERIMENTS: Final[Mapping[str, Experiment]] = MappingProxyType(
    {
        "E1": Experiment(area_m=(-30.0, -30.0, 270.0, 270.0), targets=18, clusters=3, steps=240),
        "E2": Experiment(area_m=(-30.0, -30.0, 250.0, 250.0), targets=14, clusters=2, steps=100),
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """Parameters of a trial."""

    experiment: str
    planner: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """The result of a search.

    Attributes:
        completed: the search was flown, and passed its checks.
        reason: why not; "" otherwise.
        found_over_time: number of true targets within 4 m of a found one, at the times of the experiment.
        area: mean of that over time, as a share of all targets: the area under the curve.
        found: number at the end.
        false: number of found targets that are none.
        all_found: whether all were found.
        terrain: number of the terrain; 0 in the first experiment.
        gospa_m: GOSPA at the end, cut-off 10 m.
        step_s: mean time of a step.
        sim_time_s: time from boot to the end.
    """

    completed: bool
    reason: str
    found_over_time: tuple[float, ...]
    area: float
    found: int
    false: int
    all_found: bool
    terrain: int
    gospa_m: float
    step_s: float
    sim_time_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchTrial:
    """One search of an experiment by a planner.

    Attributes:
        planning: of the exploring planner.
    """

    planning: PlannerParameters = MultiTargetOptions().planning

    def __call__(self, cell: Cell, seed: int) -> Found:
        """Fly the search. The same seed has the same targets and the same sensor noise for all planners."""
        experiment, planner = EXPERIMENTS[cell.experiment], PLANNERS[cell.planner]
        _, run = run_of(seed)
        options = MultiTargetOptions(
            steps=experiment.steps,
            planner=planner,
            # the baselines plan as the paper's
            planning=self.planning if planner is PlannerKind.EXPLORING else replace(self.planning, horizon=1),
            estimator=MultiTargetParameters(
                **edges(experiment.area_m), expected_targets=float(experiment.targets), seed=run
            ),
        )
        world = WorldSpec.of_team(1, seed=seed)
        number = 0
        if cell.experiment == "E2":
            number = run % MAPS
            world = terrain_targets_world(
                world, options, number, count=experiment.targets, clusters=experiment.clusters
            )
        field = TargetField(count=experiment.targets, clusters=experiment.clusters, scan_period_s=STEP_S)
        world = multi_target_world(world, options, field)
        result = fly_trial("multi-target", RunRequest(options=options, world=world))
        return _row(experiment, result.summary, result.outcome == "completed", result.reason, number)


def _row(
    experiment: Experiment, summary: Mapping[str, Any], completed: bool, reason: str, terrain: int
) -> Found:
    rises = np.array(summary["found_right_s"] or [], dtype=np.float64).reshape(-1, 2)
    index = np.searchsorted(rises[:, 0], experiment.time_s, side="right")
    found = np.concatenate(([0.0], rises[:, 1]))[index]
    right = int(summary["targets_found_right"])
    return Found(
        completed=completed,
        reason=reason,
        found_over_time=tuple(found.tolist()),
        area=float(np.mean(found)) / experiment.targets,
        found=right,
        false=int(summary["targets_found"]) - right,
        all_found=right == experiment.targets,
        terrain=terrain,
        gospa_m=float(summary["gospa_end_m"]),
        step_s=float(summary["step_s_mean"] or math.nan),
        sim_time_s=float(summary["sim_time_s"]),
    )
