"""The standard atmosphere against the tables of ISO 2533."""

import math

import pytest

from flightsim.foundation.atmosphere import (
    air_density_kg_m3,
    air_density_ratio,
    pressure_altitude_m,
    standard_temperature_k,
    true_over_equivalent_airspeed,
)

# geopotential altitude m, pressure Pa, density kg/m^3
STANDARD_ATMOSPHERE = [
    (-500.0, 107_477.0, 1.2849),
    (0.0, 101_325.0, 1.22500),
    (500.0, 95_461.2, 1.16727),
    (1000.0, 89_874.6, 1.11164),
    (2000.0, 79_495.2, 1.00649),
    (5000.0, 54_019.9, 0.736116),
]


@pytest.mark.parametrize(("altitude", "pressure", "density"), STANDARD_ATMOSPHERE)
def test_pressure_altitude_density_and_true_airspeed_are_those_of_the_standard(altitude, pressure, density):
    assert pressure_altitude_m(pressure) == pytest.approx(altitude, abs=0.15)
    temperature = standard_temperature_k(pressure)
    assert temperature == pytest.approx(288.15 - 0.0065 * altitude, abs=0.002)
    assert air_density_kg_m3(pressure, temperature) == pytest.approx(density, rel=2e-5)
    assert air_density_ratio(pressure) == pytest.approx(density / 1.225, rel=2e-4)
    assert true_over_equivalent_airspeed(altitude) == pytest.approx(math.sqrt(1.225 / density), rel=1e-4)


@pytest.mark.parametrize("pressure", [0.0, -5.0, math.nan, math.inf, 3e5])
def test_values_that_are_no_pressure_of_the_atmosphere_have_no_altitude(pressure):
    assert math.isnan(pressure_altitude_m(pressure))


def test_six_hundred_metres_make_the_turn_six_percent_wider():
    assert true_over_equivalent_airspeed(600.0) ** 2 == pytest.approx(1.06, abs=2e-3)
