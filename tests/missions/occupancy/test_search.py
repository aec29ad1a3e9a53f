"""Map, decisions and the team's search (Lum et al. 2005, section IV)."""

import math

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.occupancy.detection import Anomaly, DetectionModel
from estimators.occupancy.occupancy_map import OccupancyMap
from estimators.tracking.grid import GridLayout
from missions.errors import PlanError
from missions.occupancy.decision import decide
from missions.occupancy.parameters import DecisionParameters, SearchParameters
from missions.occupancy.search import Search


def layout(rows: int = 10, columns: int = 10, cell_m: float = 100.0) -> GridLayout:
    return GridLayout(south_m=0.0, west_m=0.0, cell_m=cell_m, rows=rows, columns=columns)


def anomaly(north_m: float, east_m: float, time_us: int = 0, peak_nt: float = 5.0) -> Anomaly:
    return Anomaly(time_us=time_us, north_m=north_m, east_m=east_m, peak_nt=peak_nt, samples=3)


def test_cells_and_places_correspond():
    grid = GridLayout.over(width_m=1000.0, height_m=800.0, cell_m=100.0, centre_ne_m=(50.0, -20.0))
    assert (grid.rows, grid.columns) == (8, 10)
    for cell in [(0, 0), (7, 9), (3, 4)]:
        assert grid.cell_at(*grid.centre_of(cell)) == cell
    assert grid.cell_at(-1e6, 1e6) == (0, 9)
    assert not grid.contains(grid.north_m + 1.0, 0.0)


@pytest.mark.parametrize("cell_m", [0.0, -5.0, math.nan, 900.0, 0.5])
def test_cells_that_make_no_map_are_refused_by_name(cell_m):
    with pytest.raises(EstimatorError, match="`cell_m`"):
        GridLayout.over(width_m=1000.0, height_m=1000.0, cell_m=cell_m, centre_ne_m=(0.0, 0.0))


@pytest.mark.parametrize(
    "bad", [np.zeros((10, 10)), np.full((10, 10), np.nan), -np.ones((10, 10)), np.ones((3, 3))]
)
def test_map_without_data_is_refused(bad):
    with pytest.raises(EstimatorError, match="prior"):
        OccupancyMap(layout(), bad)


def test_no_detection_lowers_scores_by_the_probability_of_missing():
    occupancy = OccupancyMap(layout())
    model = DetectionModel(probability_overhead=0.9, range_m=40.0)
    before = occupancy.scores.copy()
    occupancy.search((550.0, -1000.0), (550.0, 2000.0), model)
    ratio = occupancy.scores / before
    assert ratio[5] == pytest.approx(np.full(10, 0.1), abs=1e-3)  # flown over
    assert ratio[0] == pytest.approx(np.ones(10), abs=1e-6)  # far away
    assert occupancy.probability_of_detection == pytest.approx(1.0 - float(occupancy.belief.mass.sum()))
    assert 0.09 < occupancy.probability_of_detection < 0.2


def test_raising_changes_scores_within_the_radius_only():
    occupancy = OccupancyMap(layout())
    before = occupancy.scores.copy()
    occupancy.raise_around(550.0, 550.0, radius_m=250.0, height=3.0)
    assert occupancy.scores[5, 5] == pytest.approx(before[5, 5] + 3.0 / 100.0)
    assert occupancy.scores[5, 9] == before[5, 9]
    assert occupancy.probability_of_detection == pytest.approx(0.0, abs=1e-12)


def test_with_equal_scores_the_smallest_turn_is_chosen():
    decision = decide(
        OccupancyMap(layout()),
        north_m=550.0,
        east_m=550.0,
        heading_rad=math.radians(88.0),
        parameters=DecisionParameters(),
    )
    assert decision.cell == (5, 6)
    assert decision.heading_rad == pytest.approx(math.radians(90.0))


def test_heading_difference_is_wrapped():
    decision = decide(
        OccupancyMap(layout()),
        north_m=550.0,
        east_m=550.0,
        heading_rad=math.radians(359.0),
        parameters=DecisionParameters(),
    )
    assert decision.cell == (6, 5)


@pytest.mark.parametrize(("penalty", "cell"), [(0.01, (5, 4)), (50.0, (5, 6))])
def test_penalty_decides_between_score_and_turn(penalty, cell):
    occupancy = OccupancyMap(layout())
    occupancy.scores[5, 4] *= 3.0  # behind
    decision = decide(
        occupancy,
        north_m=550.0,
        east_m=550.0,
        heading_rad=math.radians(90.0),
        parameters=DecisionParameters(heading_penalty=penalty),
    )
    assert decision.cell == cell


def test_utility_is_equation_9():
    occupancy = OccupancyMap(layout())
    occupancy.scores[6, 6] *= 2.0
    parameters = DecisionParameters(heading_penalty=0.5)
    decision = decide(
        occupancy, north_m=550.0, east_m=550.0, heading_rad=math.radians(90.0), parameters=parameters
    )
    assert decision.cell == (6, 6)
    assert decision.utility == pytest.approx(2.0 - 0.5 * 45.0 / 180.0)


def test_wider_neighbourhood_sees_farther():
    occupancy = OccupancyMap(layout())
    occupancy.scores[8, 5] *= 10.0
    where = {"north_m": 550.0, "east_m": 550.0, "heading_rad": math.radians(180.0)}
    near = decide(occupancy, **where, parameters=DecisionParameters(heading_penalty=0.1))
    far = decide(occupancy, **where, parameters=DecisionParameters(heading_penalty=0.1, neighbourhood=3))
    assert near.cell == (4, 5)
    assert far.cell == (8, 5)


def test_off_the_map_it_leads_back():
    decision = decide(
        OccupancyMap(layout()),
        north_m=-300.0,
        east_m=550.0,
        heading_rad=math.radians(180.0),
        parameters=DecisionParameters(),
    )
    assert math.cos(decision.heading_rad) > 0.0


@pytest.mark.parametrize("values", [{"neighbourhood": 0}, {"neighbourhood": 21}, {"heading_penalty": 0.0}])
def test_bad_habits_are_refused_by_name(values):
    name = next(iter(values))
    with pytest.raises(PlanError, match=f"`{name}`"):
        DecisionParameters(**values)


def search(searchers: int = 2, **parameters) -> Search:
    return Search(layout(), SearchParameters(**parameters), [DecisionParameters()] * searchers, noise_nt=0.5)


def test_two_passes_over_one_place_find_the_target():
    team = search()
    team.report_anomaly(0, anomaly(500.0, 500.0, 10))
    assert team.found is None
    team.report_anomaly(1, anomaly(900.0, 900.0, 20))
    assert team.found is None
    team.report_anomaly(1, anomaly(520.0, 480.0, 30, peak_nt=15.0))
    assert team.found is not None
    assert team.found.place_ne_m == pytest.approx((515.0, 485.0))
    assert team.found_us == 30


def test_anomaly_off_the_map_is_no_candidate():
    team = search(confirmations=1)
    team.report_anomaly(0, anomaly(-500.0, 500.0))
    assert team.found is None
    assert team.candidates == []


def test_identified_place_draws_the_other_searcher_but_not_a_far_one():
    team = search(3)
    team.next_cell(0, 550.0, 550.0, 0.0)
    team.report_anomaly(0, anomaly(550.0, 650.0))
    near = team.next_cell(1, 550.0, 850.0, 0.0)
    far = team.next_cell(2, 50.0, 50.0, 0.0)
    assert near.cell == (5, 7)  # turns to the west, to the raised cells
    assert far.cell == (1, 0)  # straight on


def test_cell_of_another_searcher_is_left_to_it():
    team = search()
    first = team.next_cell(0, 550.0, 550.0, math.radians(90.0))
    second = team.next_cell(1, 550.0, 550.0, math.radians(90.0))
    assert first.cell != second.cell
    team.leave(0)
    assert team.next_cell(1, 550.0, 550.0, math.radians(90.0)).cell == first.cell


def test_track_lowers_scores_once_and_not_where_something_is_seen():
    team = search(1, detection_range_m=60.0)
    for step in range(100):
        team.report_place(0, step * 100_000, 550.0, 10.0 * step, anomalous=400.0 <= 10.0 * step <= 600.0)
    scores = team.map.scores * 100.0
    assert scores[5, 1] < 0.2
    assert scores[5, 4] > 0.5  # the anomaly's own stretch was not searched in vain
    assert [time for time, _ in team.detection_curve] == sorted(time for time, _ in team.detection_curve)


def test_team_covers_the_map_with_a_simple_aircraft():
    """Point masses that turn at 20 deg/s: most of a map is searched in the time a sweep would need twice."""
    team = Search(layout(8, 8), SearchParameters(), [DecisionParameters()] * 2, noise_nt=0.5)
    states = [(50.0, 50.0, 0.0), (50.0, 650.0, 0.0)]
    commands = [team.next_cell(k, *state).heading_rad for k, state in enumerate(states)]
    for step in range(2400):
        for k, (north, east, heading) in enumerate(states):
            if step % 20 == 10 * k:
                commands[k] = team.next_cell(k, north, east, heading).heading_rad
            turn = math.remainder(commands[k] - heading, math.tau)
            heading += min(0.035, max(-0.035, turn))
            states[k] = (north + 2.0 * math.cos(heading), east + 2.0 * math.sin(heading), heading)
            team.report_place(k, step * 100_000, *states[k][:2])
    assert team.map.probability_of_detection > 0.8
