"""Planners of the multi-target search in a closed loop of sensor, filter and planner, without a flight.

    python -m benchmarks.search_planners [--runs 24] [--seed 100] [--jobs 2] [--experiment E1]

A point moves one step of 9 m to each planned place and takes one scan there, as in the paper's simulations.
The targets are drawn as in the first experiment of the study `multi-target` (E1), or as many in two clusters
in the area and with the steps of the second one (E2). All planners search for the same targets; run k has the
seed SEED + k, and no seed is one of the study's.

`area` is the mean share of the targets that are found over the search. Its difference from that of the
paper's information alone has a 95 % interval over the pairs of runs. `behind` is the largest lead of
information alone in the mean number of found targets, after the first tenth of the steps.
"""

import argparse
import math
import sys
import time
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.multi_target.parameters import MultiTargetParameters
from estimators.multi_target.search_belief import SearchBelief
from estimators.tracking.range_bearing import Viewpoint
from missions.multi_target.options import MultiTargetOptions, PlannerKind
from missions.multi_target.search import planner_of
from missions.multi_target.target_field import TargetField
from missions.multi_target.world import places_of
from missions.search.area import edges
from missions.search.planner_parameters import Exploration
from missions.studies.multi_target_trial import EXPERIMENTS, STEP_S
from missions.studies.statistics import paired_difference

Array = NDArray[np.float64]

_CORRECT_M: Final = 4.0  # a found target is correct within it
_BASELINE: Final = "information alone"
_PLANNERS: Final[Mapping[str, Mapping[str, object]]] = {
    _BASELINE: {"planner": PlannerKind.INFORMATION, "horizon": 1},
    "lawnmower": {"planner": PlannerKind.SWEEP},
    "paper": {"exploration": Exploration.PLACE, "alpha": 1.0, "horizon": 1},
    "paper, 3 steps": {"exploration": Exploration.PLACE, "alpha": 1.0},
    "default": {},
    "default, alpha 1": {"alpha": 1.0},
    "default, alpha 0.1": {"alpha": 0.1},
    "default, 1 step": {"horizon": 1},
    "default, 5 steps": {"horizon": 5},
    "default, beam 12": {"beam": 12},
}


@dataclass(frozen=True, slots=True)
class Searched:
    """Correctly found targets after each step, false ones at the end, and the mean time of a plan."""

    found: list[int]
    false: int
    plan_ms: float


def search(name: str, experiment: str, seed: int) -> Searched:
    """One search."""
    tried = EXPERIMENTS[experiment]
    changes: dict[str, Any] = dict(_PLANNERS[name])
    options = MultiTargetOptions(
        steps=tried.steps,
        planner=changes.pop("planner", PlannerKind.EXPLORING),
        planning=replace(MultiTargetOptions().planning, **changes),
        estimator=MultiTargetParameters(
            **edges(tried.area_m), expected_targets=float(tried.targets), seed=seed
        ),
    )
    rng = np.random.default_rng(np.random.SeedSequence([seed, 1]))
    field = TargetField(count=tried.targets, clusters=tried.clusters)
    targets = np.array(places_of(field, options.area, rng))
    belief, planner = SearchBelief(options.estimator), planner_of(options)
    here, direction_rad = options.own_start_ne_m, None
    counts, plan_s = [], 0.0
    for step in range(options.steps):
        start_s = time.perf_counter()
        there = planner.next_place(belief, here, direction_rad, ())
        plan_s += time.perf_counter() - start_s
        direction_rad, here = math.atan2(there[1] - here[1], there[0] - here[0]), there
        scan = _scan(targets - np.array(here), options, rng)
        belief.observe(round(1e6 * STEP_S * (step + 1)), scan, Viewpoint(north_m=here[0], east_m=here[1]))
        counts.append(_correct(belief, targets))
    return Searched(counts, len(belief.found) - counts[-1], 1e3 * plan_s / options.steps)


def _scan(offsets_m: Array, options: MultiTargetOptions, rng: np.random.Generator) -> Array:
    """Range and bearing of the detected targets, by the paper's sensor (its equation 3)."""
    distance_m = np.hypot(*offsets_m.T)
    known = options.estimator
    scaled = np.hypot(*(offsets_m / (known.forward_scale_m, known.right_scale_m)).T)
    seen = rng.random(len(offsets_m)) < known.gain * np.exp(-0.5 * scaled)
    seen &= distance_m <= known.range_m
    noise = rng.standard_normal((len(offsets_m), 2))
    ranges_m = np.abs(distance_m + known.range_sigma_m * noise[:, 0])
    bearings_rad = np.arctan2(offsets_m[:, 1], offsets_m[:, 0]) + known.bearing_sigma_rad * noise[:, 1]
    return np.column_stack((ranges_m, bearings_rad))[seen]


def _correct(belief: SearchBelief, targets: Array) -> int:
    """Number of true targets near a found one."""
    found = np.array([(target.north_m, target.east_m) for target in belief.found]).reshape(-1, 2)
    away_m = np.hypot(*(found[:, None] - targets[None]).transpose(2, 0, 1))
    return int((away_m < _CORRECT_M).any(axis=0).sum())


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
            total = EXPERIMENTS[experiment].targets
            out(f"{experiment}, {given.runs} runs\n")
            out(f"{'planner':<22} {'area':>5} {'difference [95 %]':>22} behind  all  false  plan\n")
            base: Array | None = None
            for name in _PLANNERS:
                runs = list(pool.map(partial(search, name, experiment), seeds))
                found = np.array([run.found for run in runs])
                base = found if base is None else base
                areas, lead = found.mean(axis=1) / total, (base - found).mean(axis=0)
                difference = paired_difference(areas, base.mean(axis=1) / total)
                low, high = difference.ci95
                interval = f"[{low:+.3f}, {high:+.3f}]"
                out(
                    f"{name:<22} {areas.mean():5.3f} {difference.mean:+6.3f} {interval:>15} "
                    f"{max(0.0, lead[found.shape[1] // 10 :].max()):6.2f} "
                    f"{100.0 * (found[:, -1] == total).mean():3.0f}% "
                    f"{np.mean([run.false for run in runs]):5.2f} "
                    f"{np.mean([run.plan_ms for run in runs]):5.1f} ms\n"
                )
                sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
