"""Missions that the vehicle would store and then not fly are refused before anything is uploaded."""

import pytest

from autopilot_bridge.fence_shapes import CIRCLE_INCLUSION, POLYGON_INCLUSION
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from missions.errors import PlanError
from tests.missions.conftest import HOME


def at(command: int, north_deg: float, height_m: float) -> MissionItem:
    return MissionItem(command=command, x=HOME.lat_deg + north_deg, y=HOME.lon_deg, z=height_m)


TAKEOFF, WAYPOINT = at(dialect.MAV_CMD_NAV_TAKEOFF, 0.0, 10.0), at(dialect.MAV_CMD_NAV_WAYPOINT, 1e-3, 10.0)
CIRCLE = MissionItem(
    command=CIRCLE_INCLUSION, frame=0, param1=50.0, x=HOME.lat_deg, y=HOME.lon_deg, z=0.0
)  # fmt: skip
ACROSS = [
    MissionItem(command=POLYGON_INCLUSION, frame=0, param1=3.0, x=lat, y=lon, z=0.0)
    for lat, lon in ((1.0, 179.9), (1.0, -179.9), (2.0, -179.9))
]


@pytest.mark.parametrize(
    ("flavour", "items", "fence", "parameters", "words"),
    [
        ("px4", [TAKEOFF, WAYPOINT], [], {"MIS_TKO_LAND_REQ": 2}, "Landing waypoint.* required .*REQ 2"),
        ("px4", [WAYPOINT, TAKEOFF], [], {}, "takeoff not first waypoint item"),
        ("px4", [TAKEOFF, WAYPOINT], [CIRCLE], {}, "Geofence violation for waypoint 2"),
        ("px4", [TAKEOFF, WAYPOINT], [], {"GF_MAX_HOR_DIST": 100.0}, "Geofence violation for waypoint 2"),
        ("px4", [TAKEOFF, WAYPOINT], [], {"GF_MAX_VER_DIST": 5.0}, "Geofence violation for waypoint 1"),
        ("px4", [TAKEOFF, WAYPOINT], ACROSS, {}, "lies across 180 degrees of longitude"),
        ("ardupilot", [WAYPOINT], [], {}, "Auto: Missing Takeoff Cmd"),
        ("ardupilot", [TAKEOFF], [], {"ARMING_MIS_ITEMS": 64}, "Missing mission item: RTL"),
    ],
)
def test_the_rules_of_the_firmware_come_before_the_upload(flown, flavour, items, fence, parameters, words):
    async def script(vehicle, autopilot):
        for name, value in parameters.items():
            autopilot.parameters[name] = value, autopilot.parameters[name][1]
        with pytest.raises(PlanError, match=f"would not fly this mission: .*{words}.*nothing was uploaded"):
            await vehicle.plans.upload_mission(items, fence=fence)
        assert autopilot.items == []

    flown(script, flavour)


def test_in_flight_a_mission_needs_no_takeoff(flown) -> None:
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        await vehicle.plans.upload_mission([WAYPOINT])
        assert len(autopilot.items) == 2  # with home

    flown(script, "ardupilot")


def test_parameters_that_a_vehicle_does_not_have_ask_for_nothing(flown) -> None:
    async def script(vehicle, autopilot):
        for name in ("MIS_TKO_LAND_REQ", "GF_MAX_HOR_DIST", "GF_MAX_VER_DIST"):
            del autopilot.parameters[name]
        await vehicle.plans.upload_mission([TAKEOFF, WAYPOINT])
        assert len(autopilot.items) == 2

    flown(script)
