"""Commands as PX4 takes them, on multicopters and fixed wings (docs/firmware/px4.md, sections 4 and 7)."""

import math

from autopilot_bridge.commander.events import CommandAccepted, CommandDenied, ModeDenied
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason, Result
from autopilot_bridge.dispatch import command, receives
from autopilot_bridge.firmware.px4.copter import modes as px4_modes
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.components import GROUND_STATION_COMPONENT
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import (
    FORCE_NUMBER,
    Command,
    acknowledge,
    flags,
    on_earth,
    whole,
)
from autopilot_bridge.services.commands.handlers import CommandHandlers

_CUSTOM_MODE_FLAG = 1


class Px4Commands(CommandHandlers):
    """PX4's commands. Everything not in the table is UNSUPPORTED, as in the firmware."""

    @receives(dialect.MAVLink_set_mode_message)
    def set_mode_message(
        self, message: dialect.MAVLink_set_mode_message, source: Source, time_us: int
    ) -> None:
        """SET_MODE: acknowledged once, with the actual result."""
        main, sub = message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF
        result = self._set_mode(message.base_mode, main, sub, source)
        acknowledge(dialect.MAV_CMD_DO_SET_MODE, result, source)

    @command(dialect.MAV_CMD_DO_SET_MODE)
    def set_mode(self, command: Command, source: Source) -> Result:
        """DO_SET_MODE: p1 base mode, p2 main mode, p3 sub mode; acknowledged as accepted before it is
        executed, and once more after.
        """
        acknowledge(command.id, Result.ACCEPTED, source)
        return self._set_mode(flags(command.p1), flags(command.p2), flags(command.p3), source)

    def _set_mode(self, base_mode: int, main: int, sub: int, source: Source) -> Result:
        if not base_mode & _CUSTOM_MODE_FLAG:
            return Result.ACCEPTED  # acknowledged, and nothing changes
        mode = px4_modes.commanded_mode(main, sub)
        if mode is not None:
            # the text of a refusal is for ground stations; others see the result only
            announced = source.component_id == GROUND_STATION_COMPONENT
            return self.commander.set_mode(mode, announced=announced).result
        if main != px4_modes.MAIN_AUTO:
            return Result.ACCEPTED  # acknowledged, and nothing changes
        self.commander.emit(
            CommandDenied(
                time_us=self.commander.time_us,
                command=dialect.MAV_CMD_DO_SET_MODE,
                reason=Reason.MODE_UNKNOWN,
            )
        )
        return Result.TEMPORARILY_REJECTED

    @command(dialect.MAV_CMD_COMPONENT_ARM_DISARM)
    def arm_disarm(self, command: Command, source: Source) -> Result | None:
        """COMPONENT_ARM_DISARM: p1 rounded to 1 or 0; any other value is answered with a text only."""
        action = whole(command.p1)
        forced = whole(command.p2) == FORCE_NUMBER
        if action == 1:
            return self.commander.arm(forced=forced).result
        if action == 0:
            return self.commander.disarm(forced=forced).result
        self.deny(command, Reason.BAD_PARAMETER, Result.DENIED)
        return None

    @command(dialect.MAV_CMD_NAV_TAKEOFF)
    def takeoff(self, command: Command, source: Source) -> Result:
        """NAV_TAKEOFF: p4 yaw deg, altitude over mean sea level (not set: MIS_TAKEOFF_ALT over home)."""
        down_m = self.down_from(command.z, relative=False)
        return self.commander.guidance.takeoff(down_m=down_m, yaw_rad=math.radians(command.p4)).result

    @command(dialect.MAV_CMD_NAV_LAND)
    def land(self, command: Command, source: Source) -> Result:
        """NAV_LAND: land at the current position."""
        return self._reported(command, self.commander.guidance.land().result)

    def return_to_launch(self, command: Command, source: Source) -> Result:
        """NAV_RETURN_TO_LAUNCH."""
        return self._reported(command, super().return_to_launch(command, source))

    def _reported(self, command: Command, result: Result) -> Result:
        """Report a command that was accepted."""
        if result is Result.ACCEPTED:
            self.commander.emit(CommandAccepted(time_us=self.commander.time_us, command=command.id))
        return result

    @command(dialect.MAV_CMD_DO_REPOSITION)
    def reposition(self, command: Command, source: Source) -> Result:
        """DO_REPOSITION: p1 speed, p2 = 1 change mode, p4 yaw rad, altitude over mean sea level."""
        if flags(command.p2) != dialect.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE:
            return Result.UNSUPPORTED
        if not on_earth(command):
            return Result.DENIED
        north_m, east_m, down_m = self.ned_from(command, relative=False)
        return self.commander.guidance.reposition(
            north_m=north_m, east_m=east_m, down_m=down_m, yaw_rad=command.p4, speed_m_s=command.p1
        ).result

    @command(dialect.MAV_CMD_DO_CHANGE_ALTITUDE)
    def change_altitude(self, command: Command, source: Source) -> Result:
        """DO_CHANGE_ALTITUDE: p1 altitude over mean sea level, whatever the frame in p2."""
        down_m = self.down_from(command.p1, relative=False)
        return self.commander.guidance.reposition(north_m=math.nan, east_m=math.nan, down_m=down_m).result

    @command(dialect.MAV_CMD_DO_ORBIT)
    def orbit(self, command: Command, source: Source) -> Result:
        """DO_ORBIT: p1 radius (negative: counter-clockwise), p2 speed, p3 ORBIT_YAW_BEHAVIOUR, centre."""
        if not on_earth(command):
            return Result.DENIED
        north_m, east_m, down_m = self.ned_from(command, relative=False)
        return self.commander.guidance.orbit(
            radius_m=command.p1,
            speed_m_s=command.p2,
            yaw_behaviour=whole(command.p3, 0) or 0,
            north_m=north_m,
            east_m=east_m,
            down_m=down_m,
        ).result

    @command(dialect.MAV_CMD_DO_CHANGE_SPEED)
    def change_speed(self, command: Command, source: Source) -> Result:
        """DO_CHANGE_SPEED: p1 SPEED_TYPE, p2 speed; -1: back to the parameter's speed."""
        self.commander.guidance.change_speed(command.p2, kind=whole(command.p1, 1) or 0)
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_DO_SET_HOME)
    def set_home(self, command: Command, source: Source) -> Result:
        """DO_SET_HOME: p1 = 1: the current position, else the given one."""
        if command.p1 > 0.5:
            here = self.commander.set_home_here()
            return Result.ACCEPTED if here else Result.TEMPORARILY_REJECTED
        if not (math.isfinite(command.x) and math.isfinite(command.y) and math.isfinite(command.z)):
            return Result.DENIED
        placed = self.commander.home.command(command.x, command.y, command.z)
        return Result.ACCEPTED if placed else Result.TEMPORARILY_REJECTED

    @command(dialect.MAV_CMD_MISSION_START)
    def start_mission(self, command: Command, source: Source) -> Result:
        """MISSION_START: p1 first item. Changes the mode and arms the vehicle."""
        if self.commander.mission_problem is not None:
            return self.deny(command, Reason.MISSION_MISSING, Result.DENIED)
        first = whole(command.p1)
        if first is None or not -1 <= first < len(self.commander.missions.items):
            return Result.DENIED
        if first > 0 and not self.parts.set_current_item(first):
            return Result.DENIED
        if not self.commander.set_mode(FlightMode.MISSION).accepted:
            return Result.TEMPORARILY_REJECTED
        if self.commander.arm().accepted:
            return Result.ACCEPTED
        self.commander.emit(
            ModeDenied(
                time_us=self.commander.time_us, mode=FlightMode.MISSION, reason=Reason.MODE_NOT_ARMABLE
            )
        )
        return Result.TEMPORARILY_REJECTED

    @command(dialect.MAV_CMD_DO_LAND_START)
    def land_start(self, command: Command, source: Source) -> Result:
        """DO_LAND_START: go to the landing sequence of the mission; CANCELLED when it has none."""
        items = self.commander.missions.items
        start = next(
            (i for i, item in enumerate(items) if item.command == dialect.MAV_CMD_DO_LAND_START), None
        )
        if start is None or not self.parts.set_current_item(start):
            return Result.CANCELLED
        return self.commander.set_mode(FlightMode.MISSION).result

    @command(dialect.MAV_CMD_INJECT_FAILURE)
    def inject_failure(self, command: Command, source: Source) -> Result:
        """INJECT_FAILURE: p1 FAILURE_UNIT, p2 FAILURE_TYPE, p3 instance (0: all)."""
        unit, kind, instance = (whole(command.p1), whole(command.p2), whole(command.p3, 0))
        if self.parts.inject_failure is None:
            return Result.UNSUPPORTED
        enabled = bool(self.parts.parameters.get("SYS_FAILURE_EN"))
        if not enabled or unit is None or kind is None or instance is None:
            return Result.DENIED
        return self.parts.inject_failure(unit, kind, instance)

    @command(dialect.MAV_CMD_REQUEST_PROTOCOL_VERSION)
    def request_protocol_version(self, command: Command, source: Source) -> Result:
        """REQUEST_PROTOCOL_VERSION, the former request."""
        return self.parts.intervals.request(source, dialect.MAVLink_protocol_version_message.id)

    @command(dialect.MAV_CMD_DO_VTOL_TRANSITION, dialect.MAV_CMD_SET_CAMERA_MODE)
    def silence(self, command: Command, source: Source) -> None:
        """No acknowledgement at all, as observed on the firmware."""

    @command(dialect.MAV_CMD_DO_FLIGHTTERMINATION)
    def terminate(self, command: Command, source: Source) -> Result:
        """DO_FLIGHTTERMINATION: p1 > 0.5 stops the motors of an armed vehicle permanently.

        The circuit breaker CBRK_FLIGHTTERM keeps failures from doing so, not the command.
        """
        if not command.p1 > 0.5 or not self.commander.armed:
            return Result.DENIED
        self.commander.terminate()
        return Result.ACCEPTED


class Px4PlaneCommands(Px4Commands):
    """PX4's commands for a fixed wing: those of a multicopter, with a circle around the commanded position.

    DO_REPOSITION circles clockwise with the radius NAV_LOITER_RAD; its own radius (p3) is not read. DO_ORBIT
    has a radius and stays in Hold, which circles (`CommanderPolicy.orbit_mode`).
    """

    def takeoff(self, command: Command, source: Source) -> Result:
        """NAV_TAKEOFF: altitude over mean sea level (not set: MIS_TAKEOFF_ALT over home), centre."""
        north_m, east_m, down_m = self.ned_from(command, relative=False)
        verdict = self.commander.guidance.takeoff(
            down_m=down_m, yaw_rad=math.nan, north_m=north_m, east_m=east_m
        )
        return verdict.result

    @command(dialect.MAV_CMD_DO_GO_AROUND)
    def go_around(self, command: Command, source: Source) -> Result:
        """DO_GO_AROUND: abort a landing."""
        gone = self.commander.guidance.go_around()
        return Result.ACCEPTED if gone.accepted else Result.TEMPORARILY_REJECTED
