"""The pitot tube of an aircraft that stands in the wind: what it reads before the wind is known is right."""

import pytest

from flightsim.environment import Environment, Turbulence
from tests.flights.aircraft import AircraftFlight


@pytest.mark.parametrize("launch", ["catapult", "runway"])
@pytest.mark.slow
def test_a_gust_on_the_ground_does_not_cost_the_airspeed(launch: str) -> None:
    wind = Environment.from_wind(speed_m_s=8.0, from_deg=0.0, turbulence=Turbulence.MODERATE)
    flight = AircraftFlight("px4", seed=3, launch=launch, environment=wind)
    flight.take_off(60.0)
    health = flight.vehicle.autopilot.navigation.health
    assert health.airspeed_in_use and not health.airspeed_synthetic
    assert health.wind_valid
