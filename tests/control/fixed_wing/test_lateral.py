"""Wind triangle, least airspeed and bank limit of the lateral guidance."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.control.fixed_wing import FixedWingParameters, lateral
from autopilot_bridge.control.fixed_wing import layout as c
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.control.fixed_wing.lateral import (
    airspeed_for_ground_speed,
    heading_for_course,
    stall_speed,
)
from flightsim.foundation import records
from flightsim.foundation.records import new_record, the_record
from tests.control.on_arrays import on_arrays

(bank_limit,) = on_arrays(sp.Setpoint, lateral.bank_limit)
angles = st.floats(-math.pi, math.pi)
winds = st.floats(-40.0, 40.0)


def packed(parameters: FixedWingParameters) -> FixedWingParameters:
    return the_record(records.packed(parameters), FixedWingParameters)


def ground_velocity(heading: float, airspeed: float, wind: tuple[float, float]) -> np.ndarray:
    return airspeed * np.array([math.cos(heading), math.sin(heading)]) + wind


@given(angles, st.floats(10.0, 40.0), winds, winds)
def test_heading_makes_the_course_wherever_the_wind_lets_it(
    course: float, airspeed: float, north: float, east: float
) -> None:
    heading = heading_for_course(course, airspeed, north, east)
    assert -math.pi <= heading <= math.pi
    velocity = ground_velocity(heading, airspeed, (north, east))
    ahead = velocity @ [math.cos(course), math.sin(course)]
    aside = velocity @ [-math.sin(course), math.cos(course)]
    along = north * math.cos(course) + east * math.sin(course)
    cross = east * math.cos(course) - north * math.sin(course)
    if math.hypot(north, east) < airspeed or (abs(cross) < airspeed and along > 0.0):
        assert abs(aside) < 1e-6
        assert ahead > 0.0


@given(angles, st.floats(10.0, 20.0), st.floats(1.05, 3.0))
def test_against_too_strong_a_wind_the_nose_is_kept_into_it(
    course: float, airspeed: float, ratio: float
) -> None:
    against = heading_for_course(
        course, airspeed, -ratio * airspeed * math.cos(course), -ratio * airspeed * math.sin(course)
    )
    assert math.cos(against - course) == pytest.approx(1.0)


@given(angles, st.floats(10.0, 20.0), st.floats(1.05, 3.0))
def test_across_too_strong_a_wind_hardly_a_heading_comes_nearer_to_the_course(
    course: float, airspeed: float, ratio: float
) -> None:
    wind = (-ratio * airspeed * math.sin(course), ratio * airspeed * math.cos(course))  # from the left
    unit = np.array([math.cos(course), math.sin(course)])

    def off_course(heading: float) -> float:
        velocity = ground_velocity(heading, airspeed, wind)
        return math.acos(np.clip(velocity @ unit / np.linalg.norm(velocity), -1.0, 1.0))

    best = math.asin(math.sqrt(1.0 - 1.0 / ratio**2))  # ground velocity touches the circle of the airspeed
    assert off_course(heading_for_course(course, airspeed, *wind)) < best + math.radians(6.0)


@given(angles, st.floats(0.0, 15.0), winds, winds)
def test_airspeed_for_ground_speed(course: float, wanted: float, north: float, east: float) -> None:
    airspeed = airspeed_for_ground_speed(course, wanted, north, east)
    along = north * math.cos(course) + east * math.sin(course)
    if along >= wanted:
        assert airspeed == 0.0
    else:
        cross = east * math.cos(course) - north * math.sin(course)
        assert math.sqrt(max(0.0, airspeed**2 - cross**2)) + along == pytest.approx(wanted, abs=1e-6)


@given(st.floats(5.0, 40.0), st.floats(1.0, 80.0))
def test_bank_is_limited_so_that_the_turn_does_not_stall(airspeed: float, limit_deg: float) -> None:
    parameters = FixedWingParameters(load_factor_max=4.0, roll_limit_rad=math.radians(70.0))
    p, s = packed(parameters), new_record(c.FixedWingState)
    setpoint = np.full(sp.SETPOINT_SIZE, math.nan)
    setpoint[sp.ROLL_LIMIT_RAD] = math.radians(limit_deg)
    s.eas, s.eas_known = airspeed, 1.0
    bank = bank_limit(setpoint, p, s)
    assert bank <= math.radians(min(limit_deg, 70.0)) + 1e-9
    stall_in_turn = parameters.airspeed_stall_m_s / math.sqrt(math.cos(bank))
    assert stall_in_turn < airspeed or bank <= math.radians(15.0) + 1e-9
    assert 1.0 / math.cos(bank) <= 4.0 + 1e-9


def test_stall_speed_not_given_is_taken_from_the_lowest_airspeed() -> None:
    p = packed(FixedWingParameters(airspeed_stall_m_s=0.0))
    assert stall_speed(p) == pytest.approx(8.0)
