"""Planners of the multi-target search in a closed loop of sensor, filter and planner, without a flight.

    python -m benchmarks.search_planners [--runs 24] [--seed 100] [--jobs 2] [--experiment E1]

A point moves one step of 9 m to each planned place and takes one scan there, as in the paper's simulations.
The worlds are those of the study `multi-target --points`; run k has the seed SEED + k, and no seed is one of
the study's.

`area` is the mean share of the targets that are found over the search. Its difference from that of the
paper's information alone has a 95 % interval over the pairs of runs. `behind` is the largest lead of
information alone in the mean share of found targets, after the first tenth of the steps.
"""

import argparse
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.multi_target.search_belief import SearchBelief
from estimators.tracking.range_bearing import Viewpoint
from flightsim.foundation.geodetic_position import NorthEast
from missions.multi_target.options import MultiTargetOptions, PlannerKind
from missions.multi_target.planner import SearchPlanner
from missions.multi_target.search import planner_of
from missions.multi_target.world_searchers import search_with_point
from missions.search.planner_parameters import Exploration
from missions.studies.multi_target_trial import EXPERIMENTS
from missions.studies.statistics import paired_difference

Array = NDArray[np.float64]

_BASELINE: Final = "information alone"
_PLANNERS: Final[Mapping[str, Mapping[str, Any]]] = {
    _BASELINE: {"planner": PlannerKind.INFORMATION, "horizon": 1},
    "lawnmower": {"planner": PlannerKind.SWEEP},
    "paper": {"exploration": Exploration.PLACE, "alpha": 1.0, "horizon": 1},
    "paper, 3 steps": {"exploration": Exploration.PLACE, "alpha": 1.0},
    "revisit": {"planner": PlannerKind.REVISIT},
    "ergodic": {"planner": PlannerKind.ERGODIC},
    "default": {},
    "default, alpha 1": {"alpha": 1.0},
    "default, alpha 0.1": {"alpha": 0.1},
    "default, 1 step": {"horizon": 1},
    "default, 5 steps": {"horizon": 5},
    "default, beam 12": {"beam": 12},
}


@dataclass(frozen=True, slots=True)
class Searched:
    """Share of the targets that are found after each step, false ones at the end, and mean time of a plan."""

    found: Array
    false: int
    plan_ms: float


class Timed:
    """A planner that measures its time."""

    def __init__(self, planner: SearchPlanner) -> None:
        self._planner = planner
        self.total_s = 0.0

    def next_place(
        self, belief: SearchBelief, here: NorthEast, direction_rad: float | None, others: Sequence[Viewpoint]
    ) -> NorthEast:
        began_s = time.perf_counter()
        there = self._planner.next_place(belief, here, direction_rad, others)
        self.total_s += time.perf_counter() - began_s
        return there


def search(name: str, experiment: str, seed: int) -> Searched:
    """One search."""
    tried, changes = EXPERIMENTS[experiment], dict(_PLANNERS[name])
    kind = changes.pop("planner", PlannerKind.EXPLORING)
    options = tried.options(kind, replace(MultiTargetOptions().planning, **changes), seed=seed)
    world = tried.world(options, seed)
    timed = Timed(planner_of(options))
    done = search_with_point(options, world, timed)
    right = done.score.right
    return Searched(
        right / len(world.targets),
        len(done.belief.found) - int(right[-1]),
        1e3 * timed.total_s / options.steps,
    )


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=24)
    parser.add_argument("--seed", type=int, default=100)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--experiment", choices=list(EXPERIMENTS), action="append")
    given = parser.parse_args()
    seeds = range(given.seed, given.seed + given.runs)
    out = sys.stdout.write
    with ProcessPoolExecutor(given.jobs) as pool:
        for experiment in given.experiment or EXPERIMENTS:
            out(f"{experiment}, {given.runs} runs\n")
            out(f"{'planner':<22} {'area':>5} {'difference [95 %]':>22} behind  all  false  plan\n")
            base: Array | None = None
            for name in _PLANNERS:
                runs = list(pool.map(partial(search, name, experiment), seeds))
                found = np.array([run.found for run in runs])
                base = found if base is None else base
                areas, lead = found.mean(axis=1), (base - found).mean(axis=0)
                difference = paired_difference(areas, base.mean(axis=1))
                low, high = difference.ci95
                interval = f"[{low:+.3f}, {high:+.3f}]"
                out(
                    f"{name:<22} {areas.mean():5.3f} {difference.mean:+6.3f} {interval:>15} "
                    f"{max(0.0, lead[found.shape[1] // 10 :].max()):6.2f} "
                    f"{100.0 * (found[:, -1] == 1.0).mean():3.0f}% "
                    f"{np.mean([run.false for run in runs]):5.2f} "
                    f"{np.mean([run.plan_ms for run in runs]):5.1f} ms\n"
                )
                sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
