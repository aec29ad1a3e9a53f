"""A MAV_CMD in one form for COMMAND_LONG and COMMAND_INT, and the numbers in its parameters.

Source: MAVLink command protocol (mavlink.io/en/services/command.html).
"""

import math
from collections.abc import Callable
from typing import Final, NamedTuple

from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import degrees
from autopilot_bridge.mission_wire import UNSET_INT
from autopilot_bridge.services.channel import Source

FORCE_NUMBER: Final = 21196
_LOCAL_M: Final = 1e-4
_LOCAL_FRAMES: Final = frozenset(
    {
        dialect.MAV_FRAME_LOCAL_NED,
        dialect.MAV_FRAME_LOCAL_ENU,
        dialect.MAV_FRAME_LOCAL_OFFSET_NED,
        dialect.MAV_FRAME_BODY_NED,
        dialect.MAV_FRAME_BODY_OFFSET_NED,
        dialect.MAV_FRAME_BODY_FRD,
        dialect.MAV_FRAME_LOCAL_FRD,
        dialect.MAV_FRAME_LOCAL_FLU,
    }
)


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


def command_from_message(
    message: dialect.MAVLink_command_long_message | dialect.MAVLink_command_int_message,
) -> Command:
    """A `Command` from a COMMAND_LONG or COMMAND_INT."""
    frame: int | None = None
    if isinstance(message, dialect.MAVLink_command_long_message):
        x, y, z = message.param5, message.param6, message.param7
    else:
        z, frame = message.z, message.frame
        x, y = _coordinate(message.x, frame), _coordinate(message.y, frame)
    return Command(
        message.command, message.param1, message.param2, message.param3, message.param4, x, y, z, frame
    )


def _coordinate(value: int, frame: int) -> float:
    """Metres of a COMMAND_INT's x or y in a local frame, else degrees; NaN: not set."""
    if value == UNSET_INT:
        return math.nan
    return value * _LOCAL_M if frame in _LOCAL_FRAMES else degrees(value)


def whole(value: float, default: int | None = None) -> int | None:
    """A whole number in a parameter, rounded half away from zero; `default` if it is not finite."""
    if not math.isfinite(value):
        return default
    return math.floor(value + 0.5) if value >= 0.0 else math.ceil(value - 0.5)


def flags(value: float) -> int:
    """A bit mask in a parameter; 0 for NaN and values that are no bit mask."""
    return int(value) if math.isfinite(value) and 0.0 <= value <= 0xFFFFFFFF else 0


def on_earth(command: Command) -> bool:
    """Latitude and longitude are valid, or not set."""
    if not (math.isfinite(command.x) and math.isfinite(command.y)):
        return True
    return abs(command.x) <= 90.0 and abs(command.y) <= 180.0


Handler = Callable[[Command, Source], Result | None]
"""Executes a command; the result for the COMMAND_ACK, or None where the firmware sends none."""


def acknowledge(command: int, result: Result, source: Source) -> None:
    """Send a COMMAND_ACK to the client that has sent the command."""
    source.channel.send(
        dialect.MAVLink_command_ack_message(command, int(result), 0, 0, source.system_id, source.component_id)
    )
