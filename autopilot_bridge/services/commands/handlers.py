"""Commands as both firmwares understand them: one form for LONG and INT, and shared handlers.

Source: MAVLink command protocol (mavlink.io/en/services/command.html). A handler returns a `Result`
for the COMMAND_ACK, or None where the firmware sends no acknowledgement.
"""

import math
from abc import ABC
from typing import Final

from autopilot_bridge.commander.events import CommandDenied
from autopilot_bridge.commander.verdict import Reason, Result
from autopilot_bridge.dispatch import command
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import Command, whole
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts

_HOME_POSITION: Final = dialect.MAVLINK_MSG_ID_HOME_POSITION
_AUTOPILOT_VERSION: Final = dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION


class CommandHandlers(Microservice, ABC):
    """Commands that both flavours share; a flavour adds its own. All others are UNSUPPORTED.

    Args:
        parts: of the autopilot.
    """

    def __init__(self, parts: AutopilotParts) -> None:
        self.parts = parts
        self.commander = parts.commander

    def deny(self, command: Command, reason: Reason, result: Result) -> Result:
        """Refuse with a text, if the flavour has one."""
        self.commander.emit(CommandDenied(time_us=self.commander.time_us, command=command.id, reason=reason))
        return result

    # shared handlers

    @command(dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH)
    def return_to_launch(self, command: Command, source: Source) -> Result:
        """NAV_RETURN_TO_LAUNCH."""
        return self.commander.guidance.return_home().result

    @command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL)
    def set_message_interval(self, command: Command, source: Source) -> Result:
        """SET_MESSAGE_INTERVAL: p1 message, p2 interval in microseconds."""
        message_id = whole(command.p1)
        if message_id is None:
            return Result.DENIED
        return self.parts.intervals.set_interval(source, message_id, command.p2)

    @command(dialect.MAV_CMD_GET_MESSAGE_INTERVAL)
    def get_message_interval(self, command: Command, source: Source) -> Result:
        """GET_MESSAGE_INTERVAL: p1 message."""
        message_id = whole(command.p1)
        return Result.DENIED if message_id is None else self.parts.intervals.get_interval(source, message_id)

    @command(dialect.MAV_CMD_REQUEST_MESSAGE)
    def request_message(self, command: Command, source: Source) -> Result:
        """REQUEST_MESSAGE: p1 message, p2 as the message defines."""
        message_id = whole(command.p1)
        if message_id is None:
            return Result.DENIED
        return self.parts.intervals.request(source, message_id, command.p2)

    @command(dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES)
    def request_capabilities(self, command: Command, source: Source) -> Result:
        """REQUEST_AUTOPILOT_CAPABILITIES, the former request for AUTOPILOT_VERSION."""
        self.parts.intervals.request(source, _AUTOPILOT_VERSION)
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_GET_HOME_POSITION)
    def get_home_position(self, command: Command, source: Source) -> Result:
        """GET_HOME_POSITION, the former request for HOME_POSITION."""
        if self.commander.home.position is None:
            return Result.FAILED
        self.parts.intervals.request(source, _HOME_POSITION)
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
