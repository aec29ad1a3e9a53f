"""Home: who sets it, where it is in the local frame, and when arming moves it."""

import math

import pytest

from autopilot_bridge.commander.events import Event, HomeSet
from autopilot_bridge.commander.home import Home
from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.parameters import ParameterStore
from flightsim.airframe import AirframeKind
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from tests.commander.rig import ORIGIN


class Place:
    """A vehicle at a place in the local frame, and its home."""

    def __init__(self, *ned_m: float, yaw_rad: float = 0.5) -> None:
        flavour = get_flavour("px4", AirframeKind.MULTICOPTER)
        store = ParameterStore(flavour.parameter_definitions(), {})
        self.context = FlightContext(parameters=flavour.flight_parameters(store))
        self.context.frame = LocalFrame(ORIGIN)
        self.events: list[Event] = []
        self.home = Home(self.context, self.events.append)
        self.move(*(ned_m or (1.0, 2.0, -3.0)), yaw_rad=yaw_rad)

    def move(self, *ned_m: float, yaw_rad: float = 0.5) -> None:
        self.context.nav[nav.POS_NED_M] = ned_m
        self.context.nav[nav.EULER_RAD] = (0.1, 0.2, yaw_rad)

    @property
    def home_ned_m(self) -> tuple[float, ...]:
        return tuple(self.context.home_ned_m.tolist())


def near(*ned_m: float) -> object:
    return pytest.approx(ned_m, abs=1e-3)


def test_home_of_the_present_place_has_the_heading() -> None:
    place = Place()
    assert place.home.command_here()
    assert place.home_ned_m == near(1.0, 2.0, -3.0)
    assert place.home.yaw_rad == place.context.home_yaw_rad == 0.5
    (event,) = place.events
    assert isinstance(event, HomeSet) and event.home == place.home.position


def test_a_commanded_home_has_no_heading() -> None:
    place = Place()
    assert place.home.command(ORIGIN.lat_deg, ORIGIN.lon_deg, ORIGIN.alt_m + 20.0)
    assert place.home_ned_m == near(0.0, 0.0, -20.0)
    assert math.isnan(place.context.home_yaw_rad)


@pytest.mark.parametrize("commanded", [True, False])
def test_arming_moves_home_unless_a_client_has_set_it(commanded: bool) -> None:
    place = Place()
    assert not place.home.commanded
    if commanded:
        place.home.command(ORIGIN.lat_deg, ORIGIN.lon_deg, ORIGIN.alt_m)
    place.home.begin_flight()
    assert place.home_ned_m == (near(0.0, 0.0, 0.0) if commanded else near(1.0, 2.0, -3.0))
    assert place.home.command_here()  # holds until arming
    place.move(5.0, 6.0, -7.0)
    place.home.begin_flight()
    assert place.home_ned_m == near(5.0, 6.0, -7.0)


@pytest.mark.parametrize("ned_m", [(math.nan, 0.0, 0.0), (0.0, math.nan, 0.0), (0.0, 0.0, math.inf)])
def test_an_unknown_place_is_no_home(ned_m: tuple[float, ...]) -> None:
    place = Place(*ned_m)
    assert not place.home.command_here() and place.home.position is None and place.events == []


def test_without_a_frame_nothing_is_home() -> None:
    place = Place()
    place.context.frame = None
    assert not place.home.command_here() and not place.home.command(47.0, 8.0, 500.0)
    assert place.home.position is None


def test_an_invalid_place_changes_nothing() -> None:
    place = Place()
    place.home.command_here()
    before = place.home.position
    assert not place.home.command(91.0, 8.0, 500.0)
    assert place.home.position == before and not place.home.commanded and len(place.events) == 1


@pytest.mark.parametrize(
    ("moved_m", "settled", "once_a_second", "follows"),
    [
        (0.11, False, True, True),
        (0.09, False, True, False),
        (0.11, True, True, False),
        (0.11, False, False, False),
        (-0.11, False, True, True),
    ],
)
def test_before_arming_home_follows_a_position_that_still_settles(
    moved_m: float, settled: bool, once_a_second: bool, follows: bool
) -> None:
    for axis in range(3):
        place = Place(0.0, 0.0, 0.0)
        place.home.settle(settled=settled, once_a_second=once_a_second)
        assert place.home_ned_m == near(0.0, 0.0, 0.0)  # the first time at once
        there = [0.0, 0.0, 0.0]
        there[axis] = moved_m
        place.move(*there)
        place.home.settle(settled=settled, once_a_second=once_a_second)
        assert len(place.events) == (2 if follows else 1)


def test_a_commanded_home_does_not_settle() -> None:
    place = Place()
    place.home.command(ORIGIN.lat_deg, ORIGIN.lon_deg, ORIGIN.alt_m)
    place.home.settle(settled=False, once_a_second=True)
    assert len(place.events) == 1


def test_home_keeps_its_place_on_earth_when_the_origin_moves() -> None:
    place = Place(0.0, 0.0, 0.0)
    place.home.command_here()
    place.home.follow_frame()
    place.context.home_ned_m[:] = 77.0  # the same frame: nothing to update
    place.home.follow_frame()
    assert place.home_ned_m == (77.0, 77.0, 77.0)
    higher = GeodeticPosition(lat_deg=ORIGIN.lat_deg, lon_deg=ORIGIN.lon_deg, alt_m=ORIGIN.alt_m + 10.0)
    place.context.frame = LocalFrame(higher)
    place.home.follow_frame()
    assert place.home_ned_m == near(0.0, 0.0, 10.0)
