"""pymavlink's mavutil as a client over UDP flies everything a script would fly, on both flavours."""

import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from pymavlink import mavutil

from tests.clients.mavutil_client import Client
from tests.clients.runway import PlanItem
from tests.clients.sitl_process import free_port, running_sitl
from tests.slow import slow

mavlink = mavutil.mavlink
SPEEDUP = 16.0
MODES = {
    "px4": {"hold": "LOITER", "mission": "MISSION", "offboard": "OFFBOARD", "rtl": "RTL", "land": "LAND"},
    "ardupilot": {"hold": "LOITER", "mission": "AUTO", "offboard": "GUIDED", "rtl": "RTL", "land": "LAND"},
}


def at(north_m: float, east_m: float, height_m: float, within_m: float = 1.0) -> Callable[[Any], bool]:
    """Matches LOCAL_POSITION_NED near a point."""
    goal = (north_m, east_m, -height_m)
    return lambda m: m.get_type() == "LOCAL_POSITION_NED" and math.dist((m.x, m.y, m.z), goal) < within_m


def set_mode(client: Client, what: str, each: Callable[[], None] | None = None) -> None:
    """Change to the flavour's mode for a purpose."""
    client.set_mode(MODES[client.flavour][what], each)


@pytest.fixture
def client(request: pytest.FixtureRequest) -> Iterator[Client]:
    port = free_port()
    with running_sitl(request.param, [f"udpout:127.0.0.1:{port}"], speedup=SPEEDUP):
        yield Client(request.param, f"udpin:127.0.0.1:{port}", speedup=SPEEDUP)


@pytest.mark.parametrize("client", ["px4", slow("ardupilot")], indirect=True)
@pytest.mark.compatibility(client="pymavlink (mavutil)", feature="setpoints, modes", parameter="client")
def test_offboard_positions_and_return(client: Client) -> None:
    client.take_off(10.0)
    if client.flavour == "px4":
        hover = (0.0, 0.0, 12.0)
        client.stream_for(0.5, lambda: client.send_position(*hover))  # OFFBOARD wants to see a stream first
        set_mode(client, "offboard", each=lambda: client.send_position(*hover))
    for goal in ((15.0, 0.0, 12.0), (15.0, 10.0, 12.0)):
        client.until(f"position {goal}", at(*goal), each=lambda goal=goal: client.send_position(*goal))
    set_mode(client, "rtl")
    client.landed_and_disarmed()


@pytest.mark.parametrize("client", [slow("px4"), "ardupilot"], indirect=True)
@pytest.mark.compatibility(client="pymavlink (mavutil)", feature="mission", parameter="client")
def test_uploaded_mission_and_landing(client: Client) -> None:
    client.ready()
    here = client.until("position", lambda m: m.get_type() == "GLOBAL_POSITION_INT")
    lat, lon = here.lat * 1e-7, here.lon * 1e-7
    items = [
        PlanItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, place=(lat, lon, 12.0)),
        PlanItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, place=(lat + 3e-4, lon, 12.0)),
        PlanItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, place=(lat + 3e-4, lon + 3e-4, 14.0)),
        PlanItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, place=(lat, lon + 3e-4, 12.0)),
    ]
    if client.flavour == "ardupilot":
        items.insert(
            0, PlanItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, place=(lat, lon, 0.0))
        )  # item 0 is home
    client.upload(items)
    if client.flavour == "ardupilot":
        set_mode(client, "offboard")  # GUIDED: AUTO is not armable
        client.arm()
        set_mode(client, "mission")
        client.command(mavlink.MAV_CMD_MISSION_START)
    else:
        set_mode(client, "mission")
        client.arm()
    last = len(items) - 1
    client.until("last item reached", lambda m: m.get_type() == "MISSION_ITEM_REACHED" and m.seq == last)
    client.command(mavlink.MAV_CMD_NAV_LAND)
    client.landed_and_disarmed()
