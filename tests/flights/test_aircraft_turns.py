"""Circles, headings and attitudes held in 6 m/s of wind, measured by the truth."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import dialect
from flightsim import truth as t
from flightsim.environment import Environment, Turbulence
from flightsim.wind_profile import WindProfile
from tests.flights.aircraft import AircraftFlight
from tests.flights.turn_geometry import turn_over_m

# The wind at the height that is flown at, where it is 1.4 times that of 10 m above ground.
LIGHT = Environment.from_wind(
    speed_m_s=6.0, from_deg=210.0, profile=WindProfile(), turbulence=Turbulence.LIGHT
)
PLACE = (150.0, 150.0)


@pytest.mark.parametrize(("flavour", "radius_m"), [("px4", 100.0), ("ardupilot", -150.0)])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_circle(flavour: str, radius_m: float) -> None:
    flight = AircraftFlight(flavour, seed=2, environment=LIGHT)
    flight.take_off(80.0)
    assert flight.circle(*PLACE, 80.0, radius_m) == 0
    flight.fly(30.0)
    radii: list[float] = []
    heights: list[float] = []

    def look() -> None:
        radii.append(flight.distance_m(*PLACE) / abs(radius_m) - 1.0)
        heights.append(flight.height_over_home_m - 80.0)

    flight.fly(40.0, look)
    assert np.max(np.abs(radii)) < 0.03
    assert np.sqrt(np.mean(np.square(heights))) < 1.5


@pytest.mark.parametrize("course", [False, True])
@pytest.mark.slow
def test_arduplane_heading_in_wind(course: bool) -> None:
    """MAV_CMD_GUIDED_CHANGE_HEADING: course over ground (0) or heading (1)."""
    flight = AircraftFlight("ardupilot", seed=2, environment=LIGHT)
    flight.take_off(80.0)
    for wanted_deg in (60.0, 280.0):
        kind = 0 if course else 1
        assert flight.result(dialect.MAV_CMD_GUIDED_CHANGE_HEADING, kind, wanted_deg, 5.0) == 0
        flight.fly(20.0)
        errors_deg: list[float] = []

        def look(wanted_deg: float = wanted_deg, errors_deg: list[float] = errors_deg) -> None:
            north, east, _ = flight.truth[t.VEL_NED_M_S]
            flown = math.atan2(east, north) if course else flight.yaw_rad
            errors_deg.append((math.degrees(flown) - wanted_deg + 180.0) % 360.0 - 180.0)

        flight.fly(12.0, look)
        assert np.max(np.abs(errors_deg)) < 5.0
        assert abs(np.mean(errors_deg)) < 1.5


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.slow
def test_attitude_steps(flavour: str) -> None:
    """Offboard and guided attitudes: each bank is reached within 3 s, without much overshoot."""
    flight = AircraftFlight(flavour, seed=2, environment=LIGHT)
    flight.take_off(100.0)
    wanted = [0.0]
    mask = 0x07 if flavour == "px4" else 0x46  # ArduPlane: roll alone, height and speed are its own
    flight.repeat(20.0, lambda _: flight.attitude_setpoint(wanted[0], 3.0, 0.6, mask))
    flight.fly(0.5)
    if flavour == "px4":
        flight.set_mode("offboard")
    flight.fly(5.0)
    for bank_deg in (25.0, -25.0, 0.0):
        before, wanted[0] = wanted[0], bank_deg
        rolls: list[float] = []
        flight.fly(8.0, lambda rolls=rolls: rolls.append(flight.roll_deg))
        step = bank_deg - before
        beyond = np.sign(step) * (np.array(rolls) - bank_deg)
        assert np.max(beyond) < 0.15 * abs(step) + 2.0
        assert np.max(np.abs(np.array(rolls[30:]) - bank_deg)) < 4.0
        assert np.mean(rolls[30:]) == pytest.approx(bank_deg, abs=1.0)


@pytest.mark.slow
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize("wind_from_deg", [0.0, 90.0, 180.0, 270.0])
@pytest.mark.parametrize("seed", range(2))
def test_returns_home_in_rough_air(flavour: str, wind_from_deg: float, seed: int) -> None:
    wind = Environment.from_wind(speed_m_s=6.0, from_deg=wind_from_deg, turbulence=Turbulence.MODERATE)
    flight = AircraftFlight(flavour, seed=seed, environment=wind)
    flight.take_off(60.0, (600.0, 400.0))
    flight.set_mode("return")
    flight.fly(100.0)
    radii: list[float] = []
    heights: list[float] = []

    def look() -> None:
        radii.append(flight.distance_m(0.0, 0.0))
        heights.append(flight.height_over_home_m - 100.0)  # RTL_RETURN_ALT, RTL_ALTITUDE

    flight.fly(40.0, look)
    assert np.ptp(radii) < 12.0 and max(radii) < 200.0
    assert np.sqrt(np.mean(np.square(heights))) < 2.0


@pytest.mark.parametrize("turn_deg", [-170.0, -120.0, 90.0, 150.0])
@pytest.mark.parametrize("turn_in_m", [0.0, 50.0])
def test_quickest_turn_in_still_air(turn_deg: float, turn_in_m: float) -> None:
    """The closed form that tells which part of a leg counts."""
    turn, radius_m = abs(math.radians(turn_deg)), 25.0**2 / 9.80665
    beside_m = radius_m * (1.0 - math.cos(turn)) - turn_in_m * math.sin(turn)
    phi = math.acos(1.0 - 0.5 * beside_m / radius_m)
    expected = radius_m * math.sin(turn) - turn_in_m * math.cos(turn) + 2.0 * radius_m * math.sin(phi)
    after = (500.0 * math.cos(turn), 500.0 * math.copysign(math.sin(turn), turn_deg))
    over_m = turn_over_m(
        (-500.0, 0.0),
        (0.0, 0.0),
        after,
        turn_in_m=turn_in_m,
        airspeed_m_s=25.0,
        bank_rad=math.radians(45.0),
        reversal_s=0.0,
        wind=(0.0, 0.0),
    )
    assert over_m == pytest.approx(expected, abs=1e-6)


def test_quickest_turn_drifts_with_the_wind() -> None:
    """Half a turn and no more, flown with the wind along: the circle ends beside the line as in still air,
    and the air has moved by the wind in the time it took.
    """
    places = ((-500.0, 0.0), (0.0, 0.0), (-500.0, 1e-3))
    values = {"turn_in_m": 0.0, "airspeed_m_s": 25.0, "bank_rad": math.radians(45.0), "reversal_s": 0.0}
    still_m = turn_over_m(*places, **values, wind=(0.0, 0.0))
    windy_m = turn_over_m(*places, **values, wind=(-6.0, 0.0))
    time_s = 2.0 * math.pi * 25.0 / 9.80665  # half a turn, and a quarter to either side
    assert windy_m - still_m == pytest.approx(6.0 * time_s, abs=0.1)
