"""Altitude and airspeed by pitch and throttle, headings by bank, heights from pressure."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimators.pressure_height import PressureHeight
from missions.vehicle.piloting import (
    EnergyController,
    EnergyParameters,
    EnergyState,
    HeadingController,
    heading_deg,
)

G = 9.80665


def test_height_counts_from_the_ground_it_was_taken_on():
    height = PressureHeight(95_461.2)
    assert math.isnan(height.height_m)
    assert height.add(0, 95_461.2, 0.0) == pytest.approx(0.0)
    for k in range(1, 400):
        height.add(k * 50_000, 89_874.6, 0.0)
    assert height.height_m == pytest.approx(500.0, abs=0.3)
    height.add(20_050_000, -5.0, 0.0)  # no pressure
    assert height.height_m == pytest.approx(500.0, abs=0.3)


def test_climb_is_followed_without_lag():
    height = PressureHeight(101_325.0)
    for k in range(200):
        true = 3.0 * k * 0.05
        height.add(k * 50_000, 101_325.0 * (1.0 - true / 44_330.77) ** 5.25588, 3.0)
    assert height.height_m == pytest.approx(true, abs=0.05)


def test_a_ground_pressure_that_is_none_is_refused():
    with pytest.raises(ValueError, match="ground pressure of 0"):
        PressureHeight(0.0)


class Longitudinal:
    """A small aircraft in the vertical plane: drag polar, pitch that follows in 0.4 s, thrust in 0.3 s."""

    def __init__(self, *, trim_error=0.0):
        self.h, self.v, self.gamma, self.pitch, self.thrust, self.trim = 90.0, 22.0, 0.0, 0.0, 0.5, trim_error

    def step(self, dt, pitch, throttle, roll):
        self.pitch += dt / 0.4 * (pitch - self.pitch)
        self.thrust += dt / 0.3 * (throttle - self.thrust)
        alpha = self.pitch - self.gamma + 0.09 - self.trim  # from the zero-lift line
        lift = 5.0 * alpha * (self.v / 25.0) ** 2 / 0.45  # g, 0.09 rad carries 1 g at 25 m/s
        drag = 0.045 * (self.v / 25.0) ** 2 + 0.035 * lift**2 * (25.0 / self.v) ** 2
        push = 0.27 * self.thrust * (1.0 - 0.3 * self.v / 25.0)
        self.v += dt * G * (push - drag - math.sin(self.gamma))
        self.gamma += dt * G / self.v * (lift * math.cos(roll) - math.cos(self.gamma))
        self.h += dt * self.v * math.sin(self.gamma)

    def state(self, roll):
        return EnergyState(
            height_m=self.h, climb_m_s=self.v * math.sin(self.gamma), airspeed_m_s=self.v, roll_rad=roll
        )


def fly(aircraft, controller, seconds, *, height=100.0, airspeed=25.0, roll=0.0, dt=0.04):
    heights, speeds = [], []
    for _ in range(round(seconds / dt)):
        pitch, throttle = controller.step(dt, aircraft.state(roll), height_m=height, airspeed_m_s=airspeed)
        assert 0.0 <= throttle <= 1.0
        for _ in range(4):
            aircraft.step(dt / 4.0, pitch, throttle, roll)
        heights.append(aircraft.h)
        speeds.append(aircraft.v)
    return heights, speeds


@pytest.mark.parametrize("trim_error", [-0.04, 0.0, 0.04])
def test_height_and_airspeed_are_reached_and_held(trim_error):
    aircraft = Longitudinal(trim_error=trim_error)
    heights, speeds = fly(aircraft, EnergyController(EnergyParameters()), 90.0)
    assert heights[-1] == pytest.approx(100.0, abs=0.5)
    assert speeds[-1] == pytest.approx(25.0, abs=0.3)
    assert max(heights) < 106.0
    assert min(speeds) > 18.0


def test_a_steep_bank_costs_little_height():
    aircraft, controller = Longitudinal(), EnergyController(EnergyParameters())
    fly(aircraft, controller, 60.0)
    heights, speeds = fly(aircraft, controller, 60.0, roll=math.radians(35.0))
    assert min(heights) > 95.0
    assert heights[-1] == pytest.approx(100.0, abs=0.5)
    assert speeds[-1] == pytest.approx(25.0, abs=0.5)


def test_what_can_not_be_reached_winds_nothing_up():
    """A minute of asking for 60 m/s, then level flight as before."""
    aircraft, controller = Longitudinal(), EnergyController(EnergyParameters())
    fly(aircraft, controller, 60.0, airspeed=60.0)
    heights, speeds = fly(aircraft, controller, 60.0)
    assert heights[-1] == pytest.approx(100.0, abs=1.5)
    assert speeds[-1] == pytest.approx(25.0, abs=0.7)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"throttle_trim": 1.0}, "not in order"),
        ({"pitch_trim_rad": 1.0}, "not in order"),
        ({"climb_full_throttle_m_s": 0.0}, "climb_full_throttle_m_s = 0"),
    ],
)
def test_energy_parameters_are_checked(change, words):
    with pytest.raises(ValueError, match=words):
        EnergyParameters(**change)


@given(heading=st.floats(-3.1, 3.1), wanted=st.floats(-3.1, 3.1))
def test_headings_are_turned_to_the_short_way(heading, wanted):
    roll = HeadingController().roll_rad(heading_rad=heading, wanted_rad=wanted, airspeed_m_s=25.0)
    assert abs(roll) <= math.radians(40.0) + 1e-9
    error = math.remainder(wanted - heading, math.tau)
    if 1e-3 < abs(error) < 3.0:
        assert math.copysign(1.0, roll) == math.copysign(1.0, error)


def test_a_heading_is_reached_as_a_coordinated_turn():
    controller, heading = HeadingController(), 0.0
    for _ in range(1000):
        roll = controller.roll_rad(heading_rad=heading, wanted_rad=2.5, airspeed_m_s=25.0)
        heading += 0.02 * G / 25.0 * math.tan(roll)
    assert heading == pytest.approx(2.5, abs=0.01)


@pytest.mark.parametrize("heading_rad", [0.0, -0.0, -1e-17, -1e-9, -1e-7, 1e-9, math.tau, -math.tau])
def test_north_is_0_degrees_never_360(heading_rad):
    """ArduPlane denies a GUIDED_CHANGE_HEADING of 360 degrees, which -1e-9 rad is in single precision."""
    assert heading_deg(heading_rad) == pytest.approx(0.0, abs=1e-3)


@given(heading=st.floats(-10.0, 10.0))
def test_headings_travel_as_0_to_360_degrees(heading):
    (on_wire,) = struct.unpack("<f", struct.pack("<f", heading_deg(heading)))
    assert 0.0 <= on_wire < 360.0
    assert math.remainder(math.radians(on_wire) - heading, math.tau) == pytest.approx(0.0, abs=2e-5)
