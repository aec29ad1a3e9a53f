"""Commands as ArduPlane takes them (docs/firmware/ardupilot.md, sections 3, 5 and 7)."""

import math
from typing import Final

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.dispatch import command
from autopilot_bridge.firmware.ardupilot.commands import ArduPilotCommands
from autopilot_bridge.firmware.ardupilot.plane import modes as ardupilot_plane_modes
from autopilot_bridge.flight.plan_reading import in_landing_sequence, landing_start
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_feasibility.ardupilot import PLANE_PARAMETERS, plane_problems
from autopilot_bridge.mission_wire import GLOBAL_FRAMES, RELATIVE_FRAMES
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import Command, whole

_CRITICAL: Final = dialect.MAV_SEVERITY_CRITICAL
_INFO: Final = dialect.MAV_SEVERITY_INFO
_AIRSPEED, _GROUND_SPEED = 0, 1  # SPEED_TYPE
_DEFAULT_SPEED: Final = -2.0
_COURSE, _HEADING = 0, 1  # HEADING_TYPE
_LEAST_TURN_M_S2: Final = 0.05
_SWITCH_HIGH: Final = 2
_SWITCHES: Final = {
    4: FlightMode.RETURN,
    16: FlightMode.MISSION,
    51: FlightMode.MANUAL,
    52: FlightMode.ACRO,
    55: FlightMode.GUIDED,
    56: FlightMode.HOLD,
    72: FlightMode.CIRCLE,
    77: FlightMode.TAKEOFF,
    92: FlightMode.FBWA,
    150: FlightMode.CRUISE,
}
"""Auxiliary functions (RCx_OPTION) that choose a mode."""


class ArduPlaneCommands(ArduPilotCommands):
    """ArduPlane's commands."""

    reposition_denied = Result.FAILED

    def commanded_mode(self, number: int) -> FlightMode | None:
        """The mode of a custom_mode number; None where a client can't select it."""
        return ardupilot_plane_modes.commanded_mode(number)

    # arming and modes

    def arm_disarm(self, command: Command, source: Source) -> Result:
        """COMPONENT_ARM_DISARM: arming is refused if a landing sequence would not be flown."""
        checked = not self.is_forced(command) and self.commander.parameters.check_arming
        if command.p1 == 1.0 and checked and not self.commander.armed:
            problem = self._mission_problem()
            if problem is not None:
                self.parts.announce(_CRITICAL, problem)
                return Result.FAILED
        return super().arm_disarm(command, source)

    def _mission_problem(self) -> str | None:
        store = self.parts.parameters
        values = {
            name: store.get(name) if name in store else usual for name, usual in PLANE_PARAMETERS.items()
        }
        return next(iter(plane_problems(self.commander.missions.items[1:], values)), None)

    def set_flight_mode(self, mode: FlightMode) -> Result:
        """Select a mode; leaving AUTO on the ground after a landing resets the mission."""
        commander = self.commander
        landed_by_mission = (
            commander.mode is FlightMode.MISSION
            and not commander.armed
            and in_landing_sequence(commander.missions)
        )
        result = super().set_flight_mode(mode)
        if landed_by_mission and result is Result.ACCEPTED and mode not in _NAVIGATING:
            self.parts.set_current_item(0)
            self.parts.announce(_INFO, "In landing sequence: mission reset")
        if mode is FlightMode.MISSION:
            self._leave_empty_mission(result)
        return result

    def start_mission(self, command: Command, source: Source) -> Result:
        """MISSION_START: AUTO from the current item."""
        result = super().start_mission(command, source)
        self._leave_empty_mission(result)
        return result

    def _leave_empty_mission(self, entered: Result) -> None:
        """Without a mission AUTO is left at once."""
        if entered is Result.ACCEPTED and len(self.commander.missions.items) <= 1:
            self.parts.announce(_INFO, "Mission complete, changing mode to RTL")
            self.commander.set_mode(FlightMode.RETURN)

    @command(dialect.MAV_CMD_DO_LAND_START)
    def land_start(self, command: Command, source: Source) -> Result:
        """DO_LAND_START: jump to the mission's landing sequence, in AUTO."""
        start = landing_start(self.commander.missions.items)
        if start is None or not self.commander.situation.position or not self.parts.set_current_item(start):
            return Result.FAILED
        return self.commander.set_mode(FlightMode.MISSION).result

    @command(dialect.MAV_CMD_NAV_TAKEOFF)
    def take_off(self, command: Command, source: Source) -> Result:
        """NAV_TAKEOFF: aircraft take off in a mission, or in mode TAKEOFF."""
        return Result.FAILED

    @command(dialect.MAV_CMD_DO_GO_AROUND)
    def go_around(self, command: Command, source: Source) -> Result:
        """DO_GO_AROUND: p1 height over home to climb to; not positive: the landing item's height."""
        height_m = command.p1 if 0.0 < command.p1 < math.inf else math.nan
        return Result.ACCEPTED if self.commander.guidance.go_around(height_m).accepted else Result.FAILED

    @command(dialect.MAV_CMD_DO_AUX_FUNCTION)
    def auxiliary(self, command: Command, source: Source) -> Result:
        """DO_AUX_FUNCTION: p1 function, p2 switch position; the functions that choose a mode."""
        mode, position = _SWITCHES.get(whole(command.p1, -1) or 0), whole(command.p2)
        if position not in (0, 1, 2):
            return Result.DENIED
        if mode is None:
            return Result.FAILED
        return self.set_flight_mode(mode) if position == _SWITCH_HIGH else Result.ACCEPTED

    # where and how fast to fly

    def radius_of(self, command: Command) -> float:
        """DO_REPOSITION: p3 radius (not positive: WP_LOITER_RAD); p4 not 0: counter-clockwise."""
        radius_m = command.p3 if command.p3 > 0.0 else abs(self.parts.parameters.get("WP_LOITER_RAD"))
        counter_clockwise = math.isfinite(command.p4) and command.p4 != 0.0
        return -radius_m if counter_clockwise else radius_m

    def change_speed(self, command: Command, source: Source) -> Result:
        """DO_CHANGE_SPEED: p1 SPEED_TYPE, p2 m/s (-2: the parameter's), p3 throttle %; AUTO and GUIDED."""
        if self.commander.mode not in (FlightMode.MISSION, FlightMode.GUIDED):
            return Result.FAILED
        parameters, kind, speed = self.parts.parameters, whole(command.p1, 0), command.p2
        guidance = self.commander.guidance
        if kind == _AIRSPEED and speed == _DEFAULT_SPEED:
            guidance.change_speed(-1.0, kind=_AIRSPEED)
            return Result.ACCEPTED
        if kind == _AIRSPEED and parameters.get("AIRSPEED_MIN") <= speed <= parameters.get("AIRSPEED_MAX"):
            guidance.change_speed(speed, kind=_AIRSPEED)
            self.parts.announce(_INFO, f"Set airspeed {speed:.0f} m/s")
            return Result.ACCEPTED
        if kind == _GROUND_SPEED and 0.0 <= speed <= 100.0:
            parameters.set("MIN_GROUNDSPEED", speed, check_range=False)
            self.parts.announce(_INFO, f"Set groundspeed {speed:.0f} m/s")
            return Result.ACCEPTED
        throttle = whole(command.p3, 0) or 0
        if 0 < throttle <= 100:
            parameters.set("TRIM_THROTTLE", throttle)
            self.parts.announce(_INFO, f"Set throttle {throttle}")
            return Result.ACCEPTED
        return Result.FAILED

    @command(dialect.MAV_CMD_GUIDED_CHANGE_SPEED)
    def change_airspeed(self, command: Command, source: Source) -> Result:
        """GUIDED_CHANGE_SPEED: p1 airspeed only, p2 m/s, p3 m/s^2 (0: at once)."""
        if self.commander.mode is not FlightMode.GUIDED:
            return Result.FAILED
        parameters = self.parts.parameters
        low, high = parameters.get("AIRSPEED_MIN"), parameters.get("AIRSPEED_MAX")
        if whole(command.p1) != _AIRSPEED or not low <= command.p2 <= high:
            return Result.DENIED
        acceleration = _magnitude(command.p3)
        self.commander.guidance.change_airspeed(command.p2, acceleration_m_s2=acceleration)
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_GUIDED_CHANGE_ALTITUDE)
    def change_altitude(self, command: Command, source: Source) -> Result:
        """GUIDED_CHANGE_ALTITUDE: p7 altitude, p3 m/s (0: at once); a COMMAND_LONG's is over home."""
        if self.commander.mode is not FlightMode.GUIDED:
            return Result.FAILED
        relative = command.frame is None or command.frame in RELATIVE_FRAMES
        if not relative and command.frame not in GLOBAL_FRAMES:
            return Result.DENIED
        if not math.isfinite(command.z) or command.z in (0.0, -1.0):
            return Result.DENIED
        down_m = self.down_from(command.z, relative=relative)
        if not math.isfinite(down_m):
            return Result.FAILED
        self.commander.guidance.change_altitude(down_m, rate_m_s=_magnitude(command.p3))
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_GUIDED_CHANGE_HEADING)
    def change_heading(self, command: Command, source: Source) -> Result:
        """GUIDED_CHANGE_HEADING: p1 HEADING_TYPE, p2 deg, p3 lateral acceleration m/s^2, at least 0.05."""
        if self.commander.mode is not FlightMode.GUIDED:
            return Result.FAILED
        kind = whole(command.p1)
        if kind not in (_COURSE, _HEADING) or not 0.0 <= command.p2 < 360.0:
            return Result.DENIED
        self.commander.guidance.change_heading(
            math.radians(command.p2),
            course=kind == _COURSE,
            acceleration_m_s2=max(_LEAST_TURN_M_S2, command.p3 if math.isfinite(command.p3) else 0.0),
        )
        return Result.ACCEPTED

    # devices

    def terminate(self, command: Command, source: Source) -> Result:
        """DO_FLIGHTTERMINATION: only with the advanced failsafe switched on."""
        if not self.parts.parameters.get("AFS_ENABLE"):
            self.parts.announce(_INFO, "AFS not enabled, can't terminate the vehicle")
            return Result.FAILED
        return super().terminate(command, source)


_NAVIGATING: Final = ardupilot_plane_modes.NAVIGATING_MODES


def _magnitude(value: float) -> float:
    return abs(value) if math.isfinite(value) else 0.0
