"""Commands as ArduCopter takes them (docs/firmware/ardupilot.md, section 3)."""

import math

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason, Result
from autopilot_bridge.dispatch import command
from autopilot_bridge.firmware.ardupilot.commands import ArduPilotCommands
from autopilot_bridge.firmware.ardupilot.copter import modes as ardupilot_modes
from autopilot_bridge.flight.heading import Turn
from autopilot_bridge.flight.plan_reading import landing_start
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_wire import RELATIVE_FRAMES
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import Command, whole


class ArduCopterCommands(ArduPilotCommands):
    """ArduCopter's commands."""

    reposition_denied = Result.DENIED

    def commanded_mode(self, number: int) -> FlightMode | None:
        """The mode of a custom_mode number; None where a client can't select it."""
        return ardupilot_modes.commanded_mode(number)

    @command(dialect.MAV_CMD_NAV_TAKEOFF)
    def takeoff(self, command: Command, source: Source) -> Result:
        """NAV_TAKEOFF: altitude over home; in GUIDED, armed, on the ground."""
        if command.is_int and command.frame not in RELATIVE_FRAMES:
            return Result.DENIED
        if not (math.isfinite(command.z) and command.z > 0.0):
            return Result.FAILED
        down_m = self.down_from(command.z, relative=True)
        return self.commander.guidance.takeoff(down_m=down_m, yaw_rad=math.nan).result

    def change_speed(self, command: Command, source: Source) -> Result:
        """DO_CHANGE_SPEED: p1 SPEED_TYPE, p2 speed."""
        if not command.p2 > 0.0 or not math.isfinite(command.p2):
            return Result.FAILED
        self.commander.guidance.change_speed(command.p2, kind=whole(command.p1, 1) or 0)
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_NAV_LAND)
    def land(self, command: Command, source: Source) -> Result:
        """NAV_LAND: land at the current position."""
        return self.commander.guidance.land().result

    @command(dialect.MAV_CMD_DO_LAND_START)
    def land_start(self, command: Command, source: Source) -> Result:
        """DO_LAND_START: enter AUTO RTL, which needs a landing sequence. With one it is not emulated."""
        if landing_start(self.commander.missions.items) is not None:
            return Result.UNSUPPORTED
        for text in (
            "Unable to start landing sequence",
            "Mode change to AUTO RTL failed: No landing sequence found",
        ):
            self.parts.announce(dialect.MAV_SEVERITY_WARNING, text)
        return Result.FAILED

    @command(dialect.MAV_CMD_DO_PARACHUTE)
    def parachute(self, command: Command, source: Source) -> Result:
        """DO_PARACHUTE: to disable it is accepted without a parachute, too."""
        disables = whole(command.p1) == dialect.PARACHUTE_DISABLE
        return Result.ACCEPTED if disables else Result.UNSUPPORTED

    @command(dialect.MAV_CMD_CONDITION_YAW)
    def turn(self, command: Command, source: Source) -> Result:
        """CONDITION_YAW: p1 deg, p2 deg/s (0: ATC_SLEW_YAW), p3 direction, p4 1 = relative."""
        if not 0.0 <= command.p1 <= 360.0 or command.p4 not in (0.0, 1.0):
            return Result.FAILED
        self.commander.guidance.turn(
            Turn(
                math.radians(command.p1),
                direction=whole(command.p3, 0) or 0,
                rate_max_rad_s=math.radians(command.p2) if command.p2 > 0.0 else None,
                relative=command.p4 == 1.0,
            )
        )
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_DO_PAUSE_CONTINUE)
    def pause_continue(self, command: Command, source: Source) -> Result:
        """DO_PAUSE_CONTINUE: 0 holds, 1 goes on; in AUTO and GUIDED."""
        action = whole(command.p1)
        if action not in (0, 1):
            return Result.DENIED
        guidance = self.commander.guidance
        done = guidance.pause() if action == 0 else guidance.resume()
        if done.accepted:
            return Result.ACCEPTED
        if action == 0:
            return self.deny(command, Reason.WRONG_MODE, Result.FAILED)
        return Result.FAILED
