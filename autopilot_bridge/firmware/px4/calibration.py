"""PREFLIGHT_CALIBRATION as PX4 accepts it: acknowledged at once, then a sequence of "[cal] ..." texts."""

from typing import Final

from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.dispatch import command
from autopilot_bridge.firmware.px4 import calibration_script as scripts
from autopilot_bridge.firmware.px4.calibration_script import CalibrationScript
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import Command, whole
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts

_INFO: Final = dialect.MAV_SEVERITY_INFO
_CRITICAL: Final = dialect.MAV_SEVERITY_CRITICAL
_RADIO_OFF: Final = 1  # param4
_SCRIPTS: Final[tuple[tuple[int, int, CalibrationScript], ...]] = (
    (1, 1, scripts.GYRO),
    (2, 1, scripts.MAGNETOMETER),
    (3, 1, scripts.BAROMETER),
    (4, 2, scripts.RADIO_TRIM),
    (5, 1, scripts.ACCELEROMETER),
    (5, 2, scripts.LEVEL),
    (5, 4, scripts.QUICK_ACCELEROMETER),
    (6, 1, scripts.AIRSPEED),
    (6, 2, scripts.AIRSPEED),
)
"""(number of the parameter, its value, the calibration that it starts), in PX4's order."""
_BATTERY_IN: Final = "[cal] calibration failed: Disconnect battery and try again"


class Px4Calibration(Microservice):
    """Calibrations of a PX4 vehicle, one at a time and on the ground.

    The vehicle is in CALIBRATING during a calibration and does not arm. A calibration changes nothing: the
    navigation filter estimates the sensors' errors. A sensor that fails during its calibration makes the
    calibration fail.
    """

    coarse_timers = True

    def __init__(self, parts: AutopilotParts) -> None:
        self._commander = parts.commander
        self._announce = parts.announce
        self._running: CalibrationScript | None = None
        self._next = 0
        self._due_us = 0
        self._cancelled = False

    def tick(self, time_us: int) -> None:
        """Send the texts that are due."""
        script = self._running
        if script is None or (time_us < self._due_us and not self._cancelled):
            return
        if self._cancelled:
            self._announce(_CRITICAL, "[cal] calibration cancelled")
            return self._end()
        if script.sensor and not getattr(self._commander.situation.health, script.sensor):
            self._announce(_CRITICAL, "[cal] calibration failed: reading sensor")
            return self._end()
        while self._next < len(script.lines) and time_us >= self._due_us:
            self._announce(_INFO, script.lines[self._next].text)
            self._next += 1
            if self._next < len(script.lines):
                self._due_us += round(script.lines[self._next].after_s * 1e6)
        if self._next == len(script.lines):
            self._end()

    @command(dialect.MAV_CMD_PREFLIGHT_CALIBRATION)
    def _calibrate(self, command: Command, source: Source) -> Result:
        parameters = (command.p1, command.p2, command.p3, command.p4, command.x, command.y, command.z)
        values = [whole(value, 0) or 0 for value in parameters]
        if self._running is not None:
            if any(values):
                return Result.TEMPORARILY_REJECTED
            self._cancelled = True  # reported after the acknowledgement
            return Result.ACCEPTED
        if self._commander.armed:
            return Result.TEMPORARILY_REJECTED
        for number, value, script in _SCRIPTS:
            if values[number - 1] == value:
                return self._start(script)
        if values[3] == _RADIO_OFF:
            return self._mute(True)
        if values[6] == 1:  # ESCs are calibrated with the battery disconnected
            self._announce(_CRITICAL, _BATTERY_IN)
            return Result.DENIED
        if values[3] == 0:
            return self._mute(False)
        return Result.UNSUPPORTED

    @command(dialect.MAV_CMD_FIXED_MAG_CAL_YAW)
    def _known_heading(self, command: Command, source: Source) -> Result:
        """FIXED_MAG_CAL_YAW: the heading is known, so the vehicle need not be turned."""
        if self._commander.armed or self._running is not None:
            return Result.TEMPORARILY_REJECTED
        return self._start(scripts.QUICK_MAGNETOMETER)

    def _start(self, script: CalibrationScript) -> Result:
        self._running, self._next = script, 0
        self._due_us = self._commander.time_us
        self._commander.situation.calibrating = True
        return Result.ACCEPTED

    def _end(self) -> None:
        self._running, self._cancelled = None, False
        self._commander.situation.calibrating = False

    def _mute(self, muted: bool) -> Result:
        """The ground station calibrates the radio; meanwhile the sticks do not control the vehicle."""
        if muted is not self._commander.pilot.muted:
            self._commander.pilot.muted = muted
            self._announce(_INFO, f"Calibration: {'Disabling' if muted else 'Restoring'} RC input")
        return Result.ACCEPTED
