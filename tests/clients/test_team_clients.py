"""One ground station and several vehicles: on one link, and on a link each to the same port."""

import asyncio
import socket
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil

from autopilot_bridge.links import UdpPeer
from autopilot_bridge.sitl import Port, Sitl, SitlServer
from flightsim.world_spec import WorldSpec, team
from tests.clients.mavproxy_process import Mavproxy
from tests.clients.mavsdk_waiting import first
from tests.clients.mavutil_link import mavutil_link
from tests.clients.sitl_process import free_port, running_sitl

mavlink = mavutil.mavlink
COUNT = 5
WALL_DEADLINE_S = 100.0
READY = mavlink.MAV_SYS_STATUS_PREARM_CHECK


class GroundStation:
    """mavutil with what a ground station of several vehicles does: heartbeats, and one target at a time."""

    def __init__(self, url: str) -> None:
        self.link: Any = mavutil_link(url, source_system=255, source_component=190)
        self._next_s = 0.0

    def until(self, what: str, found: Any) -> None:
        deadline_s = time.monotonic() + WALL_DEADLINE_S
        while time.monotonic() < deadline_s:
            if time.monotonic() > self._next_s:
                self._next_s = time.monotonic() + 0.2
                self.link.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)
            message = self.link.recv_match(blocking=True, timeout=0.1)
            if message is not None and found(message):
                return
        raise AssertionError(f"{what} was not seen")

    def all_ready(self) -> None:
        ready: set[int] = set()

        def found(message: Any) -> bool:
            if message.get_type() == "SYS_STATUS" and message.onboard_control_sensors_health & READY:
                ready.add(message.get_srcSystem())
            return ready == set(range(1, COUNT + 1))

        self.until("every vehicle ready", found)

    def command(self, system: int, number: int, *parameters: float) -> None:
        values = [*parameters, *(float("nan"),) * (7 - len(parameters))]
        self.link.mav.command_long_send(system, 1, number, 0, *values)
        self.until(
            f"COMMAND_ACK of vehicle {system}",
            lambda m: (
                m.get_type() == "COMMAND_ACK"
                and (m.get_srcSystem(), m.command, m.result) == (system, number, 0)
            ),
        )


def fly_one_of_them(station: GroundStation) -> None:
    """Vehicle 4 takes off, and no other does."""
    station.all_ready()
    station.command(4, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    station.command(4, mavlink.MAV_CMD_NAV_TAKEOFF)
    heights: dict[int, float] = {}

    def found(message: Any) -> bool:
        if message.get_type() == "GLOBAL_POSITION_INT":
            heights[message.get_srcSystem()] = message.relative_alt * 1e-3
        return heights.get(4, 0.0) > 2.0 and len(heights) == COUNT

    station.until("vehicle 4 in the air", found)
    assert all(height < 0.5 for system, height in heights.items() if system != 4)


@pytest.mark.slow
def test_a_link_each_to_one_port() -> None:
    """As PX4 does with 14550: every vehicle sends there from a port of its own."""
    port = free_port()
    station = GroundStation(f"udpin:127.0.0.1:{port}")
    vehicles = team(COUNT, model="iris", autopilot="px4", parameters={})
    server = SitlServer(Sitl(WorldSpec(vehicles=vehicles)), speedup=4.0, monotonic=time.monotonic)
    server.open([[Port(UdpPeer("127.0.0.1", 0, "127.0.0.1", port), "gcs")] for _ in vehicles])
    stop = threading.Event()
    running = threading.Thread(target=server.run, args=(stop.is_set,))
    running.start()
    try:
        fly_one_of_them(station)
    finally:
        stop.set()
        running.join()
        server.sitl.close()
        station.link.close()


@pytest.mark.parametrize("kind", ["udpout", pytest.param("tcpin", marks=pytest.mark.slow)])
def test_one_link_for_all(kind: str) -> None:
    port = free_port(socket.SOCK_STREAM if kind == "tcpin" else socket.SOCK_DGRAM)
    ours = f"udpin:127.0.0.1:{port}" if kind == "udpout" else f"tcp:127.0.0.1:{port}"
    options = ("--count", str(COUNT), "--gcs-link", f"{kind}:127.0.0.1:{port}")
    early = GroundStation(ours) if kind == "udpout" else None
    with running_sitl("px4", [], speedup=4.0, options=options):
        station = early or GroundStation(ours)
        fly_one_of_them(station)
        station.link.close()


def test_mavsdk_tells_systems_on_one_link_apart() -> None:
    pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")
    from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
    from mavsdk.asyncio.plugins.action import ActionAsync
    from mavsdk.asyncio.plugins.telemetry import TelemetryAsync

    port = free_port()

    async def script() -> None:
        async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
            await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
            async with asyncio.timeout(WALL_DEADLINE_S):
                while len(systems := await mavsdk.get_systems()) < COUNT:
                    await asyncio.sleep(0.05)
            flown, other = systems[1], systems[3]
            telemetry, action = TelemetryAsync(flown), ActionAsync(flown)
            await first(telemetry.subscribe_health(), lambda health: health.is_armable, "armable")
            await action.arm()
            await action.takeoff()
            await first(telemetry.subscribe_in_air(), bool, "take-off")
            assert not await TelemetryAsync(other).armed()

    options = ("--count", str(COUNT), "--gcs-link", f"udpout:127.0.0.1:{port}")
    with running_sitl("px4", [], speedup=4.0, options=options):
        asyncio.run(script())


@pytest.mark.slow
def test_mavproxy_flies_one_of_five_on_one_link(tmp_path: Path) -> None:
    pytest.importorskip("MAVProxy", reason="MAVProxy is not installed")
    port = free_port(socket.SOCK_STREAM)
    options = ("--count", str(COUNT), "--gcs-link", f"tcpin:127.0.0.1:{port}")
    with (
        running_sitl("ardupilot", [], speedup=8.0, options=options),
        Mavproxy(f"tcp:127.0.0.1:{port}", tmp_path) as station,
    ):
        station.sees("online system")
        station.type("vehicle 3")
        # before it has received of this vehicle's type MAVProxy takes it for an aircraft, with other numbers
        station.types_until("mode guided", "Mode GUIDED", 2.0)
        station.take_off(10)
