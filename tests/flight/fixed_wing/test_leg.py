"""Legs to waypoints: which way round the turn onto one goes."""

import math

import pytest

from autopilot_bridge.flight.fixed_wing import FixedWingFlightParameters
from autopilot_bridge.flight.fixed_wing.leg import Leg
from autopilot_bridge.flight.fixed_wing.path_guidance import PathGuidance
from autopilot_bridge.flight.fixed_wing.state import AircraftState, FlightCommand


def flying(north_m: float, east_m: float, course_deg: float) -> AircraftState:
    state = AircraftState()
    state.north_m, state.east_m = north_m, east_m
    state.course_rad = math.radians(course_deg)
    state.ground_speed_m_s = state.true_airspeed_m_s = 25.0
    state.vel_north_m_s = 25.0 * math.cos(state.course_rad)
    state.vel_east_m_s = 25.0 * math.sin(state.course_rad)
    return state


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_turning_back_keeps_to_the_way_round_of_the_corner(side: float) -> None:
    course_deg = 178.0 * side
    target = (800.0 * math.cos(math.radians(course_deg)), 800.0 * math.sin(math.radians(course_deg)), -80.0)
    leg = Leg((0.0, 0.0, -80.0), target, ramps=True, radius_m=50.0, turn_rad=math.radians(178.0))
    guidance, command = PathGuidance(FixedWingFlightParameters()), FlightCommand()

    def wanted_turn_deg(state: AircraftState) -> float:
        command.clear()
        leg.follow(state, guidance, command)
        return side * ((math.degrees(command.course_rad - state.course_rad) + 180.0) % 360.0 - 180.0)

    # a gust has turned the aircraft a little the other way: the line is nearer that way
    gusty = flying(-50.0, 0.0, -12.0 * side)
    assert wanted_turn_deg(gusty) < -90.0
    leg.turn_from(0.0)
    assert wanted_turn_deg(gusty) == pytest.approx(90.0)
    # once it has come round, the shorter way counts again
    assert 0.0 < wanted_turn_deg(flying(-30.0, 100.0 * side, 170.0 * side)) < 90.0
    assert wanted_turn_deg(gusty) < -90.0
