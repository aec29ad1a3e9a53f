"""The baselines of the planner: a sweep with detours, and ergodic coverage."""

import math
from dataclasses import replace

import numpy as np
import pytest

from estimators.multi_target.parameters import Belief
from estimators.multi_target.search_belief import SearchBelief
from estimators.tracking.range_bearing import Viewpoint
from missions.multi_target.ergodic import ErgodicPlanner
from missions.multi_target.options import MultiTargetOptions, PlannerKind
from missions.multi_target.revisit import RevisitPlanner
from missions.multi_target.search import planner_of
from missions.patterns.polyline import Polyline
from missions.search.area import Area

AREA = Area(south_m=0.0, west_m=0.0, north_m=200.0, east_m=200.0)


def belief_over(area, **known):
    options = MultiTargetOptions().estimator
    return SearchBelief(
        replace(
            options,
            south_m=area.south_m,
            west_m=area.west_m,
            north_m=area.north_m,
            east_m=area.east_m,
            **known,
        )
    )


def flown(planner, belief, steps, here=(10.0, 10.0)):
    places, direction = [], None
    for k in range(steps):
        there = planner.next_place(belief, here, direction, ())
        assert math.dist(here, there) <= 9.0 + 1e-9 and AREA.contains(*there)
        direction, here = math.atan2(there[1] - here[1], there[0] - here[0]), there
        belief.observe(k * 2_600_000, np.zeros((0, 2)), Viewpoint(north_m=here[0], east_m=here[1]))
        places.append(here)
    return np.array(places)


def test_ergodic_coverage_leaves_less_unseen_than_one_line():
    belief = belief_over(AREA)
    flown(ErgodicPlanner(AREA, 9.0), belief, 60)
    line = belief_over(AREA)
    for k in range(60):
        line.observe(k, np.zeros((0, 2)), Viewpoint(north_m=3.3 * k, east_m=100.0))
    assert belief.exploration.undetected_area_m2 < 0.75 * line.exploration.undetected_area_m2


def test_ergodic_coverage_goes_where_targets_are_expected():
    belief = belief_over(AREA)
    belief.exploration.undetected[:] = 0.0
    north, east, _ = belief.exploration.points()
    corner = (north > 150.0) & (east > 150.0)
    belief.exploration.undetected.ravel()[corner] = 1.0
    places = flown(ErgodicPlanner(AREA, 9.0), belief, 30)
    assert places[-1] == pytest.approx((175.0, 175.0), abs=45.0)


def test_ergodic_steps_turn_by_the_limit_at_most():
    belief = belief_over(AREA)
    planner, here, direction = ErgodicPlanner(AREA, 9.0, 0.5), (100.0, 100.0), 0.0
    for _ in range(5):
        there = planner.next_place(belief, here, direction, ())
        course = math.atan2(there[1] - here[1], there[0] - here[0])
        assert abs(math.remainder(course - direction, math.tau)) <= 0.5 + 1e-9
        direction, here = course, there


def test_the_sweep_leaves_its_path_for_a_detected_target_and_returns():
    belief = belief_over(AREA, found_width_m=0.1, belief=Belief.GAUSSIANS)
    planner = RevisitPlanner(Polyline(((0.0, 0.0), (180.0, 0.0))), 9.0)
    assert planner.next_place(belief, (0.0, 0.0), None, ()) == (0.0, 0.0)
    belief.observe(0, np.array([[30.0, 0.5 * math.pi]]), Viewpoint(north_m=0.0, east_m=0.0))
    (target,) = belief.candidates
    here, visits = (0.0, 0.0), 0
    for _ in range(20):
        here = planner.next_place(belief, here, None, ())
        visits += math.dist(here, (target.north_m, target.east_m)) < 5.0
    assert visits <= 5  # it is never found, so it is left after some scans
    assert here[1] == 0.0 and here[0] >= 9.0


@pytest.mark.parametrize(
    ("kind", "planner"), [(PlannerKind.ERGODIC, ErgodicPlanner), (PlannerKind.REVISIT, RevisitPlanner)]
)
def test_the_options_name_the_planner(kind, planner):
    assert isinstance(planner_of(MultiTargetOptions(planner=kind)), planner)
