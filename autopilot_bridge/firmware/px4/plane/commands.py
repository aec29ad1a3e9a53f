"""Commands as PX4 takes them on a fixed wing (docs/firmware/px4.md, sections 4 and 7)."""

import math

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander import Commander
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.firmware.px4.commands import Px4Commands
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.handlers import Command, CommandHooks


class Px4PlaneCommands(Px4Commands):
    """PX4's commands for a fixed wing: those of a multicopter, with a circle around the commanded position.

    DO_REPOSITION circles clockwise with the radius NAV_LOITER_RAD; its own radius (p3) is not read. DO_ORBIT
    has a radius and stays in Hold, which circles (`CommanderPolicy.orbit_mode`).
    """

    def __init__(self, commander: Commander, hooks: CommandHooks) -> None:
        super().__init__(commander, hooks)
        self.table = {**self.table, mavlink.MAV_CMD_DO_GO_AROUND: self.go_around}

    def takeoff(self, command: Command, source: Source) -> Result:
        """NAV_TAKEOFF: altitude over mean sea level (not set: MIS_TAKEOFF_ALT over home), centre."""
        north_m, east_m, down_m = self.ned_from(command, relative=False)
        verdict = self.commander.guidance.takeoff(
            down_m=down_m, yaw_rad=math.nan, north_m=north_m, east_m=east_m
        )
        return verdict.result

    def go_around(self, command: Command, source: Source) -> Result:
        """DO_GO_AROUND: abort a landing."""
        gone = self.commander.guidance.go_around()
        return Result.ACCEPTED if gone.accepted else Result.TEMPORARILY_REJECTED
