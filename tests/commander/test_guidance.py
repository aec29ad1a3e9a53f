"""What clients command in flight: circles, places, and what is reported of a mission's items."""

import math
from typing import Any

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


def captured(rig: Rig, monkeypatch: pytest.MonkeyPatch, name: str) -> list[Any]:
    """What is handed to the vehicle's tasks from now on."""
    found: list[Any] = []
    make = getattr(type(rig.commander.vehicle), name)

    def note(vehicle: Any, what: Any) -> Any:
        found.append(what)
        return make(vehicle, what)

    monkeypatch.setattr(type(rig.commander.vehicle), name, note)
    return found


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"yaw_rad": 1.2}, {"yaw_rad": 1.2}),
        ({"yaw_rad": 2.0 * math.pi}, {"yaw_rad": 2.0 * math.pi}),
        ({"yaw_rad": -2.0 * math.pi}, {"yaw_rad": -2.0 * math.pi}),
        ({"yaw_rad": 7.0}, {"yaw_rad": math.nan}),
        ({"yaw_rad": -7.0}, {"yaw_rad": math.nan}),
        ({"speed_m_s": 0.5}, {"speed_m_s": 0.5}),
        ({"speed_m_s": 100.0}, {"speed_m_s": 100.0}),
        ({"speed_m_s": 100.1}, {"speed_m_s": None}),
        ({"speed_m_s": 0.0}, {"speed_m_s": None}),
        ({"speed_m_s": -1.0}, {"speed_m_s": None}),
        ({"speed_m_s": math.nan}, {"speed_m_s": None}),
        ({"radius_m": 80.0}, {"radius_m": 80.0}),
        ({"radius_m": -80.0}, {"radius_m": -80.0}),
        ({"radius_m": 0.5}, {"radius_m": 0.5}),
        ({"radius_m": 1e4}, {"radius_m": 1e4}),
        ({"radius_m": 1.1e4}, {"radius_m": None}),
        ({"radius_m": -1.1e4}, {"radius_m": None}),
        ({"radius_m": 0.0}, {"radius_m": None}),
        ({"radius_m": math.nan}, {"radius_m": None}),
    ],
)
def test_unusable_figures_of_a_reposition_are_left_to_the_parameters(
    given: dict[str, float], expected: dict[str, float | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = hovering("px4")
    found = captured(rig, monkeypatch, "reposition")
    verdict = rig.commander.guidance.reposition(north_m=50.0, east_m=-20.0, down_m=-30.0, **given)
    assert verdict.accepted
    (place,) = found
    assert place.ned_m.tolist() == [50.0, -20.0, -30.0]
    for name, value in expected.items():
        assert getattr(place, name) == (value if value is None else pytest.approx(value, nan_ok=True))


@pytest.mark.parametrize(
    ("radius_m", "speed_m_s", "radius", "speed", "clockwise"),
    [
        (30.0, 5.0, 30.0, 5.0, True),
        (-30.0, -5.0, 30.0, 5.0, False),
        (0.5, 0.5, 0.5, 0.5, True),
        (1e4, 100.0, 1e4, 100.0, True),
        (-1e4, -100.0, 1e4, 100.0, False),
        (1.1e4, 101.0, None, None, True),
        (-1.1e4, -101.0, None, None, True),
        (0.0, 0.0, None, None, True),
        (math.nan, math.nan, None, None, True),
    ],
)
def test_figures_of_an_orbit(
    radius_m: float,
    speed_m_s: float,
    radius: float | None,
    speed: float | None,
    clockwise: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = hovering("px4")
    found = captured(rig, monkeypatch, "orbit")
    rig.commander.guidance.orbit(
        radius_m=radius_m, speed_m_s=speed_m_s, yaw_behaviour=2, north_m=1.0, east_m=2.0, down_m=-30.0
    )
    circle = found[-1]
    assert circle.centre_ned_m.tolist() == [1.0, 2.0, -30.0]
    assert (circle.radius_m, circle.speed_m_s, circle.clockwise) == (radius, speed, clockwise)
    assert circle.yaw_behaviour == 2


@pytest.mark.parametrize(
    ("distance_m", "known"), [(9.9e5, True), (-9.9e5, True), (1.1e6, False), (-1.1e6, False)]
)
def test_places_farther_than_a_thousand_kilometres_are_not_flown_to(
    distance_m: float, known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    for axis in range(3):
        rig = hovering("px4")
        found = captured(rig, monkeypatch, "reposition")
        place = [10.0, 20.0, -30.0]
        place[axis] = distance_m
        rig.commander.guidance.reposition(north_m=place[0], east_m=place[1], down_m=place[2])
        assert math.isfinite(found[-1].ned_m[axis]) is known


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize("speed_m_s", [0.0, -1.0, math.nan])
def test_no_speed_is_the_parameters_speed(flavour: str, speed_m_s: float) -> None:
    rig = hovering(flavour)
    usual = rig.context.parameters.cruise_speed_m_s
    rig.commander.guidance.change_speed(0.5 * usual, kind=1)
    assert rig.context.parameters.cruise_speed_m_s == pytest.approx(0.5 * usual)
    rig.commander.guidance.change_speed(speed_m_s, kind=1)
    expected = 0.5 * usual if math.isnan(speed_m_s) else usual
    assert rig.context.parameters.cruise_speed_m_s == pytest.approx(expected)
    rig.commander.guidance.change_speed(0.5 * usual, kind=1)
    rig.commander.guidance.forget_speed()
    assert rig.context.parameters.cruise_speed_m_s == pytest.approx(usual)
