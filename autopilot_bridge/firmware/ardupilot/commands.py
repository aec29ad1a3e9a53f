"""Commands as every ArduPilot vehicle takes them (docs/firmware/ardupilot.md, section 3)."""

import math
from abc import abstractmethod
from typing import ClassVar

from autopilot_bridge.commander.events import ModeDenied
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason, Result
from autopilot_bridge.dispatch import command, receives
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_wire import GLOBAL_FRAMES, RELATIVE_FRAMES
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import FORCE_NUMBER, Command, flags, on_earth, whole
from autopilot_bridge.services.commands.handlers import CommandHandlers

_CUSTOM_MODE_FLAG = 1
_SERVO_CHANNELS = 32
_FIRST_FREE_SERVO = 5  # 1 to 4 are motors or surfaces
_WARNING = dialect.MAV_SEVERITY_WARNING


class ArduPilotCommands(CommandHandlers):
    """ArduPilot's commands; a vehicle adds its own. Everything not in the table is UNSUPPORTED, as in the
    firmware.

    Attributes:
        reposition_denied: result of a DO_REPOSITION that may not change the mode and is not in GUIDED.
    """

    reposition_denied: ClassVar[Result]

    @abstractmethod
    def commanded_mode(self, number: int) -> FlightMode | None:
        """The mode of a custom_mode number; None where a client can't select it."""

    @receives(dialect.MAVLink_set_mode_message)
    def set_mode_message(
        self, message: dialect.MAVLink_set_mode_message, source: Source, time_us: int
    ) -> None:
        """SET_MODE: works, never acknowledged."""
        self._set_mode(message.base_mode, message.custom_mode)

    @command(dialect.MAV_CMD_DO_SET_MODE)
    def set_mode(self, command: Command, source: Source) -> Result:
        """DO_SET_MODE: p1 base mode, p2 mode number."""
        return self._set_mode(flags(command.p1), flags(command.p2))

    def _set_mode(self, base_mode: int, number: int) -> Result:
        if not base_mode & _CUSTOM_MODE_FLAG:
            return Result.DENIED
        mode = self.commanded_mode(number)
        if mode is None:
            self.commander.emit(
                ModeDenied(
                    time_us=self.commander.time_us, mode=None, reason=Reason.MODE_UNKNOWN, custom_mode=number
                )
            )
            return Result.FAILED
        return self.set_flight_mode(mode)

    def set_flight_mode(self, mode: FlightMode) -> Result:
        """Select a mode that a client has requested."""
        return self.commander.set_mode(mode).result

    @staticmethod
    def is_forced(command: Command) -> bool:
        """COMPONENT_ARM_DISARM: p2 holds the number that overrides the checks."""
        return command.p2 == FORCE_NUMBER

    @command(dialect.MAV_CMD_COMPONENT_ARM_DISARM)
    def arm_disarm(self, command: Command, source: Source) -> Result:
        """COMPONENT_ARM_DISARM: p1 exactly 1 or 0."""
        forced = self.is_forced(command)
        if command.p1 == 1.0:
            return self.commander.arm(forced=forced).result
        if command.p1 == 0.0:
            return self.commander.disarm(forced=forced).result
        return Result.UNSUPPORTED

    @command(dialect.MAV_CMD_NAV_LOITER_UNLIM)
    def loiter(self, command: Command, source: Source) -> Result:
        """NAV_LOITER_UNLIM: mode LOITER."""
        return self.commander.set_mode(FlightMode.HOLD).result

    @command(dialect.MAV_CMD_DO_REPOSITION)
    def reposition(self, command: Command, source: Source) -> Result:
        """DO_REPOSITION, COMMAND_INT only: p2 bit 0 changes to GUIDED."""
        if not command.is_int:
            return Result.UNSUPPORTED
        if command.frame not in GLOBAL_FRAMES | RELATIVE_FRAMES:
            self.parts.announce(_WARNING, f"Unknown mavlink coordinate frame {command.frame}")
            return Result.DENIED
        unset = not (math.isfinite(command.x) and math.isfinite(command.y) and math.isfinite(command.z))
        if unset or not on_earth(command):
            return Result.DENIED
        change = flags(command.p2) & dialect.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
        if not change and self.commander.mode is not FlightMode.GUIDED:
            return self.reposition_denied
        north_m, east_m, down_m = self.ned_from(command, relative=command.frame in RELATIVE_FRAMES)
        verdict = self.commander.guidance.reposition(
            north_m=north_m,
            east_m=east_m,
            down_m=down_m,
            speed_m_s=command.p1,
            radius_m=self.radius_of(command),
        )
        return Result.ACCEPTED if verdict.accepted else Result.FAILED

    def radius_of(self, command: Command) -> float:
        """Radius of DO_REPOSITION's circle, positive clockwise; NaN: there is none."""
        return math.nan

    @command(dialect.MAV_CMD_DO_CHANGE_SPEED)
    @abstractmethod
    def change_speed(self, command: Command, source: Source) -> Result:
        """DO_CHANGE_SPEED: p1 SPEED_TYPE, p2 speed."""

    @command(dialect.MAV_CMD_MISSION_START)
    def start_mission(self, command: Command, source: Source) -> Result:
        """MISSION_START: whole missions only."""
        if (whole(command.p1, 0) or 0) != 0 or (whole(command.p2, 0) or 0) != 0:
            return Result.DENIED
        return self.commander.guidance.start_mission().result

    @command(dialect.MAV_CMD_DO_SET_MISSION_CURRENT)
    def set_mission_current(self, command: Command, source: Source) -> Result:
        """DO_SET_MISSION_CURRENT: p1 item."""
        item = whole(command.p1)
        if item is None or not 0 <= item < len(self.commander.missions.items):
            return Result.DENIED
        return Result.ACCEPTED if self.parts.set_current_item(item) else Result.FAILED

    @command(dialect.MAV_CMD_DO_SET_HOME)
    def set_home(self, command: Command, source: Source) -> Result:
        """DO_SET_HOME: p1 = 1, or no position given: the current position."""
        nowhere = command.x == 0.0 and command.y == 0.0
        if command.p1 == 1.0 or nowhere:
            return Result.ACCEPTED if self.commander.set_home_here() else Result.FAILED
        if not (math.isfinite(command.x) and math.isfinite(command.y) and math.isfinite(command.z)):
            return Result.DENIED
        if not on_earth(command):
            return Result.FAILED
        altitude_m = command.z
        home = self.commander.home.position
        if command.frame in RELATIVE_FRAMES and home is not None:
            altitude_m += home.alt_m
        placed = self.commander.home.command(command.x, command.y, altitude_m)
        return Result.ACCEPTED if placed else Result.FAILED

    @command(dialect.MAV_CMD_DO_FLIGHTTERMINATION)
    def terminate(self, command: Command, source: Source) -> Result:
        """DO_FLIGHTTERMINATION: p1 > 0.5 stops the motors permanently."""
        if not command.p1 > 0.5:
            return Result.FAILED
        self.commander.terminate()
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_DO_SET_SERVO)
    def set_servo(self, command: Command, source: Source) -> Result:
        """DO_SET_SERVO: outputs without a function can be set (and drive nothing here)."""
        channel = whole(command.p1)
        if channel is None or not _FIRST_FREE_SERVO <= channel <= _SERVO_CHANNELS:
            return Result.FAILED
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_DO_SEND_BANNER)
    def send_banner(self, command: Command, source: Source) -> Result:
        """DO_SEND_BANNER: send the texts of the firmware's version on the requesting channel."""
        self.parts.banner(source.channel)
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_RUN_PREARM_CHECKS)
    def run_prearm_checks(self, command: Command, source: Source) -> Result:
        """RUN_PREARM_CHECKS: the reasons follow as texts."""
        if self.commander.armed:
            return Result.TEMPORARILY_REJECTED
        self.commander.check_arming()
        return Result.ACCEPTED
