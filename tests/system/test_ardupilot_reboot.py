"""ArduPilot's SITL as its users know it: counters in parameters, the banner, a reboot that starts at home."""

from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.sitl import Sitl
from flightsim import truth as t
from flightsim.initial_state import InitialState
from flightsim.world_spec import VehicleSpec, WorldSpec
from tests.system.wire_client import Client

REBOOT = mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN


def connected(model: str = "iris") -> Client:
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(autopilot="ardupilot", model=model),), seed=1))
    client = Client(sitl)
    client.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    client.run(0.5)
    return client


def announced(received: list[Any], name: str) -> list[float]:
    return [m.param_value for m in received if m.get_type() == "PARAM_VALUE" and m.param_id == name]


def read(client: Client, name: str) -> float:
    client.send(mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
    return announced(client.run(0.2), name)[-1]


def test_mis_total_follows_the_stored_mission() -> None:
    client = connected()
    assert read(client, "MIS_TOTAL") == 0.0
    items = (
        MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT),
        MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, z=5.0),
        MissionItem(command=mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH),
    )
    client.sitl.vehicles[0].autopilot.missions.stores[MissionType.MISSION].replace(items, 7)
    assert announced(client.run(0.5), "MIS_TOTAL") == [3.0]  # home is counted
    client.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 0))
    assert announced(client.run(0.5), "MIS_TOTAL") == [0.0]


@pytest.mark.parametrize("model", ["iris", "aerosonde"])
def test_a_reboot_starts_at_home_and_level(model: str) -> None:
    client = connected(model)
    vehicle = client.sitl.vehicles[0]
    truth = vehicle.vehicle.truth
    assert read(client, "STAT_BOOTCNT") == 1.0
    at_first = truth[[t.LAT_RAD, t.LON_RAD, t.ALT_M]].copy()
    before = vehicle.autopilot
    before.commander.terminate()
    vehicle.vehicle.reset(InitialState(offset_ne_m=(50.0, -20.0)))
    client.run(0.1)
    assert abs(truth[t.LAT_RAD] - at_first[0]) > 5e-6
    vehicle.vehicle.crash = "hit the ground"
    vehicle.crashed = True
    assert client.command(REBOOT, 1)[0] == mavlink.MAV_RESULT_ACCEPTED
    client.run(2.0)
    client.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    assert vehicle.autopilot is not before
    assert vehicle.vehicle.crash is None
    assert not vehicle.crashed
    assert truth[[t.LAT_RAD, t.LON_RAD]] == pytest.approx(at_first[:2], abs=1e-8)
    assert truth[t.ALT_M] == pytest.approx(at_first[2], abs=0.05)
    assert read(client, "STAT_BOOTCNT") == 2.0


@pytest.mark.parametrize("model", ["iris", "aerosonde"])
def test_the_banner_is_sent_when_it_is_requested(model: str) -> None:
    client = connected(model)
    result, received = client.command(mavlink.MAV_CMD_DO_SEND_BANNER)
    assert result == mavlink.MAV_RESULT_ACCEPTED
    texts = [message.text for message in received if message.get_type() == "STATUSTEXT"]
    assert any(" V4.6.3 (3fc7011a)" in text for text in texts), texts
