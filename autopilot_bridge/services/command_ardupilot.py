"""Commands as ArduCopter takes them (reference: ArduPilot 4.6.3, section 3)."""

import math

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander import Commander
from autopilot_bridge.commander.events import ModeDenied
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason, Result
from autopilot_bridge.flavours import ardupilot_modes
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.command_common import (
    AMSL_FRAMES,
    FORCE_NUMBER,
    RELATIVE_FRAMES,
    Command,
    CommandHandlers,
    CommandHooks,
    flags,
    on_earth,
    whole,
)

_CUSTOM_MODE_FLAG = 1
_SERVO_CHANNELS = 32
_WARNING = mavlink.MAV_SEVERITY_WARNING


class ArduPilotCommands(CommandHandlers):
    """ArduCopter's commands. Everything not in the table is UNSUPPORTED, as in the firmware."""

    def __init__(self, commander: Commander, hooks: CommandHooks) -> None:
        super().__init__(commander, hooks)
        self.table = {
            **self.table,
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM: self.arm_disarm,
            mavlink.MAV_CMD_DO_SET_MODE: self.set_mode,
            mavlink.MAV_CMD_NAV_TAKEOFF: self.takeoff,
            mavlink.MAV_CMD_NAV_LOITER_UNLIM: self.loiter,
            mavlink.MAV_CMD_DO_REPOSITION: self.reposition,
            mavlink.MAV_CMD_DO_CHANGE_SPEED: self.change_speed,
            mavlink.MAV_CMD_CONDITION_YAW: self.turn,
            mavlink.MAV_CMD_MISSION_START: self.start_mission,
            mavlink.MAV_CMD_DO_SET_MISSION_CURRENT: self.set_mission_current,
            mavlink.MAV_CMD_DO_SET_HOME: self.set_home,
            mavlink.MAV_CMD_DO_PAUSE_CONTINUE: self.pause_continue,
            mavlink.MAV_CMD_DO_FLIGHTTERMINATION: self.terminate,
            mavlink.MAV_CMD_DO_SET_SERVO: self.set_servo,
            mavlink.MAV_CMD_DO_GRIPPER: self.fail,
            mavlink.MAV_CMD_DO_FENCE_ENABLE: self.enable_fence,
            mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self.reboot_or_shutdown,
            mavlink.MAV_CMD_PREFLIGHT_CALIBRATION: self.calibrate,
            mavlink.MAV_CMD_PREFLIGHT_STORAGE: self.storage,
        }

    def set_mode_message(self, base_mode: int, custom_mode: int) -> None:
        """SET_MODE: works, never acknowledged."""
        self._set_mode(base_mode, custom_mode)

    def set_mode(self, command: Command, source: Source) -> Result:
        """DO_SET_MODE: p1 base mode, p2 mode number."""
        return self._set_mode(flags(command.p1), flags(command.p2))

    def _set_mode(self, base_mode: int, number: int) -> Result:
        if not base_mode & _CUSTOM_MODE_FLAG:
            return Result.DENIED
        mode = ardupilot_modes.commanded_mode(number)
        if mode is None:
            self.commander.emit(
                ModeDenied(
                    time_us=self.commander.time_us,
                    mode=None,
                    reason=Reason.MODE_UNKNOWN,
                    custom_mode=number,
                )
            )
            return Result.FAILED
        return self.commander.set_mode(mode).result

    def arm_disarm(self, command: Command, source: Source) -> Result:
        """COMPONENT_ARM_DISARM: p1 exactly 1 or 0."""
        forced = command.p2 == FORCE_NUMBER
        if command.p1 == 1.0:
            return self.commander.arm(forced=forced).result
        if command.p1 == 0.0:
            return self.commander.disarm(forced=forced).result
        return Result.UNSUPPORTED

    def takeoff(self, command: Command, source: Source) -> Result:
        """NAV_TAKEOFF: altitude over home; in GUIDED, armed, on the ground."""
        if command.is_int and command.frame not in RELATIVE_FRAMES:
            return Result.DENIED
        if not (math.isfinite(command.z) and command.z > 0.0):
            return Result.FAILED
        down_m = self.down_from(command.z, relative=True)
        return self.commander.guidance.takeoff(down_m=down_m, yaw_rad=math.nan).result

    def loiter(self, command: Command, source: Source) -> Result:
        """NAV_LOITER_UNLIM: mode LOITER."""
        return self.commander.set_mode(FlightMode.HOLD).result

    def reposition(self, command: Command, source: Source) -> Result:
        """DO_REPOSITION, COMMAND_INT only: p2 bit 0 changes to GUIDED."""
        if not command.is_int:
            return Result.UNSUPPORTED
        if command.frame not in AMSL_FRAMES | RELATIVE_FRAMES:
            self.hooks.announce(_WARNING, f"Unknown mavlink coordinate frame {command.frame}")
            return Result.DENIED
        unset = not (math.isfinite(command.x) and math.isfinite(command.y) and math.isfinite(command.z))
        if unset or not on_earth(command):
            return Result.DENIED
        change = flags(command.p2) & mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
        if not change and self.commander.mode is not FlightMode.GUIDED:
            return Result.DENIED
        north_m, east_m, down_m = self.ned_from(command, relative=command.frame in RELATIVE_FRAMES)
        verdict = self.commander.guidance.reposition(
            north_m=north_m, east_m=east_m, down_m=down_m, yaw_rad=math.nan, speed_m_s=command.p1
        )
        return Result.ACCEPTED if verdict.accepted else Result.FAILED

    def change_speed(self, command: Command, source: Source) -> Result:
        """DO_CHANGE_SPEED: p1 SPEED_TYPE, p2 speed."""
        if not command.p2 > 0.0 or not math.isfinite(command.p2):
            return Result.FAILED
        self.commander.guidance.change_speed(command.p2, kind=whole(command.p1, 1) or 0)
        return Result.ACCEPTED

    def turn(self, command: Command, source: Source) -> Result:
        """CONDITION_YAW: p1 deg, p2 deg/s, p3 direction, p4 1 = relative."""
        if not 0.0 <= command.p1 <= 360.0 or command.p4 not in (0.0, 1.0):
            return Result.FAILED
        direction = whole(command.p3, 0) or 0
        yaw_rad = math.radians(command.p1)
        if command.p4 == 1.0:
            yaw_rad = self.heading_rad() + (-yaw_rad if direction < 0 else yaw_rad)
        self.commander.guidance.turn(yaw_rad)
        return Result.ACCEPTED

    def start_mission(self, command: Command, source: Source) -> Result:
        """MISSION_START: whole missions only."""
        if (whole(command.p1, 0) or 0) != 0 or (whole(command.p2, 0) or 0) != 0:
            return Result.DENIED
        return self.commander.guidance.start_mission().result

    def set_mission_current(self, command: Command, source: Source) -> Result:
        """DO_SET_MISSION_CURRENT: p1 item."""
        item = whole(command.p1)
        if item is None or not 0 <= item < self.hooks.mission_item_count():
            return Result.DENIED
        return Result.ACCEPTED if self.hooks.set_current_item(item) else Result.FAILED

    def set_home(self, command: Command, source: Source) -> Result:
        """DO_SET_HOME: p1 = 1, or no place at all: here."""
        nowhere = command.x == 0.0 and command.y == 0.0
        if command.p1 == 1.0 or nowhere:
            return Result.ACCEPTED if self.commander.set_home_here() else Result.FAILED
        if not (math.isfinite(command.x) and math.isfinite(command.y) and math.isfinite(command.z)):
            return Result.DENIED
        if not on_earth(command):
            return Result.DENIED
        altitude_m = command.z
        home = self.commander.home.position
        if command.frame in RELATIVE_FRAMES and home is not None:
            altitude_m += home.alt_m
        placed = self.commander.set_home(command.x, command.y, altitude_m)
        return Result.ACCEPTED if placed else Result.FAILED

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

    def terminate(self, command: Command, source: Source) -> Result:
        """DO_FLIGHTTERMINATION: p1 > 0.5 stops the motors for good."""
        if not command.p1 > 0.5:
            return Result.FAILED
        self.commander.terminate()
        return Result.ACCEPTED

    def set_servo(self, command: Command, source: Source) -> Result:
        """DO_SET_SERVO: outputs without a function can be set (and drive nothing here)."""
        channel = whole(command.p1)
        if channel is None or not 5 <= channel <= _SERVO_CHANNELS:  # 1 to 4 are motors
            return Result.FAILED
        return Result.ACCEPTED

    def fail(self, command: Command, source: Source) -> Result:
        """FAILED: there is no such device."""
        return Result.FAILED

    def enable_fence(self, command: Command, source: Source) -> Result:
        """DO_FENCE_ENABLE: 0 off, 1 on, 2 off near the ground only."""
        action = whole(command.p1)
        if action not in (0, 1, 2):
            return Result.FAILED
        if action != 2 and "FENCE_ENABLE" in self.hooks.parameters:
            self.hooks.parameters.set("FENCE_ENABLE", action)
        return Result.ACCEPTED

    def reboot_or_shutdown(self, command: Command, source: Source) -> Result:
        """PREFLIGHT_REBOOT_SHUTDOWN: 1 and 3 reboot, when disarmed."""
        if whole(command.p1) not in (1, 3):
            return Result.UNSUPPORTED
        return Result.ACCEPTED if self.reboot() is Result.ACCEPTED else Result.FAILED

    def calibrate(self, command: Command, source: Source) -> Result:
        """PREFLIGHT_CALIBRATION: gyro and pressure are in order; nothing or more is unsupported."""
        asked = [command.p1, command.p2, command.p3, command.p4, command.x, command.y, command.z]
        wanted = {index for index, value in enumerate(asked) if whole(value, 0)}
        if not wanted or not wanted <= {0, 2}:
            return Result.UNSUPPORTED
        return Result.FAILED if self.commander.armed else Result.ACCEPTED

    def storage(self, command: Command, source: Source) -> Result:
        """PREFLIGHT_STORAGE: only the reset of all parameters."""
        if whole(command.p1) != 2 or self.commander.armed:
            return Result.DENIED
        for definition in self.hooks.parameters.definitions:
            self.hooks.parameters.set(definition.name, definition.default, check_range=False)
        return Result.ACCEPTED
