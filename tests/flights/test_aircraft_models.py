"""Aircraft of the `jsbsim` package take off and circle under our autopilot, with only their TOML."""

import math

import numpy as np
import pytest

from flightsim.environment import Environment, Turbulence
from tests.flights.aircraft import AircraftFlight
from tests.flights.aircraft_figures import equivalent_airspeed_m_s

WIND = Environment(wind_ned_m_s=(0.0, 6.0, 0.0), turbulence=Turbulence.LIGHT)


def takes_off_and_circles(flavour: str, model: str, height_m: float) -> None:
    flight = AircraftFlight(flavour, model=model, environment=WIND)
    parameters = flight.vehicle.autopilot.controller.parameters
    flight.start()
    flight.fly_until(lambda: flight.height_over_home_m > 20.0, 90.0, "climb")
    radius_m = abs(flight.vehicle.autopilot.context.fixed_wing.loiter_radius_m)
    place = flight.on_runway(2.0 * radius_m, 0.5 * radius_m)
    assert flight.circle(*place, height_m, radius_m) == 0, flight.texts
    slowest = [math.inf]

    def look() -> bool:
        slowest[0] = min(slowest[0], equivalent_airspeed_m_s(flight))
        here = abs(flight.distance_m(*place) - radius_m) < 0.05 * radius_m
        return here and abs(flight.height_over_home_m - height_m) < 3.0

    flight.fly_until(look, 200.0, "circle")
    turn_s = 2.0 * math.pi * radius_m / parameters.airspeed_trim_m_s
    flight.fly(0.5 * turn_s, look)
    radii, heights, speeds = [], [], []

    def watch() -> None:
        look()
        radii.append(flight.distance_m(*place))
        heights.append(flight.height_over_home_m)
        speeds.append(equivalent_airspeed_m_s(flight))

    flight.fly(turn_s, watch)
    assert np.max(np.abs(np.array(radii) - radius_m)) < 0.03 * radius_m
    assert np.mean(heights) == pytest.approx(height_m, abs=2.5) and np.std(heights) < 3.0
    assert np.mean(speeds) == pytest.approx(parameters.airspeed_trim_m_s, rel=0.03)
    assert slowest[0] > 1.05 * parameters.airspeed_stall_m_s
    assert flight.actuators_finite


@pytest.mark.slow
@pytest.mark.parametrize("model", ["aerosonde", "j3cub", "c172x", "t37"])
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_models_take_off_and_circle(flavour: str, model: str) -> None:
    takes_off_and_circles(flavour, model, 120.0)


@pytest.mark.slow
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_a_glider_is_launched_and_circles_down(flavour: str) -> None:
    """What its height allows: a circle at its best speed, sinking as a glider does."""
    flight = AircraftFlight(flavour, model="sgs126", environment=Environment(wind_ned_m_s=(0.0, 2.0, 0.0)))
    parameters = flight.vehicle.autopilot.controller.parameters
    flight.start()
    flight.fly_until(lambda: flight.height_over_home_m > 120.0, 60.0, "release")
    radius_m = abs(flight.vehicle.autopilot.context.fixed_wing.loiter_radius_m)
    assert flight.circle(*flight.on_runway(500.0, radius_m), 150.0, radius_m) == 0
    place = flight.on_runway(500.0, radius_m)
    flight.fly(60.0)
    radii, speeds, heights = [], [], []

    def watch() -> None:
        radii.append(flight.distance_m(*place))
        speeds.append(equivalent_airspeed_m_s(flight))
        heights.append(flight.height_over_home_m)

    flight.fly(30.0, watch)
    # a wing of 12 m that rolls slowly, two turns after its release
    assert np.max(np.abs(np.array(radii) - radius_m)) < 0.1 * radius_m
    assert np.mean(speeds) == pytest.approx(parameters.airspeed_trim_m_s, rel=0.05)
    assert 0.3 < (heights[0] - heights[-1]) / 30.0 < 2.5
