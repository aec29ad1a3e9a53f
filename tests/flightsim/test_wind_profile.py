"""Wind over height against the laws it claims, and as it reaches a vehicle."""

import math

import numpy as np
import pytest

from flightsim import truth as t
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.interface import MAX_ACTUATORS
from flightsim.vehicle import Vehicle
from flightsim.wind_profile import SURFACE_LAYER, WindLaw, WindProfile

OFF = np.zeros(MAX_ACTUATORS)
FT = 0.3048


@pytest.mark.parametrize("height_ft", [3.0, 20.0, 100.0, 1000.0])
def test_logarithmic_law_is_that_of_the_standard(height_ft: float) -> None:
    """MIL-F-8785C, 3.7.3.2: u = W20 ln(h / z0) / ln(20 ft / z0), z0 = 0.15 ft near the ground."""
    profile = WindProfile(law=WindLaw.LOGARITHMIC, reference_height_m=20.0 * FT, roughness_length_m=0.15 * FT)
    assert profile.factor(height_ft * FT) == pytest.approx(math.log(height_ft / 0.15) / math.log(20.0 / 0.15))


def test_ends_of_the_laws() -> None:
    assert SURFACE_LAYER.factor(10.0) == pytest.approx(1.0)
    assert SURFACE_LAYER.factor(0.0) == SURFACE_LAYER.factor(-1.0) == 0.0
    assert SURFACE_LAYER.factor(5000.0) == SURFACE_LAYER.factor(1000.0 * FT)
    power = WindProfile(law=WindLaw.POWER)
    assert power.factor(80.0) == pytest.approx(8.0 ** (1.0 / 7.0))
    linear = WindProfile(law=WindLaw.LINEAR, gradient_1_m=0.02, reference_height_m=60.0)
    assert linear.factor(30.0) == pytest.approx(0.4)
    assert linear.factor(1.0) == 0.0
    assert WindProfile().factor(0.0) == WindProfile().factor(500.0) == 1.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"law": "cubic"}, "cubic.*uniform, log, power, linear"),
        ({"reference_height_m": 0.0}, r"reference height 0\.0 m.*1 to 1000 m"),
        ({"law": "log", "roughness_length_m": 5.0, "reference_height_m": 6.0}, "more than half"),
        ({"exponent": math.nan}, "exponent nan"),
    ],
)
def test_bad_profiles_are_named(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        WindProfile(**arguments)  # type: ignore[arg-type]


def test_a_falling_vehicle_meets_the_wind_of_each_height() -> None:
    air = Environment.from_wind(speed_m_s=6.0, from_deg=210.0)
    home = Home(alt_m=488.0)
    vehicle = Vehicle(
        home=home,
        environment=air,
        seed_sequence=np.random.SeedSequence(1),
        slow_rate_hz=250,
        initial=InitialState(height_m=60.0),
    )
    heights = []
    for _ in range(700):
        height_m = vehicle.truth[t.ALT_M] - home.alt_m  # before the step: the air is set there
        vehicle.step(OFF)
        np.testing.assert_allclose(vehicle.truth[t.WIND_NED_M_S], air.wind_ned_m_s_at(height_m), atol=1e-6)
        heights.append(height_m)
    assert heights[0] > 59.0 and heights[-1] < 30.0
    speeds = [np.linalg.norm(air.wind_ned_m_s_at(height)) for height in (heights[0], heights[-1])]
    assert speeds[0] - speeds[1] > 0.7


def test_a_new_wind_keeps_the_profile_and_a_new_profile_keeps_the_wind() -> None:
    vehicle = Vehicle(
        home=Home(),
        environment=Environment.from_wind(speed_m_s=6.0, from_deg=0.0),
        seed_sequence=np.random.SeedSequence(1),
        slow_rate_hz=250,
    )
    low = SURFACE_LAYER.factor(float(vehicle.truth[t.HEIGHT_ABOVE_GROUND_M]))
    assert 0.0 < low < 0.4
    vehicle.set_wind((3.0, -4.0, 0.5))
    vehicle.step(OFF)
    np.testing.assert_allclose(vehicle.truth[t.WIND_NED_M_S], (3.0 * low, -4.0 * low, 0.5), rtol=1e-3)
    vehicle.set_wind((3.0, -4.0, 0.5), profile=WindProfile())
    vehicle.step(OFF)
    np.testing.assert_allclose(vehicle.truth[t.WIND_NED_M_S], (3.0, -4.0, 0.5), atol=1e-9)
