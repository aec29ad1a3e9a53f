"""A script's worth of pymavlink's mavutil, for tests that fly a SITL with it."""

import math
import struct
import time
from collections.abc import Callable, Sequence
from typing import Any, Final

from pymavlink.dialects.v20 import all as mavlink

from tests.clients.mavutil_link import mavutil_link
from tests.clients.runway import PlanItem

WALL_DEADLINE_S: Final = 100.0
EKF_READY: Final = 831
"""Attitude, velocity and position, as ArduPilot reports a filter that uses GPS."""
UPLOADS: Final = 5
SETPOINTS_HZ: Final = 10.0
"""How often streamed setpoints are sent, in vehicle time."""
POSITION_ONLY: Final = 0b110111111000
"""type_mask of position setpoints."""
BUFFERED: Final = 50_000
"""More messages than a socket's buffer holds: reading them ends, however fast new ones come."""

Found = Callable[[Any], bool]
Each = Callable[[], None] | None


class Client:
    """A client on a link of its own.

    Args:
        flavour: "px4" or "ardupilot".
        url: as mavutil takes it.
        speedup: of the SITL, which says how long a second of the vehicle takes here.
        stream_hz: what is requested of ArduPilot's streams.

    Attributes:
        texts: STATUSTEXTs so far.
    """

    def __init__(self, flavour: str, url: str, *, speedup: float, stream_hz: int = 10) -> None:
        self.flavour = flavour
        self.speedup = speedup
        self.link: Any = mavutil_link(url, source_system=255, source_component=190)
        self.texts: list[str] = []
        self._heartbeat_due_s = 0.0
        assert self.link.wait_heartbeat(timeout=WALL_DEADLINE_S) is not None
        if flavour == "ardupilot":
            self.link.mav.request_data_stream_send(1, 1, mavlink.MAV_DATA_STREAM_ALL, stream_hz, 1)

    # waiting

    def until(self, what: str, found: Found, each: Each = None) -> Any:
        """Receive until `found(message)`; sends heartbeats, and `each` at SETPOINTS_HZ."""
        deadline_s = time.monotonic() + WALL_DEADLINE_S
        next_s = 0.0
        last: dict[str, Any] = {}
        while (now_s := time.monotonic()) < deadline_s:
            if now_s >= self._heartbeat_due_s:
                self._heartbeat_due_s = now_s + 1.0 / self.speedup
                self.link.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)
            if each is not None and now_s >= next_s:
                next_s = now_s + 1.0 / (SETPOINTS_HZ * self.speedup)
                each()
            message = self.link.recv_match(blocking=True, timeout=0.05)
            if message is None:
                continue
            last[message.get_type()] = message
            self._note(message)
            if found(message):
                return message
        seen = {
            name: str(last[name]) for name in ("HEARTBEAT", "ATTITUDE", "GLOBAL_POSITION_INT") if name in last
        }
        raise AssertionError(f"{what} was not seen; texts: {self.texts}; last: {seen}")

    def next(self, kind: str, found: Found = lambda message: True, each: Each = None) -> Any:
        """The next message of a kind of the autopilot's, for which `found`."""
        return self.until(
            kind,
            lambda m: (
                m.get_type() == kind and m.get_srcComponent() == mavlink.MAV_COMP_ID_AUTOPILOT1 and found(m)
            ),
            each,
        )

    def holds(self, what: str, seconds: float, kind: str, found: Found, each: Each = None) -> None:
        """Wait until all messages of a kind have satisfied `found` for so long, by the vehicle's time."""
        since_ms: int | None = None

        def long_enough(message: Any) -> bool:
            nonlocal since_ms
            if message.get_type() != kind:
                return False
            if not found(message):
                since_ms = None
                return False
            since_ms = message.time_boot_ms if since_ms is None else since_ms
            return bool(message.time_boot_ms - since_ms >= 1000.0 * seconds)

        self.until(what, long_enough, each)

    def stream_for(self, seconds: float, each: Callable[[], None]) -> None:
        """Send `each` for so long, by the vehicle's own time."""
        self.holds("time", seconds, "ATTITUDE", lambda message: True, each)

    # asking

    def result(self, command: int, *parameters: float, each: Each = None) -> int:
        """COMMAND_LONG, and the result that comes back; of PX4's two for a mode the later."""
        values = (*parameters, *(0.0,) * (7 - len(parameters)))
        self._catch_up()
        self.link.mav.command_long_send(1, 1, command, 0, *values)
        return self._acknowledged(command, each)

    def result_int(
        self, command: int, place: tuple[float, float, float], *parameters: float, relative: bool = True
    ) -> int:
        """COMMAND_INT at latitude, longitude and height over home (or the sea), and what comes back."""
        frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT if relative else mavlink.MAV_FRAME_GLOBAL_INT
        values = (*parameters, *(0.0,) * (4 - len(parameters)))
        lat, lon, height_m = place
        self._catch_up()
        self.link.mav.command_int_send(
            1, 1, frame, command, 0, 0, *values, round(lat * 1e7), round(lon * 1e7), height_m
        )
        return self._acknowledged(command)

    def _catch_up(self) -> None:
        """Read what has come since the last read: the answer to the next request needs the room."""
        for _ in range(BUFFERED):
            if (message := self.link.recv_match()) is None:
                return
            self._note(message)

    def _note(self, message: Any) -> None:
        if message.get_type() == "STATUSTEXT":
            self.texts.append(message.text.rstrip("\t"))  # a tab marks what an EVENT says too

    def _acknowledged(self, command: int, each: Each = None) -> int:
        ack = self.until(
            f"ack of {command}", lambda m: m.get_type() == "COMMAND_ACK" and m.command == command, each
        )
        return int(ack.result)

    def command(self, command: int, *parameters: float) -> None:
        """COMMAND_LONG that must be accepted."""
        result = self.result(command, *parameters)
        assert result == mavlink.MAV_RESULT_ACCEPTED, (command, result, self.texts)

    def set_mode(self, name: str, each: Each = None) -> None:
        """Change mode by its name in mavutil and see it in the heartbeat."""
        self.link.set_mode(name)
        self.sees_mode(name, each)

    def sees_mode(self, name: str, each: Each = None) -> None:
        """Wait for a mode in the heartbeat."""
        number = self.link.mode_mapping()[name]
        if self.flavour == "px4":
            _, main, sub = number
            number = main << 16 | sub << 24
        self.next("HEARTBEAT", lambda m: m.custom_mode == number, each)

    def arm(self) -> None:
        self.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)

    def message_rate(self, message_id: int, rate_hz: float) -> None:
        """SET_MESSAGE_INTERVAL; a rate of 0 switches the message off."""
        self.command(
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e6 / rate_hz if rate_hz > 0.0 else -1.0
        )

    def parameter(self, name: str) -> float:
        """Value of a parameter; PX4's integers come as bit patterns."""
        self._catch_up()
        self.link.mav.param_request_read_send(1, 1, name.encode(), -1)
        value = self.next("PARAM_VALUE", lambda m: m.param_id == name)
        if self.flavour == "px4" and value.param_type == mavlink.MAV_PARAM_TYPE_INT32:
            return float(struct.unpack("<i", struct.pack("<f", value.param_value))[0])
        return float(value.param_value)

    def upload(self, items: Sequence[PlanItem]) -> None:
        """Upload a plan, which must be accepted.

        A vehicle that is faster than real time asks for items again before a busy machine has answered, and
        gives up by itself in the end: then everything is begun anew, as ground stations' users do.
        """
        for _ in range(UPLOADS):
            result = self._uploaded(items)
            if result == mavlink.MAV_MISSION_ACCEPTED:
                return
        raise AssertionError(f"plan not accepted: {result}, {self.texts}")

    def _uploaded(self, items: Sequence[PlanItem]) -> int:
        """The MAV_MISSION_RESULT of an upload."""
        self.link.mav.mission_count_send(1, 1, len(items), 0)
        while True:
            message = self.until(
                "mission request",
                lambda m: m.get_type() in ("MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"),
            )
            if message.get_type() == "MISSION_ACK":
                return int(message.type)
            self._send_item(message.seq, items[message.seq])

    def _send_item(self, seq: int, item: PlanItem) -> None:
        lat, lon, height_m = item.place or (0.0, 0.0, 0.0)
        heading = math.nan if self.flavour == "px4" and item.place is not None else 0.0
        parameters = (*item.parameters, *(0.0, 0.0, 0.0, heading)[len(item.parameters) :])
        self.link.mav.mission_item_int_send(
            1,
            1,
            seq,
            item.frame,
            item.command,
            0,
            1,
            *parameters,
            round(lat * 1e7),
            round(lon * 1e7),
            height_m,
        )

    # usual steps

    def ready(self) -> None:
        """Wait until the arming checks pass and there is a position."""
        passed = mavlink.MAV_SYS_STATUS_PREARM_CHECK
        self.next("SYS_STATUS", lambda m: bool(m.onboard_control_sensors_health & passed))
        if self.flavour == "ardupilot":  # its pre-arm check passes before there is a position to guide to
            self.next("EKF_STATUS_REPORT", lambda m: m.flags & EKF_READY == EKF_READY)
        self.next("GLOBAL_POSITION_INT")

    def take_off(self, height_m: float) -> None:
        """Fly a multicopter straight up, in GUIDED or by the mode that PX4 takes off in."""
        self.ready()
        if self.flavour == "ardupilot":
            self.set_mode("GUIDED")
            self.arm()
            self.command(mavlink.MAV_CMD_NAV_TAKEOFF, *(0.0,) * 6, height_m)
        else:
            home = self.next("HOME_POSITION")
            self.arm()
            self.command(mavlink.MAV_CMD_NAV_TAKEOFF, *(math.nan,) * 6, home.altitude * 1e-3 + height_m)
        self.next("GLOBAL_POSITION_INT", lambda m: m.relative_alt * 1e-3 > height_m - 0.8)

    def send_position(self, north_m: float, east_m: float, height_m: float) -> None:
        """SET_POSITION_TARGET_LOCAL_NED, position only."""
        self.link.mav.set_position_target_local_ned_send(
            0, 1, 1, mavlink.MAV_FRAME_LOCAL_NED, POSITION_ONLY, north_m, east_m, -height_m, *(0.0,) * 8
        )

    def landed_and_disarmed(self) -> None:
        """Wait for the heartbeat without the armed bit."""
        self.next("HEARTBEAT", lambda m: not m.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
