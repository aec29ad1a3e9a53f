"""Planners without I/O: neighbours, borders, ties, information and exploration, horizon, teams, sweeps."""

import math

import numpy as np
import pytest

from estimators.multi_target.parameters import MultiTargetParameters
from estimators.multi_target.search_belief import SearchBelief
from estimators.tracking.information import detection_information
from estimators.tracking.range_bearing import Viewpoint
from missions.errors import PlanError
from missions.multi_target.objective import SearchObjective
from missions.multi_target.options import MultiTargetOptions, PlannerKind
from missions.multi_target.planner import ExploringPlanner
from missions.multi_target.search import TargetSearch
from missions.search.area import Area
from missions.search.planner_parameters import Exploration, PlannerParameters
from missions.search.sweep import SweepPlanner, sweep_path
from tests.missions.held_options import with_fields

AREA = Area(south_m=0.0, west_m=0.0, north_m=200.0, east_m=200.0)
PARAMETERS = MultiTargetParameters(south_m=0.0, west_m=0.0, north_m=200.0, east_m=200.0)
HERE = (100.0, 100.0)


def belief():
    return SearchBelief(PARAMETERS)


def after_scan(scan, viewpoint=None):
    found = belief()
    found.observe(0, np.array(scan), viewpoint or Viewpoint(north_m=100.0, east_m=100.0))
    return found


def planner(seed=0, heading_rad=0.0, **values):
    return ExploringPlanner(PlannerParameters(**values), AREA, seed=seed, heading_rad=heading_rad)


def test_the_next_place_is_one_of_eight_neighbours_at_the_same_distance():
    places = {planner(seed).next_place(belief(), HERE, None, ()) for seed in range(60)}
    assert len(places) == 8  # an unexplored map has no preference
    assert all(math.dist(HERE, place) == pytest.approx(9.0) for place in places)


def test_places_outside_the_area_are_not_flown_to():
    for seed in range(20):
        north_m, east_m = planner(seed).next_place(belief(), (199.0, 1.0), None, ())
        assert AREA.contains(north_m, east_m)
    assert planner().next_place(belief(), (300.0, 50.0), None, ()) == (200.0, 50.0)  # back to the area


def test_information_leads_to_a_target_that_was_detected_from_afar():
    found = after_scan([[40.0, 0.0]])  # north
    place = planner(alpha=0.0).next_place(found, HERE, None, ())
    assert place == pytest.approx((109.0, 100.0))


def test_exploration_leads_away_from_what_was_seen():
    found = belief()
    for east_m in (60.0, 80.0, 100.0):
        found.observe(0, np.zeros((0, 2)), Viewpoint(north_m=100.0, east_m=east_m))
    assert planner().next_place(found, HERE, None, ())[1] > 100.0


def test_alpha_weighs_both():
    found = after_scan([[40.0, 0.0]])
    for east_m in (130.0, 115.0):  # unexplored is the west
        found.observe(0, np.zeros((0, 2)), Viewpoint(north_m=100.0, east_m=east_m))
    assert planner(alpha=0.0).next_place(found, HERE, None, ())[0] > 100.0
    assert planner(alpha=100.0).next_place(found, HERE, None, ())[1] < 100.0


def test_among_equal_values_it_flies_straight_on():
    found = SearchBelief(PARAMETERS)
    place = planner(alpha=0.0).next_place(found, HERE, math.radians(90.0), ())
    assert place == pytest.approx((100.0, 109.0))


def test_a_turn_limit_leaves_no_place_behind():
    for seed in range(30):
        found = planner(seed, turn_limit_rad=0.5 * math.pi).next_place(belief(), HERE, 0.0, ())
        assert found[0] >= 100.0 - 1e-9


def test_values_are_information_plus_alpha_times_exploration():
    found = after_scan([[20.0, 1.0], [30.0, -2.0]])
    objective = SearchObjective(found.sensor, found.intensity.points(), found.exploration, 0.7)
    places = np.array([[109.0, 100.0], [91.0, 91.0]])
    values = objective.values(objective.outlook(), places, np.zeros(2))
    north, east, mass = found.intensity.points()
    for value, (n, e) in zip(values, places, strict=True):
        probability = found.sensor.probability(north, east, Viewpoint(north_m=n, east_m=e))
        unexplored = float(found.exploration.at(np.array([n]), np.array([e]))[0])
        expected = detection_information(mass, probability) + 0.7 * unexplored
        assert value == pytest.approx(expected, rel=2e-3)  # the intensity is summed up in cells of a metre


def in_view(found, alpha=0.7):
    return SearchObjective(
        *(found.sensor, found.intensity.points(), found.exploration, alpha),
        kind=Exploration.VIEW,
        targets_per_m2=PARAMETERS.birth_per_m2,
    )


def undetected(found, viewpoint):
    """Expected number of targets that a scan detects for the first time, summed up over the cells."""
    layout, expected = found.exploration.layout, 0.0
    for row, north in enumerate(layout.centres()[0].ravel()):
        for column, east in enumerate(layout.centres()[1].ravel()):
            probability = found.sensor.probability(np.array([north]), np.array([east]), viewpoint)[0]
            left = found.exploration.undetected[row, column] * layout.cell_m**2
            expected += PARAMETERS.birth_per_m2 * left * probability
    return expected


def test_exploration_is_the_expected_number_of_first_detections():
    found = after_scan([[20.0, 1.0], [30.0, -2.0]])
    objective, view = in_view(found), Viewpoint(north_m=91.0, east_m=109.0, heading_rad=0.3)
    north, east, mass = found.intensity.points()
    (value,) = objective.values(objective.outlook(), np.array([[91.0, 109.0]]), np.array([0.3]))
    information = detection_information(mass, found.sensor.probability(north, east, view))
    assert value == pytest.approx(information + 0.7 * undetected(found, view), rel=2e-3)


def test_what_an_earlier_scan_detects_is_not_detected_for_the_first_time():
    found = belief()
    objective, first = in_view(found, alpha=1.0), Viewpoint(north_m=109.0, east_m=100.0)
    after = objective.after(objective.outlook(), first)
    (value,) = objective.values(after, np.array([[109.0, 100.0]]), np.zeros(1))
    found.exploration.look(first)
    assert value == pytest.approx(undetected(found, first), rel=1e-9)


def test_exploration_in_view_leads_where_more_of_the_area_is_in_view():
    """At the border, half of what the sensor sees is outside the area."""
    found = belief()
    place = ExploringPlanner(PlannerParameters(exploration=Exploration.VIEW), AREA).next_place(
        found, (9.0, 9.0), None, ()
    )
    assert place == pytest.approx((9.0 + 9.0 * math.sqrt(0.5), 9.0 + 9.0 * math.sqrt(0.5)))


def test_several_steps_sum_the_information_of_two_scans():
    """I(X; L1, L2) = I(X; L1) + I(X; L2 | L1); for L1 = "nothing" the second term has a thinned intensity."""
    found = after_scan([[25.0, 0.3]])
    objective = SearchObjective(found.sensor, found.intensity.points(), found.exploration, 0.0)
    first = Viewpoint(north_m=109.0, east_m=100.0)
    outlook = objective.after(objective.outlook(), first)
    north, east, mass = found.intensity.points()
    left = mass * (1.0 - found.sensor.probability(north, east, first))
    second = Viewpoint(north_m=118.0, east_m=100.0)
    expected = detection_information(left, found.sensor.probability(north, east, second))
    (value,) = objective.values(outlook, np.array([[118.0, 100.0]]), np.zeros(1))
    assert value == pytest.approx(expected, rel=2e-3)


def test_a_horizon_sees_what_one_step_does_not():
    """Everything near is explored; unexplored is only a corner that three steps come near to."""
    found = belief()
    north, east = found.exploration.layout.centres()
    found.exploration.undetected[:] = np.where((north < 82.0) & (east > 118.0), 1.0, 0.0)
    corner = pytest.approx((100.0 - 9.0 * math.sqrt(0.5), 100.0 + 9.0 * math.sqrt(0.5)))
    one = [planner(seed).next_place(found, HERE, None, ()) for seed in range(20)]
    three = [planner(seed, horizon=3, beam=64).next_place(found, HERE, None, ()) for seed in range(20)]
    assert all(place == corner for place in three)
    assert not all(place == corner for place in one)


def test_vehicles_that_plan_in_turn_do_not_look_at_the_same_place():
    found = after_scan([[30.0, 0.0]])
    other = Viewpoint(north_m=127.0, east_m=100.0)
    objective = SearchObjective(found.sensor, found.intensity.points(), found.exploration, 1.0)
    place = np.array([[118.0, 100.0]])
    alone = objective.values(objective.outlook(), place, np.zeros(1))
    shared = objective.values(objective.outlook([other]), place, np.zeros(1))
    assert shared[0] < 0.6 * alone[0]


def test_a_sweep_visits_its_path_step_by_step_and_comes_back():
    path = sweep_path(AREA, (10.0, 10.0), 1500.0, None)
    sweep = SweepPlanner(path, 9.0)
    here, places = (10.0, 10.0), []
    for _ in range(400):
        there = sweep.next_place(belief(), here, None, ())
        assert math.dist(here, there) <= 1.5 * 9.0 + 1e-9
        here = there
        places.append(there)
    assert all(AREA.contains(*place) for place in places)
    length = sum(math.dist(a, b) for a, b in zip(path.vertices_m, path.vertices_m[1:], strict=False))
    assert length <= 1500.0
    assert math.dist(path.vertices_m[0], (10.0, 10.0)) == min(
        math.dist(corner, (10.0, 10.0)) for corner in (path.vertices_m[0], path.vertices_m[-1])
    )


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"step_m": 0.0}, "`step_m` 0"),
        ({"alpha": -1.0}, "`alpha` -1"),
        ({"horizon": 9}, "`horizon` 9"),
        ({"beam": 0}, "`beam` 0"),
        ({"discount": 1.5}, "`discount` 1.5"),
        ({"turn_limit_rad": 0.1}, "turn_limit_rad"),
    ],
)
def test_impossible_parameters_are_named(values, reason):
    with pytest.raises(PlanError, match=reason):
        PlannerParameters(**values)


class Fixed:
    """A planner that goes north."""

    def next_place(self, belief, here, direction_rad, others):
        self.others = others
        return here[0] + 9.0, here[1]


def search_of(**values):
    options = with_fields(MultiTargetOptions(), **values)
    found = SearchBelief(options.estimator)
    planners = [Fixed() for _ in range(options.vehicles)]
    return TargetSearch(found, [options] * options.vehicles, planners), found, planners


def observe(search, found, second):
    found.observe(second * 1_000_000, np.zeros((0, 2)), Viewpoint(north_m=10.0, east_m=10.0))
    search.scanned(second * 1_000_000, ())


def test_a_step_needs_a_scan_since_the_last_one():
    search, found, _ = search_of()
    assert search.begin(0, 0) == (10.0, 10.0)
    assert not search.may_step(0)
    observe(search, found, 1)
    assert search.may_step(0)
    assert search.step(0, 1_000_000, (10.0, 10.5)) == (19.0, 10.0)
    assert not search.may_step(0)


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"steps": 3}, "all steps are taken"),
        ({"search_time_s": 5.0}, "the search time is over"),
        ({"undetected": 17.0, "expected_targets": 1.0}, "targets are expected to be left"),
    ],
)
def test_the_search_ends_by_steps_time_or_what_is_left(values, reason):
    search, found, _ = search_of(**values)
    here = search.begin(0, 0)
    for second in range(1, 60):
        observe(search, found, second)
        if search.over:
            break
        here = search.step(0, second * 1_000_000, here)
    assert reason in search.reason


def test_each_vehicle_is_told_the_goals_of_the_others():
    search, found, planners = search_of(vehicles=2)
    search.begin(0, 0)
    search.begin(1, 0)
    observe(search, found, 1)
    there = search.step(0, 1, (10.0, 10.0))
    search.step(1, 1, (10.0, 19.0))
    assert [(v.north_m, v.east_m) for v in planners[1].others] == [there]
    search.leave(0)
    observe(search, found, 2)
    search.step(1, 2, (10.0, 19.0))
    assert planners[1].others == []


def test_the_sweep_of_a_team_has_a_strip_for_each():
    search = TargetSearch(
        belief(),
        [MultiTargetOptions(planner=PlannerKind.SWEEP, vehicles=2, index=k, steps=100) for k in (0, 1)],
    )
    firsts = [search.begin(k, 0) for k in (0, 1)]
    assert firsts[0] != firsts[1]
