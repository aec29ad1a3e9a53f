"""Which reported home the places of a flight are measured from."""

from typing import Final

from autopilot_bridge.mavlink import dialect
from flightsim.foundation.geodesy import GeodeticPosition
from missions.vehicle.flight_home import FlightHome

PARKED: Final = GeodeticPosition(lat_deg=47.0, lon_deg=8.0, alt_m=488.0)
LINED_UP: Final = GeodeticPosition(lat_deg=47.001, lon_deg=8.0, alt_m=488.0)
LIFTED_OFF: Final = GeodeticPosition(lat_deg=47.002, lon_deg=8.0, alt_m=489.0)
ON_GROUND: Final = dialect.MAV_LANDED_STATE_ON_GROUND
TAKEOFF: Final = dialect.MAV_LANDED_STATE_TAKEOFF
IN_AIR: Final = dialect.MAV_LANDED_STATE_IN_AIR


def armed_home() -> FlightHome:
    """Of a vehicle that stands armed, with the home of its arming."""
    home = FlightHome()
    home.on_home(PARKED, armed=False)
    home.on_landed_state(ON_GROUND)
    home.on_home(LINED_UP, armed=True)
    home.on_landed_state(ON_GROUND)
    return home


def test_arming_moves_it_and_the_lift_off_does_not() -> None:
    home = armed_home()
    assert home.place == LINED_UP
    home.on_home(LIFTED_OFF, armed=True)  # before the landed state says so
    assert home.place == LINED_UP
    home.on_landed_state(TAKEOFF)
    home.on_home(LIFTED_OFF, armed=True)
    home.on_landed_state(IN_AIR)
    assert home.place == LINED_UP


def test_the_next_flight_has_the_home_that_is_reported_on_the_ground() -> None:
    home = armed_home()
    home.on_landed_state(IN_AIR)
    home.on_home(LIFTED_OFF, armed=True)
    home.on_landed_state(IN_AIR)
    home.on_landed_state(ON_GROUND)
    assert home.place == LINED_UP
    home.on_home(LIFTED_OFF, armed=False)
    assert home.place == LIFTED_OFF


def test_a_vehicle_met_in_the_air_has_the_home_that_it_reports_first() -> None:
    home = FlightHome()
    home.on_landed_state(IN_AIR)
    home.on_home(PARKED, armed=True)
    home.on_home(LIFTED_OFF, armed=True)
    home.on_landed_state(IN_AIR)
    assert home.place == PARKED


def test_without_a_landed_state_the_newest_home_counts() -> None:
    home = FlightHome()
    home.on_home(PARKED, armed=True)
    home.on_home(LIFTED_OFF, armed=True)
    assert home.place == LIFTED_OFF
