"""What clients command in flight: circles, places, and what is reported of a mission's items."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.events import FailsafeActivated, MissionItemReached, SystemStatus
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.flight.context import WaypointReached
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.navigation import layout as nav
from flightsim.airframe import AirframeKind
from tests.commander.rig import Rig


def hovering(flavour: str, mode: FlightMode = FlightMode.HOLD, **parameters: float) -> Rig:
    rig = Rig(flavour, **parameters)
    rig.put_in_air(10.0)
    assert rig.commander.set_mode(mode).accepted
    rig.run(0.2)
    rig.events.clear()
    return rig


@pytest.mark.parametrize("radius_m", [30.0, -30.0])
@pytest.mark.parametrize("speed_m_s", [3.0, 5.0])
def test_an_orbit_has_the_radius_direction_and_speed_that_were_commanded(
    radius_m: float, speed_m_s: float
) -> None:
    """MAV_CMD_DO_ORBIT: param1 radius, positive clockwise (seen from above), param2 tangential velocity."""
    rig = hovering("px4")
    assert rig.commander.guidance.orbit(
        radius_m=radius_m, speed_m_s=speed_m_s, yaw_behaviour=0, north_m=0.0, east_m=0.0, down_m=-10.0
    ).accepted
    rig.run(30.0)
    places = []
    for _ in range(50):
        rig.tick()
        places.append(rig.context.nav[nav.POS_NED_M].copy())
    track = np.array(places)
    assert np.hypot(track[:, 0], track[:, 1]) == pytest.approx(30.0, abs=0.5)
    angles = np.unwrap(np.arctan2(track[:, 1], track[:, 0]))  # from north over east: clockwise
    assert (angles[-1] - angles[0]) * 30.0 / (49 * 0.02) == pytest.approx(
        math.copysign(speed_m_s, radius_m), rel=0.05
    )


@pytest.mark.parametrize("unusable", [0.0, math.nan, 1e9])
def test_an_orbit_without_usable_figures_has_the_parameters(unusable: float) -> None:
    rigs = []
    for radius_m, speed_m_s in ((unusable, 4.0), (math.nan, 4.0)):
        rig = hovering("px4")
        rig.commander.guidance.orbit(
            radius_m=radius_m, speed_m_s=speed_m_s, yaw_behaviour=0, north_m=0.0, east_m=0.0, down_m=-10.0
        )
        rig.run(20.0)
        rigs.append(rig.context.nav[nav.POS_NED_M].tolist())
    assert rigs[0] == rigs[1] and math.hypot(*rigs[0][:2]) > 1.0


@pytest.mark.parametrize("axis", [0, 1])
def test_arducopter_has_no_limit_of_attitude(axis: int) -> None:
    """PX4's failure detector has one; ArduCopter has the crash check only."""
    rig = hovering("ardupilot", FlightMode.ALTITUDE)
    rig.context.nav[nav.EULER_RAD] = np.radians([75.0, 0.0, 0.0] if axis == 0 else [0.0, -75.0, 0.0])
    for later_us in range(20_000, 2_000_000, 20_000):
        rig.commander.update(rig.time_us + later_us)
    assert not [event for event in rig.commander.drain_events() if isinstance(event, FailsafeActivated)]


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_a_mode_that_needs_no_position_goes_on_without_it(flavour: str) -> None:
    """ArduCopter's EKF failsafe and PX4's position failsafe act in modes that need a position only."""
    rig = hovering(flavour)
    rig.commander.pilot.move(roll=0.0, pitch=0.0, throttle=0.0, yaw=0.0, time_us=rig.time_us)
    assert rig.commander.set_mode(FlightMode.ALTITUDE).accepted
    rig.judgement.position_valid = False
    for _ in range(50):
        rig.commander.pilot.move(roll=0.0, pitch=0.0, throttle=0.0, yaw=0.0, time_us=rig.time_us)
        rig.run(0.2)
    assert rig.commander.mode is FlightMode.ALTITUDE
    assert not rig.happened(FailsafeActivated)


def test_system_status_is_mavlinks() -> None:
    """MAV_STATE of minimal.xml."""
    names = {f"MAV_STATE_{status.name}": status.value for status in SystemStatus}
    assert names.items() <= {entry.name: value for value, entry in mavlink.enums["MAV_STATE"].items()}.items()


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_the_distance_of_a_reached_waypoint_is_reported(flavour: str) -> None:
    """Horizontal, from the waypoint; none for an item without a place."""
    rig = Rig(flavour, kind=AirframeKind.FIXED_WING)
    rig.upload(
        rig.waypoint(300.0, 400.0),
        MissionItem(command=mavlink.MAV_CMD_DO_CHANGE_SPEED),
        rig.waypoint(500.0, 0.0),
    )
    first = int(rig.flavour.policy.mission_first_item)
    rig.context.nav[nav.POS_NED_M] = (297.0, 396.0, -50.0)
    for seq in (first, first + 1):
        rig.context.events.append(WaypointReached(seq, navigation=seq == first))
        rig.tick()
    reached = {event.index: event.distance_m for event in rig.happened(MissionItemReached)}
    assert reached[first] == pytest.approx(5.0, abs=0.05)
    if first + 1 in reached:
        assert math.isnan(reached[first + 1])
