"""Commands as both firmwares understand them: one form for LONG and INT, and shared handlers.

Source: MAVLink command protocol (mavlink.io/en/services/command.html). A handler returns a `Result`
for the COMMAND_ACK, or None where the firmware sends no acknowledgement.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander import Commander
from autopilot_bridge.commander.events import CommandDenied
from autopilot_bridge.commander.verdict import Reason, Result
from autopilot_bridge.mission_wire import UNSET_INT
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Announce, Channel, MavlinkMessage, Source

FORCE_NUMBER: Final = 21196
_LOCAL_FRAMES: Final = frozenset(
    {
        mavlink.MAV_FRAME_LOCAL_NED,
        mavlink.MAV_FRAME_LOCAL_ENU,
        mavlink.MAV_FRAME_LOCAL_OFFSET_NED,
        mavlink.MAV_FRAME_BODY_NED,
        mavlink.MAV_FRAME_BODY_OFFSET_NED,
        mavlink.MAV_FRAME_BODY_FRD,
        mavlink.MAV_FRAME_LOCAL_FRD,
        mavlink.MAV_FRAME_LOCAL_FLU,
    }
)
_HOME_POSITION: Final = mavlink.MAVLINK_MSG_ID_HOME_POSITION
_AUTOPILOT_VERSION: Final = mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION
_PROTOCOL_VERSION: Final = 300


class MessageIntervals(Protocol):
    """The service that answers the commands about messages and their rates (511, 510, 512)."""

    def set_interval(self, source: Source, message_id: int, interval_us: float) -> Result: ...

    def get_interval(self, source: Source, message_id: int) -> Result: ...

    def request(self, source: Source, message_id: int, parameter: float = 0.0) -> Result: ...


FailureHook = Callable[[int, int, int], Result]
"""Handles MAV_CMD_INJECT_FAILURE: (FAILURE_UNIT, FAILURE_TYPE, instance; 0: all)."""


class Command(NamedTuple):
    """One MAV_CMD with its parameters in natural units.

    Attributes:
        id: MAV_CMD.
        p1..p4: as the command defines; NaN: not set.
        x, y: latitude and longitude in degrees, or metres in local frames; NaN: not set.
        z: altitude or metres; NaN: not set.
        frame: MAV_FRAME; None for a COMMAND_LONG, which carries none.
    """

    id: int
    p1: float
    p2: float
    p3: float
    p4: float
    x: float
    y: float
    z: float
    frame: int | None

    @property
    def is_int(self) -> bool:
        """The command came as COMMAND_INT."""
        return self.frame is not None


def command_from_message(message: MavlinkMessage) -> Command:
    """A `Command` from a COMMAND_LONG or COMMAND_INT."""
    if message.get_msgId() == mavlink.MAVLINK_MSG_ID_COMMAND_LONG:
        x, y, z, frame = message.param5, message.param6, message.param7, None
    else:
        scale = 1e-4 if message.frame in _LOCAL_FRAMES else 1e-7
        x = math.nan if message.x == UNSET_INT else message.x * scale
        y = math.nan if message.y == UNSET_INT else message.y * scale
        z, frame = message.z, int(message.frame)
    return Command(
        int(message.command),
        float(message.param1),
        float(message.param2),
        float(message.param3),
        float(message.param4),
        float(x),
        float(y),
        float(z),
        frame,
    )


def whole(value: float, default: int | None = None) -> int | None:
    """A whole number in a parameter, rounded half away from zero; `default` if it is not finite."""
    if not math.isfinite(value):
        return default
    return math.floor(value + 0.5) if value >= 0.0 else math.ceil(value - 0.5)


def flags(value: float) -> int:
    """A bit mask in a parameter; 0 for NaN and values that are no bit mask."""
    return int(value) if math.isfinite(value) and 0.0 <= value <= 0xFFFFFFFF else 0


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandHooks:
    """The parts of the autopilot that commands need besides the commander.

    Attributes:
        intervals: message rates and requests.
        parameters: the parameter store (fence switch, reset to defaults).
        announce: sends a STATUSTEXT.
        banner: sends the texts that identify the firmware, on one channel.
        set_current_item: continues the mission from another item; False: refused.
        mission_item_count: stored items.
        inject_failure: switches sensor failures; None: not supported by this vehicle.
    """

    intervals: MessageIntervals
    parameters: ParameterStore
    announce: Announce
    banner: Callable[[Channel], None]
    set_current_item: Callable[[int], bool]
    mission_item_count: Callable[[], int]
    inject_failure: FailureHook | None = None


Handler = Callable[[Command, Source], Result | None]


class CommandHandlers(ABC):
    """Handlers that both flavours share; a flavour adds its own in `table`.

    Args:
        commander: executes the commands.
        hooks: the rest of the autopilot.
    """

    double_ack: frozenset[int] = frozenset()
    """Commands that are acknowledged as accepted before execution, and once more after it."""

    def __init__(self, commander: Commander, hooks: CommandHooks) -> None:
        self.commander = commander
        self.hooks = hooks
        self.table: Mapping[int, Handler] = {
            mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: self.return_to_launch,
            mavlink.MAV_CMD_NAV_LAND: self.land,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self.set_message_interval,
            mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: self.get_message_interval,
            mavlink.MAV_CMD_REQUEST_MESSAGE: self.request_message,
            mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: self.request_capabilities,
            mavlink.MAV_CMD_GET_HOME_POSITION: self.get_home_position,
            mavlink.MAV_CMD_RUN_PREARM_CHECKS: self.run_prearm_checks,
        }

    def execute(self, command: Command, source: Source) -> Result | None:
        """Execute a command; UNSUPPORTED for one without a handler."""
        handler = self.table.get(command.id)
        return Result.UNSUPPORTED if handler is None else handler(command, source)

    @abstractmethod
    def set_mode_message(self, base_mode: int, custom_mode: int, source: Source) -> Result | None:
        """The SET_MODE message."""

    def deny(self, command: Command, reason: Reason, result: Result) -> Result:
        """Refuse with a text, if the flavour has one."""
        self.commander.emit(CommandDenied(time_us=self.commander.time_us, command=command.id, reason=reason))
        return result

    # shared handlers

    def silence(self, command: Command, source: Source) -> None:
        """Send no acknowledgement at all, as observed on the firmware."""
        return None

    def return_to_launch(self, command: Command, source: Source) -> Result:
        """NAV_RETURN_TO_LAUNCH."""
        return self.commander.guidance.return_home().result

    def land(self, command: Command, source: Source) -> Result:
        """NAV_LAND: land at the current position."""
        return self.commander.guidance.land().result

    def set_message_interval(self, command: Command, source: Source) -> Result:
        """SET_MESSAGE_INTERVAL: p1 message, p2 interval in microseconds."""
        message_id = whole(command.p1)
        if message_id is None:
            return Result.DENIED
        return self.hooks.intervals.set_interval(source, message_id, command.p2)

    def get_message_interval(self, command: Command, source: Source) -> Result:
        """GET_MESSAGE_INTERVAL: p1 message."""
        message_id = whole(command.p1)
        return Result.DENIED if message_id is None else self.hooks.intervals.get_interval(source, message_id)

    def request_message(self, command: Command, source: Source) -> Result:
        """REQUEST_MESSAGE: p1 message, p2 as the message defines."""
        message_id = whole(command.p1)
        if message_id is None:
            return Result.DENIED
        return self.hooks.intervals.request(source, message_id, command.p2)

    def request_capabilities(self, command: Command, source: Source) -> Result:
        """REQUEST_AUTOPILOT_CAPABILITIES, the former request for AUTOPILOT_VERSION."""
        self.hooks.intervals.request(source, _AUTOPILOT_VERSION)
        return Result.ACCEPTED

    def request_protocol_version(self, command: Command, source: Source) -> Result:
        """REQUEST_PROTOCOL_VERSION, the former request."""
        return self.hooks.intervals.request(source, _PROTOCOL_VERSION)

    def get_home_position(self, command: Command, source: Source) -> Result:
        """GET_HOME_POSITION, the former request for HOME_POSITION."""
        if self.commander.home.position is None:
            return Result.FAILED
        self.hooks.intervals.request(source, _HOME_POSITION)
        return Result.ACCEPTED

    def run_prearm_checks(self, command: Command, source: Source) -> Result:
        """RUN_PREARM_CHECKS: the reasons follow as texts."""
        if self.commander.armed:
            return Result.TEMPORARILY_REJECTED
        self.commander.check_arming()
        return Result.ACCEPTED

    # places

    def ned_from(self, command: Command, *, relative: bool) -> tuple[float, float, float]:
        """(north, east, down) m of a command's position; NaN for every component that is not set.

        Args:
            relative: the altitude is over home, else over mean sea level.
        """
        context = self.commander.context
        frame = context.frame
        if frame is None:
            return math.nan, math.nan, math.nan
        north_m = east_m = math.nan
        if math.isfinite(command.x) and math.isfinite(command.y):
            north_m, east_m, _ = frame.ned_from_geodetic(command.x, command.y, frame.origin.alt_m)
        return north_m, east_m, self.down_from(command.z, relative=relative)

    def down_from(self, altitude_m: float, *, relative: bool) -> float:
        """Down coordinate of an altitude; NaN when the altitude or its reference is not known."""
        context = self.commander.context
        if context.frame is None:
            return math.nan
        reference_down_m = float(context.home_ned_m[2]) if relative else context.frame.origin.alt_m
        return reference_down_m - altitude_m


def on_earth(command: Command) -> bool:
    """Latitude and longitude are valid, or not set."""
    if not (math.isfinite(command.x) and math.isfinite(command.y)):
        return True
    return abs(command.x) <= 90.0 and abs(command.y) <= 180.0
