"""pymavlink's mavutil as a client over UDP flies everything a script would fly, on both flavours."""

import math
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from pymavlink import mavutil

from tests.clients.sitl_process import free_port, running_sitl

mavlink = mavutil.mavlink
SPEEDUP = 16.0
WALL_DEADLINE_S = 30.0
EKF_READY = 831  # attitude, velocity and position, as ArduPilot reports a filter that uses GPS
MODES = {
    "px4": {"hold": "LOITER", "mission": "MISSION", "offboard": "OFFBOARD", "rtl": "RTL", "land": "LAND"},
    "ardupilot": {"hold": "LOITER", "mission": "AUTO", "offboard": "GUIDED", "rtl": "RTL", "land": "LAND"},
}


class Client:
    """A small script's worth of mavutil."""

    def __init__(self, flavour: str, url: str) -> None:
        self.flavour = flavour
        self.link: Any = mavutil.mavlink_connection(url, source_system=255, source_component=190)
        self.last_heartbeat_s = 0.0
        assert self.link.wait_heartbeat(timeout=WALL_DEADLINE_S) is not None
        self.texts: list[str] = []
        if flavour == "ardupilot":
            self.link.mav.request_data_stream_send(1, 1, mavlink.MAV_DATA_STREAM_ALL, 10, 1)

    def until(self, what: str, found: Callable[[Any], bool], each: Callable[[], None] | None = None) -> Any:
        """Receive until `found(message)`; sends heartbeats, and `each` at about 10 Hz of vehicle time."""
        deadline_s = time.monotonic() + WALL_DEADLINE_S
        next_s = 0.0
        while time.monotonic() < deadline_s:
            now_s = time.monotonic()
            if now_s - self.last_heartbeat_s > 1.0 / SPEEDUP:
                self.last_heartbeat_s = now_s
                self.link.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)
            if each is not None and now_s >= next_s:
                next_s = now_s + 0.1 / SPEEDUP
                each()
            message = self.link.recv_match(blocking=True, timeout=0.05)
            if message is None:
                continue
            if message.get_type() == "STATUSTEXT":
                self.texts.append(message.text)
            if found(message):
                return message
        raise AssertionError(f"{what} was not seen; texts: {self.texts}")

    def stream_for(self, seconds: float, each: Callable[[], None]) -> None:
        """Send `each` for so long, by the vehicle's own time."""
        start = self.until("attitude", lambda m: m.get_type() == "ATTITUDE", each)
        goal_ms = start.time_boot_ms + 1000.0 * seconds
        self.until("time", lambda m: m.get_type() == "ATTITUDE" and m.time_boot_ms >= goal_ms, each)

    def command(self, command: int, *parameters: float) -> None:
        """COMMAND_LONG, and wait for an accepting acknowledgement."""
        values = (*parameters, *(0.0,) * (7 - len(parameters)))
        self.link.mav.command_long_send(1, 1, command, 0, *values)
        ack = self.until(
            f"ack of {command}", lambda m: m.get_type() == "COMMAND_ACK" and m.command == command
        )
        assert ack.result == mavlink.MAV_RESULT_ACCEPTED, (command, ack.result, self.texts)

    def set_mode(self, what: str, each: Callable[[], None] | None = None) -> None:
        """Change mode by name and see it in the heartbeat."""
        name = MODES[self.flavour][what]
        self.link.set_mode(name)
        number = self.link.mode_mapping()[name]
        if self.flavour == "px4":
            _, main, sub = number
            number = main << 16 | sub << 24
        self.until(
            f"mode {name}",
            lambda m: m.get_type() == "HEARTBEAT" and m.get_srcComponent() == 1 and m.custom_mode == number,
            each,
        )

    def ready(self) -> None:
        """Wait until the arming checks pass and there is a position."""
        self.until(
            "pre-arm check",
            lambda m: (
                m.get_type() == "SYS_STATUS"
                and bool(m.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_PREARM_CHECK)
            ),
        )
        if self.flavour == "ardupilot":  # its pre-arm check passes before there is a position to guide to
            self.until(
                "position estimate",
                lambda m: m.get_type() == "EKF_STATUS_REPORT" and m.flags & EKF_READY == EKF_READY,
            )
        self.until("global position", lambda m: m.get_type() == "GLOBAL_POSITION_INT")

    def at(
        self, north_m: float, east_m: float, height_m: float, within_m: float = 1.0
    ) -> Callable[[Any], bool]:
        """Matches LOCAL_POSITION_NED near a point."""
        goal = (north_m, east_m, -height_m)
        return lambda m: m.get_type() == "LOCAL_POSITION_NED" and math.dist((m.x, m.y, m.z), goal) < within_m

    def send_position(self, north_m: float, east_m: float, height_m: float) -> None:
        """SET_POSITION_TARGET_LOCAL_NED, position only."""
        mask = 0b110111111000
        self.link.mav.set_position_target_local_ned_send(
            0, 1, 1, mavlink.MAV_FRAME_LOCAL_NED, mask, north_m, east_m, -height_m, *(0.0,) * 8
        )

    def upload(self, items: list[tuple[int, float, float, float]]) -> None:
        """Upload (command, lat, lon, height) items."""
        self.link.mav.mission_count_send(1, 1, len(items), 0)
        while True:
            message = self.until(
                "mission request",
                lambda m: m.get_type() in ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"),
            )
            if message.get_type() == "MISSION_ACK":
                assert message.type == mavlink.MAV_MISSION_ACCEPTED
                return
            command, lat, lon, height_m = items[message.seq]
            self.link.mav.mission_item_int_send(
                1,
                1,
                message.seq,
                mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
                command,
                0,
                1,
                0,
                0,
                0,
                math.nan if self.flavour == "px4" else 0.0,
                round(lat * 1e7),
                round(lon * 1e7),
                height_m,
            )

    def landed_and_disarmed(self) -> None:
        """Wait for the heartbeat without the armed bit."""
        self.until(
            "disarm",
            lambda m: (
                m.get_type() == "HEARTBEAT"
                and m.get_srcComponent() == 1
                and not m.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
            ),
        )


@pytest.fixture(params=["px4", "ardupilot"])
def client(request: pytest.FixtureRequest) -> Iterator[Client]:
    port = free_port()
    with running_sitl(request.param, [f"udpout:127.0.0.1:{port}"], speedup=SPEEDUP):
        yield Client(request.param, f"udpin:127.0.0.1:{port}")


def take_off(client: Client, height_m: float) -> None:
    client.ready()
    if client.flavour == "ardupilot":
        client.set_mode("offboard")  # GUIDED
        client.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
        client.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, height_m)
    else:
        home = client.until("home", lambda m: m.get_type() == "HOME_POSITION")
        client.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
        client.command(
            mavlink.MAV_CMD_NAV_TAKEOFF,
            0,
            0,
            0,
            math.nan,
            math.nan,
            math.nan,
            home.altitude * 1e-3 + height_m,
        )
    client.until(
        "height",
        lambda m: m.get_type() == "GLOBAL_POSITION_INT" and m.relative_alt * 1e-3 > height_m - 0.8,
    )


def test_offboard_positions_and_return(client: Client) -> None:
    take_off(client, 10.0)
    if client.flavour == "px4":
        hover = (0.0, 0.0, 12.0)
        client.stream_for(0.5, lambda: client.send_position(*hover))  # OFFBOARD wants to see a stream first
        client.set_mode("offboard", each=lambda: client.send_position(*hover))
    for goal in ((15.0, 0.0, 12.0), (15.0, 10.0, 12.0)):
        client.until(f"position {goal}", client.at(*goal), each=lambda goal=goal: client.send_position(*goal))
    client.set_mode("rtl")
    client.landed_and_disarmed()


def test_uploaded_mission_and_landing(client: Client) -> None:
    client.ready()
    here = client.until("position", lambda m: m.get_type() == "GLOBAL_POSITION_INT")
    lat, lon = here.lat * 1e-7, here.lon * 1e-7
    items = [
        (mavlink.MAV_CMD_NAV_TAKEOFF, lat, lon, 12.0),
        (mavlink.MAV_CMD_NAV_WAYPOINT, lat + 3e-4, lon, 12.0),
        (mavlink.MAV_CMD_NAV_WAYPOINT, lat + 3e-4, lon + 3e-4, 14.0),
        (mavlink.MAV_CMD_NAV_WAYPOINT, lat, lon + 3e-4, 12.0),
    ]
    if client.flavour == "ardupilot":
        items.insert(0, (mavlink.MAV_CMD_NAV_WAYPOINT, lat, lon, 0.0))  # its item 0 is home
    client.upload(items)
    if client.flavour == "ardupilot":
        client.set_mode("offboard")  # GUIDED: AUTO is not armable
        client.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
        client.set_mode("mission")
        client.command(mavlink.MAV_CMD_MISSION_START)
    else:
        client.set_mode("mission")
        client.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    last = len(items) - 1
    client.until("last item reached", lambda m: m.get_type() == "MISSION_ITEM_REACHED" and m.seq == last)
    client.command(mavlink.MAV_CMD_NAV_LAND)
    client.landed_and_disarmed()
