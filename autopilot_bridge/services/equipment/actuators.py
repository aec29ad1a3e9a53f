"""Grippers, winches, servos, relays, motor tests and tunes, for a vehicle with few of these devices.

The simulated vehicle carries none of these devices. It accepts and refuses their commands as the firmware
does with its default configuration, and the commands drive nothing.
"""

from typing import Final

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.dispatch import command
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import Command, flags, whole
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts

_INFO: Final = dialect.MAV_SEVERITY_INFO
_WARNING: Final = dialect.MAV_SEVERITY_WARNING
_GRIPPER_ACTIONS: Final = (dialect.GRIPPER_ACTION_RELEASE, dialect.GRIPPER_ACTION_GRAB)


class Px4Actuators(Microservice):
    """PX4's answers. An action that takes time (the gripper) is acknowledged when it ends."""

    coarse_timers = True

    _MOTORS: Final = range(1, 13)  # ACTUATOR_OUTPUT_FUNCTION
    _SERVOS: Final = range(33, 41)
    _NATIVE: Final = 1000  # from here on PX4's own numbers

    def __init__(self, parts: AutopilotParts) -> None:
        self._commander = parts.commander
        self._parameters = parts.parameters
        self._moving: list[tuple[int, Source]] = []

    def tick(self, time_us: int) -> None:
        """Acknowledge a gripper action that has ended."""
        while self._moving and time_us >= self._moving[0][0]:
            _, source = self._moving.pop(0)
            source.channel.send(
                dialect.MAVLink_command_ack_message(
                    dialect.MAV_CMD_DO_GRIPPER,
                    int(Result.ACCEPTED),
                    0,
                    0,
                    source.system_id,
                    source.component_id,
                )
            )

    @command(dialect.MAV_CMD_DO_WINCH, dialect.MAV_CMD_CONFIGURE_ACTUATOR)
    def _silence(self, command: Command, source: Source) -> None:
        """No acknowledgement: there is no winch, and no output can be configured."""

    @command(dialect.MAV_CMD_DO_SET_ACTUATOR)
    def _accept(self, command: Command, source: Source) -> Result:
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_DO_AUTOTUNE_ENABLE)
    def _begin(self, command: Command, source: Source) -> Result:
        return Result.IN_PROGRESS

    @command(dialect.MAV_CMD_DO_GRIPPER)
    def _gripper(self, command: Command, source: Source) -> Result | None:
        """DO_GRIPPER: p2 GRIPPER_ACTIONS; acknowledged when it is done, after PD_GRIPPER_TO seconds."""
        if self._parameters.get("PD_GRIPPER_TYPE") < 0 or whole(command.p2) not in _GRIPPER_ACTIONS:
            return Result.FAILED
        if all(requester != source for _, requester in self._moving):  # else: a repeated request
            seconds = min(10.0, max(0.0, self._parameters.get("PD_GRIPPER_TO")))
            self._moving.append((self._commander.time_us + round(seconds * 1e6), source))
            self._moving.sort(key=lambda entry: entry[0])
        return None

    @command(dialect.MAV_CMD_ACTUATOR_TEST)
    def _test(self, command: Command, source: Source) -> Result:
        """ACTUATOR_TEST: p5 ACTUATOR_OUTPUT_FUNCTION; disarmed only."""
        if self._commander.armed or self._parameters.get("COM_MOT_TEST_EN") != 1:
            return Result.DENIED
        function = whole(command.x, 0) or 0
        known = function in self._MOTORS or function in self._SERVOS or function >= self._NATIVE
        return Result.ACCEPTED if known else Result.UNSUPPORTED


class ArdupilotActuators(Microservice):
    """The answers that are the same for all ArduPilot vehicles."""

    coarse_timers = True

    _RELAYS: Final = 6

    def __init__(self, parts: AutopilotParts) -> None:
        self._parts = parts
        self._commander = parts.commander

    @command(dialect.MAV_CMD_DO_GRIPPER)
    def _gripper(self, command: Command, source: Source) -> Result:
        """DO_GRIPPER: p2 GRIPPER_ACTIONS, with GRIP_ENABLE."""
        action = whole(command.p2)
        if not self._parts.parameters.get("GRIP_ENABLE") or action not in _GRIPPER_ACTIONS:
            return Result.FAILED
        words = "releasing" if action == dialect.GRIPPER_ACTION_RELEASE else "grabbing"
        self._parts.announce(_INFO, f"Gripper load {words}")
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_DO_SET_RELAY, dialect.MAV_CMD_DO_REPEAT_RELAY)
    def _relay(self, command: Command, source: Source) -> Result:
        """DO_SET_RELAY: p1 relay from 0, p2 off or on; a relay without RELAYn_FUNCTION 1 does not exist."""
        relay, state = whole(command.p1), whole(command.p2)
        if relay is None or state is None or not 0 <= relay < self._RELAYS:
            return Result.FAILED
        if command.id == dialect.MAV_CMD_DO_SET_RELAY and state not in (0, 1):
            return Result.FAILED
        name = f"RELAY{relay + 1}_FUNCTION"
        there = name in self._parts.parameters and self._parts.parameters.get(name) == 1
        return Result.ACCEPTED if there else Result.FAILED

    @command(dialect.MAV_CMD_DO_REPEAT_SERVO)
    def _repeat_servo(self, command: Command, source: Source) -> Result:
        """DO_REPEAT_SERVO: p1 output without a function, p3 how often."""
        channel = whole(command.p1)
        return Result.ACCEPTED if channel is not None and 5 <= channel <= 32 else Result.FAILED


class ArducopterActuators(ArdupilotActuators):
    """The additional answers of a copter."""

    _MODES: Final = {
        4: FlightMode.RETURN,
        16: FlightMode.MISSION,
        18: FlightMode.LAND,
        33: FlightMode.BRAKE,
        52: FlightMode.ACRO,
        55: FlightMode.GUIDED,
        56: FlightMode.HOLD,
        68: FlightMode.STABILIZED,
        69: FlightMode.POSHOLD,
        70: FlightMode.ALTITUDE,
        72: FlightMode.CIRCLE,
    }
    """Auxiliary functions (RCx_OPTION) that choose a mode while their switch is up."""
    _ARM_OR_DISARM: Final = 153
    _PERCENT, _PULSE, _PILOT = 0, 1, 2  # MOTOR_TEST_THROTTLE_TYPE
    _MOTORS: Final = 4
    _LONGEST_S: Final = 600.0

    def __init__(self, parts: AutopilotParts) -> None:
        super().__init__(parts)
        self._test_end_us: int | None = None

    def tick(self, time_us: int) -> None:
        """End a motor test when its time is over."""
        if self._test_end_us is not None and (time_us >= self._test_end_us or self._commander.armed):
            self._test_end_us = None
            self._parts.announce(_INFO, "finished motor test")

    @command(dialect.MAV_CMD_DO_WINCH)
    def _fail(self, command: Command, source: Source) -> Result:
        """There is no such device."""
        return Result.FAILED

    @command(dialect.MAV_CMD_DO_MOTOR_TEST)
    def _motor_test(self, command: Command, source: Source) -> Result:
        """DO_MOTOR_TEST: p1 motor from 1, p2 kind of throttle, p3 throttle, p4 seconds; disarmed."""
        motor, kind = whole(command.p1), whole(command.p2)
        if self._commander.armed:
            self._parts.announce(_WARNING, "Motor Test: disarm first")
            return Result.FAILED
        if motor is None or not 1 <= motor <= self._MOTORS:
            return Result.FAILED
        if kind not in (self._PERCENT, self._PULSE, self._PILOT) or not 0.0 <= command.p4 <= self._LONGEST_S:
            return Result.FAILED
        if self._test_end_us is None:
            self._parts.announce(_INFO, "starting motor test")
        self._test_end_us = self._commander.time_us + round(command.p4 * 1e6)
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_DO_AUX_FUNCTION)
    def _auxiliary(self, command: Command, source: Source) -> Result:
        """DO_AUX_FUNCTION: p1 function, p2 switch position 0 low, 1 middle, 2 high."""
        function, position = whole(command.p1), whole(command.p2)
        if position not in (0, 1, 2):
            return Result.DENIED
        if function == self._ARM_OR_DISARM:
            if position == 1:
                return Result.ACCEPTED
            verdict = self._commander.arm() if position == 2 else self._commander.disarm()
            return Result.ACCEPTED if verdict.accepted else Result.FAILED
        mode = self._MODES.get(-1 if function is None else function)
        if mode is None:
            return Result.FAILED
        return self._commander.set_mode(mode).result if position == 2 else Result.ACCEPTED


class ArduplaneActuators(ArdupilotActuators):
    """The additional answers of a plane."""

    @command(dialect.MAV_CMD_DO_MOTOR_TEST)
    def _fail(self, command: Command, source: Source) -> Result:
        """Motor tests are for quadplanes."""
        return Result.FAILED

    @command(dialect.MAV_CMD_DO_AUTOTUNE_ENABLE)
    def _autotune(self, command: Command, source: Source) -> Result:
        """DO_AUTOTUNE_ENABLE: accepted; the gains are not changed."""
        self._parts.announce(_INFO, f"{'Started' if flags(command.p1) else 'Stopped'} autotune")
        return Result.ACCEPTED
