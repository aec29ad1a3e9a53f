"""A landing ends on the feet and disarmed, whatever the wind."""

import pytest

from flightsim import truth as t
from flightsim.environment import Environment
from tests.flights.flight import Flight


@pytest.mark.parametrize(
    ("flavour", "seed", "wind_m_s", "mode"),
    [
        ("px4", 5, 8.0, "land"),  # tipped over once: the ground's push was taken for drag
        ("px4", 20, 8.0, "return"),  # stood there with running motors for half a minute
        ("ardupilot", 16, 5.0, "return"),  # never disarmed
        ("ardupilot", 11, 8.0, "land"),
        ("ardupilot", 2, 0.0, "land"),
    ],
)
@pytest.mark.sampled(1)
def test_lands_on_its_feet_and_disarms(flavour: str, seed: int, wind_m_s: float, mode: str) -> None:
    air = Environment.from_wind(
        speed_m_s=wind_m_s, from_deg=53.0 * seed % 360.0, turbulence="moderate" if wind_m_s else "none"
    )
    flight = Flight(flavour, seed=seed, environment=air)
    flight.take_off(6.0)
    flight.set_mode(mode)
    touched: list[float] = []

    def down() -> bool:
        if flight.truth[t.ON_GROUND] and not touched:
            touched.append(flight.time_s)
        return not flight.armed

    flight.fly_until(down, 100.0, "disarming")
    assert flight.time_s - touched[0] < 6.0
    assert flight.tilt_deg < 3.0
    assert flight.speed_m_s < 0.05
    assert flight.height_m < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_lands_after_a_long_hover_on_a_sagging_battery(flavour: str) -> None:
    flight = Flight(flavour, seed=30)
    flight.take_off(6.0)
    full = flight.newest["SYS_STATUS"].voltage_battery
    flight.fly(360.0)
    assert flight.newest["SYS_STATUS"].voltage_battery < full - 500
    assert abs(flight.height_m - 6.0) < 1.0
    flight.set_mode("land")
    assert flight.wait_disarmed(60.0) > 5.0
    assert flight.tilt_deg < 3.0
