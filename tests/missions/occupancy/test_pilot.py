"""Legs, headings in the wind, and a team of point masses that finds its target."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimators.tracking.grid import GridLayout
from missions.occupancy.decision import Decision
from missions.occupancy.parameters import DecisionParameters, SearchParameters
from missions.occupancy.pilot import Motion, Pilot, heading_for_course
from missions.occupancy.search import Search
from tests.missions.occupancy.point_mass import Aircraft


@given(course=st.floats(-10.0, 10.0), wind_n=st.floats(-15.0, 15.0), wind_e=st.floats(-15.0, 15.0))
def test_heading_makes_the_course_over_ground(course, wind_n, wind_e):
    heading = heading_for_course(course, 25.0, (wind_n, wind_e))
    north, east = 25.0 * math.cos(heading) + wind_n, 25.0 * math.sin(heading) + wind_e
    assert 0.0 <= heading <= math.tau
    assert math.remainder(math.atan2(east, north) - course, math.tau) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("airspeed", "wind"), [(0.0, (3.0, 4.0)), (25.0, (0.0, 0.0))])
def test_without_wind_or_airspeed_the_heading_is_the_course(airspeed, wind):
    assert heading_for_course(1.2, airspeed, wind) == pytest.approx(1.2)


def test_more_cross_wind_than_airspeed_is_no_error():
    assert math.isfinite(heading_for_course(0.0, 10.0, (0.0, 30.0)))


def new_search(searchers: int = 1, cell_m: float = 200.0, size_m: float = 2000.0) -> Search:
    layout = GridLayout.over(width_m=size_m, height_m=size_m, cell_m=cell_m, centre_ne_m=(0.0, 0.0))
    return Search(
        layout, SearchParameters(), [DecisionParameters(heading_penalty=0.2)] * searchers, noise_nt=0.5
    )


def motion(time_s: float, north_m: float, east_m: float, velocity=(25.0, 0.0)) -> Motion:
    return Motion(
        time_us=round(time_s * 1e6), north_m=north_m, east_m=east_m, vel_ne_m_s=velocity, yaw_rad=0.0
    )


def test_flies_to_its_start_and_then_from_cell_to_cell():
    pilot = Pilot(new_search(), 0, start_ne_m=(500.0, 0.0))
    first = pilot.update(motion(0.0, 0.0, 0.0))
    assert first is not None
    assert first.heading_rad == pytest.approx(0.0)
    assert pilot.update(motion(5.0, 125.0, 0.0)) is None
    second = pilot.update(motion(18.0, 450.0, 0.0))
    assert second is not None
    assert math.dist(second.goal_ne_m, (450.0, 0.0)) < 300.0
    assert [command.time_us for command in pilot.commands] == [0, 18_000_000]


def test_a_cell_passed_abeam_is_done():
    pilot = Pilot(new_search(), 0, start_ne_m=(500.0, 0.0))
    pilot.update(motion(0.0, 0.0, 0.0))
    assert pilot.update(motion(18.0, 490.0, 150.0)) is None
    assert pilot.update(motion(21.0, 560.0, 150.0)) is not None


def test_a_cell_that_is_never_reached_is_given_up():
    pilot = Pilot(new_search(), 0, start_ne_m=(500.0, 0.0))
    pilot.update(motion(0.0, 0.0, 0.0))
    assert pilot.update(motion(50.0, 100.0, 0.0)) is None
    assert pilot.update(motion(53.0, 100.0, 0.0)) is not None


def test_at_rest_the_nose_is_the_course():
    hovering = Motion(time_us=0, north_m=0.0, east_m=0.0, vel_ne_m_s=(0.1, -0.1), yaw_rad=1.0)
    assert hovering.course_rad == 1.0


class Passes:
    """A search that assigns one pass, whose begin is right behind the searcher."""

    def __init__(self, legs):
        self.legs, self.wanted = list(legs), True
        self.map = new_search().map

    def next_leg(self, searcher, time_us, *, done):
        return self.legs.pop(0) if self.legs and (done or len(self.legs) == 2) else None

    def flies_pass(self, searcher):
        return self.wanted

    def next_cell(self, searcher, north_m, east_m, heading_rad):
        self.wanted = False
        return Decision(cell=(0, 0), heading_rad=0.0, utility=0.0)


def fly_pass(search, *, until_s=60.0, wind=(0.0, 5.0)):
    """Track (n, 2) of an aircraft that turns with a radius of 90 m."""
    pilot = Pilot(search, 0, start_ne_m=(1000.0, 0.0))
    place, heading_rad, wanted_rad, track = np.zeros(2), 0.0, 0.0, []
    for k in range(round(until_s / 0.1)):
        most = 0.1 * 25.0 / 90.0
        heading_rad += float(np.clip(math.remainder(wanted_rad - heading_rad, math.tau), -most, most))
        velocity = 25.0 * np.array([math.cos(heading_rad), math.sin(heading_rad)]) + wind
        place = place + 0.1 * velocity
        track.append(place)
        now = Motion(
            time_us=k * 100_000, north_m=place[0], east_m=place[1], vel_ne_m_s=tuple(velocity),
            yaw_rad=heading_rad, airspeed_m_s=25.0, wind_ne_m_s=wind,
        )  # fmt: skip
        command = pilot.update(now)
        if command is not None:
            wanted_rad = command.heading_rad
    return pilot, np.array(track)


@pytest.mark.parametrize("side_m", [-40.0, 40.0])
def test_a_pass_is_flown_over_its_suspect_though_a_turn_precedes_it(side_m):
    """The turn back leaves the aircraft two radii beside the line; one heading would pass that far off."""
    pilot, track = fly_pass(Passes([(20.0, side_m), (-580.0, 0.0)]))
    suspect = (-280.0, 0.5 * side_m)
    assert np.hypot(*(track - suspect).T).min() < 90.0
    assert len(pilot.commands) > 3


def test_a_pass_over_a_suspect_that_was_decided_is_left_at_once():
    search = Passes([(500.0, 0.0), (1100.0, 0.0)])
    pilot = Pilot(search, 0, start_ne_m=(1000.0, 0.0))
    pilot.update(motion(0.0, 0.0, 0.0))
    assert pilot.update(motion(1.0, 25.0, 0.0)).goal_ne_m == (500.0, 0.0)
    assert pilot.update(motion(2.0, 50.0, 0.0)) is None
    search.legs, search.wanted = [], False
    assert pilot.update(motion(3.0, 75.0, 0.0)).goal_ne_m == search.map.layout.centre_of((0, 0))


@pytest.mark.parametrize("wind", [(0.0, 0.0), (-4.0, 3.0)])
@pytest.mark.parametrize("target", [(700.0, -600.0), (-450.0, 820.0)])
@pytest.mark.sampled(2)
def test_team_finds_the_target_and_converges_on_it(wind, target):
    search = new_search(3)
    team = [
        Aircraft(
            search,
            k,
            (500.0 * math.cos(math.tau * k / 3), 500.0 * math.sin(math.tau * k / 3)),
            wind_ne_m_s=wind,
        )
        for k in range(3)
    ]
    for step in range(9000):
        for aircraft in team:
            aircraft.step(step * 100_000, target)
        if search.found is not None:
            break
    assert search.found is not None
    assert math.dist(search.found.place_ne_m, target) < 150.0
    assert search.found.passes >= 2
    assert 0.0 < search.map.probability_of_detection < 1.0
    farthest = max(float(np.abs(np.array(aircraft.track)).max()) for aircraft in team)
    assert farthest < 1500.0  # never far off the map
