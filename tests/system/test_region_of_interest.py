"""Regions of interest as commands: a copter without a gimbal turns its nose where its firmware does."""

import math

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.navigation import layout as nav
from tests.system.flying import Flying

ROI, NONE, OLD_ROI = 195, 197, 201
EAST_DEG = 50.0 / 75_000.0  # some 50 m at the home's latitude


class Looking:
    """A copter in the air, and who tells it where to look."""

    def __init__(self, flavour: str) -> None:
        self.flying = Flying(flavour)
        self.flying.take_off(10.0)
        self.place = self.flying.sitl.spec.place
        self.link, self.parser = self.flying.sitl.connect(0), FrameParser()
        self.encoder = FrameEncoder(255, 190)

    def command(self, number: int, *values: float) -> int:
        values = (*values, *(0.0,) * (7 - len(values)))
        self.link.receive()
        self.link.send(self.encoder.encode(mavlink.MAVLink_command_long_message(1, 1, number, 0, *values)))
        self.flying.step(0.1)
        received = [decode(f) for _, data in self.link.receive() for f in self.parser.feed(data)]
        return next(
            m.result  # type: ignore[attr-defined]
            for m in reversed(received)
            if m.get_type() == "COMMAND_ACK" and m.command == number  # type: ignore[attr-defined]
        )

    def look(self, number: int = ROI, east_deg: float = EAST_DEG) -> int:
        kind = 3.0 if number == OLD_ROI else 0.0
        return self.command(number, kind, 0, 0, 0, self.place.lat_deg, self.place.lon_deg + east_deg, 0.0)

    @property
    def yaw_deg(self) -> float:
        return math.degrees(float(self.flying.autopilot.navigation.state[nav.EULER_RAD][2]))

    def to_the_east(self) -> float:
        """Degrees between the nose and the place in the east."""
        north, east, _ = self.flying.estimate_ned_m
        bearing = math.degrees(math.atan2(EAST_DEG * 75_000.0 - east, -north))
        return abs((self.yaw_deg - bearing + 180.0) % 360.0 - 180.0)


@pytest.fixture
def guided() -> Looking:
    looking = Looking("ardupilot")
    looking.flying.autopilot.commander.set_mode(FlightMode.GUIDED)
    return looking


@pytest.mark.slow
def test_arducopter_turns_its_nose_in_guided(guided: Looking) -> None:
    assert guided.to_the_east() > 30.0
    assert guided.look() == 0
    guided.flying.step(8.0)
    assert guided.to_the_east() < 6.0
    guided.flying.autopilot.commander.guidance.reposition(north_m=30.0, east_m=0.0, down_m=-10.0)
    guided.flying.step(4.0)
    assert guided.flying.estimate_ned_m[0] > 3.0  # under way, and the nose stays on the place
    assert guided.to_the_east() < 10.0
    guided.flying.step(12.0)
    assert guided.to_the_east() < 6.0
    before = guided.yaw_deg
    assert guided.command(NONE) == 0
    guided.flying.step(3.0)
    assert guided.yaw_deg == pytest.approx(before, abs=4.0)  # nothing turns it back
    assert guided.look(OLD_ROI, -EAST_DEG) == 0
    guided.flying.step(8.0)
    assert guided.to_the_east() > 90.0
    assert guided.command(mavlink.MAV_CMD_CONDITION_YAW, 10.0, 30.0, 1.0, 0.0) == 0  # CONDITION_YAW is newer
    guided.flying.step(10.0)
    assert guided.yaw_deg == pytest.approx(10.0, abs=4.0)


def test_a_place_that_is_none_on_earth_is_refused(guided: Looking) -> None:
    before = guided.yaw_deg
    assert guided.command(ROI, 0, 0, 0, 0, 95.0, 8.0, 0.0) == mavlink.MAV_RESULT_FAILED
    assert guided.command(ROI, 0, 0, 0, 0, math.nan, 8.0, 0.0) == mavlink.MAV_RESULT_FAILED
    guided.flying.step(3.0)
    assert guided.yaw_deg == pytest.approx(before, abs=4.0)


@pytest.mark.slow
def test_arducopters_loiter_has_its_pilots_heading(guided: Looking) -> None:
    assert guided.look() == 0
    guided.flying.step(8.0)
    guided.flying.autopilot.commander.set_mode(FlightMode.HOLD)
    assert guided.look(ROI, -EAST_DEG) == 0
    guided.flying.step(6.0)
    assert guided.to_the_east() < 10.0


@pytest.mark.slow
def test_px4_turns_its_nose_in_a_mission_only() -> None:
    looking = Looking("px4")
    before = looking.yaw_deg
    assert looking.look() == 0
    looking.flying.step(4.0)
    assert looking.yaw_deg == pytest.approx(before, abs=4.0)
    there = [
        MissionItem(
            command=mavlink.MAV_CMD_NAV_TAKEOFF, x=looking.place.lat_deg, y=looking.place.lon_deg, z=10.0
        ),
        MissionItem(
            command=mavlink.MAV_CMD_NAV_WAYPOINT,
            x=looking.place.lat_deg + 1e-3,
            y=looking.place.lon_deg,
            z=10.0,
        ),
    ]
    autopilot = looking.flying.autopilot
    autopilot.missions._stores[MissionType.MISSION].replace(tuple(there), 1)
    looking.flying.step(0.2)
    assert autopilot.commander.set_mode(FlightMode.MISSION).accepted
    looking.flying.step(4.0)
    assert looking.to_the_east() > 45.0
    assert looking.look() == 0
    looking.flying.step(6.0)
    assert looking.flying.estimate_ned_m[0] > 5.0
    assert looking.to_the_east() < 12.0
    assert looking.command(NONE) == 0
    looking.flying.step(6.0)
    assert looking.yaw_deg == pytest.approx(0.0, abs=6.0)
    assert looking.command(ROI, 0, 0, 0, 0, 95.0, 8.0, 0.0) == mavlink.MAV_RESULT_DENIED
