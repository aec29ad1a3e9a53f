"""PREFLIGHT_CALIBRATION and the accelerometer calibration dialogue of ArduPilot.

Source: ArduPilot 4.6, GCS_MAVLink and AP_AccelCal: the vehicle requests a position with a COMMAND_LONG
ACCELCAL_VEHICLE_POS and a text, and a ground station answers with the same command when the vehicle is in it.
A simulated vehicle can't be turned by hand; it accepts the ground station's answer, and measures for a while.

The onboard calibration of the compass as ArduPilot does it: start, progress, report, accept or cancel.

Source: MAVLink's DO_START_MAG_CAL, DO_ACCEPT_MAG_CAL, DO_CANCEL_MAG_CAL, MAG_CAL_PROGRESS, MAG_CAL_REPORT.
A simulated user turns the vehicle through all directions. The compass is not really turned, so no offset is
found or changed.
"""

import math
from typing import Final

from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.dispatch import command, receives
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.services.channel import Source, send_to_all
from autopilot_bridge.services.commands.command import Command, flags, whole
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts

_CRITICAL: Final = dialect.MAV_SEVERITY_CRITICAL
_NOTICE: Final = dialect.MAV_SEVERITY_NOTICE
_INFO: Final = dialect.MAV_SEVERITY_INFO
_POSITIONS: Final = (
    (dialect.ACCELCAL_VEHICLE_POS_LEVEL, "level"),
    (dialect.ACCELCAL_VEHICLE_POS_LEFT, "on its LEFT side"),
    (dialect.ACCELCAL_VEHICLE_POS_RIGHT, "on its RIGHT side"),
    (dialect.ACCELCAL_VEHICLE_POS_NOSEDOWN, "nose DOWN"),
    (dialect.ACCELCAL_VEHICLE_POS_NOSEUP, "nose UP"),
    (dialect.ACCELCAL_VEHICLE_POS_BACK, "on its BACK"),
)
_MEASURE_US: Final = 1_500_000
_REPEAT_US: Final = 1_000_000
_PATIENCE_US: Final = 300_000_000
"""Without an answer for this time the calibration ends; otherwise the vehicle could never arm again."""
_FULL, _TRIM, _SIMPLE, _FORCED = 1, 2, 4, 76  # param5
_GYRO, _BAROMETER = 1, 1  # param1, param3


class ArdupilotCalibration(Microservice):
    """All calibrations of an ArduPilot vehicle except the compass. They change nothing."""

    coarse_timers = True

    def __init__(self, parts: AutopilotParts) -> None:
        self._parts = parts
        self._commander = parts.commander
        self._position: int | None = None  # index of the requested position
        self._measured_us: int | None = None
        self._requested_us = 0
        self._begun_us = 0

    @receives(dialect.MAVLink_command_ack_message)
    def _on_acknowledgement(
        self, message: dialect.MAVLink_command_ack_message, source: Source, time_us: int
    ) -> None:
        waiting = self._position is not None and self._measured_us is None
        if waiting and message.command in (0, dialect.MAV_CMD_ACCELCAL_VEHICLE_POS):
            self._measure()

    def tick(self, time_us: int) -> None:
        """Measure; request the next position, and repeat the request."""
        if self._position is None:
            return
        if not self._commander.situation.health.accelerometer:
            return self._end(dialect.ACCELCAL_VEHICLE_POS_FAILED, "Calibration FAILED")
        if self._measured_us is not None:
            if time_us >= self._measured_us:
                self._ask(self._position + 1)
        elif time_us - self._begun_us >= _PATIENCE_US:
            self._end(dialect.ACCELCAL_VEHICLE_POS_FAILED, "Calibration FAILED")
        elif time_us - self._requested_us >= _REPEAT_US:
            self._send(_POSITIONS[self._position][0])

    @command(dialect.MAV_CMD_PREFLIGHT_CALIBRATION)
    def _calibrate(self, command: Command, source: Source) -> Result:
        if self._commander.armed:
            self._parts.announce(_NOTICE, "Disarm to allow calibration")
            return Result.FAILED
        parameters = (command.p1, command.p2, command.p3, command.p4, command.x, command.y, command.z)
        gyro, _, barometer, _, accelerometer, *_ = (whole(value, 0) or 0 for value in parameters)
        if gyro == _GYRO:
            return self._if_healthy(self._commander.situation.health.gyro)
        if barometer == _BAROMETER:
            return self._pressure()
        if accelerometer == _FULL:
            self._ask(0)
            return Result.ACCEPTED
        if accelerometer == _TRIM:
            return self._trim()
        if accelerometer in (_SIMPLE, _FORCED):
            return self._if_healthy(self._commander.situation.health.accelerometer)
        return Result.UNSUPPORTED

    @staticmethod
    def _if_healthy(healthy: bool) -> Result:
        return Result.ACCEPTED if healthy else Result.FAILED

    def _pressure(self) -> Result:
        health = self._commander.situation.health
        if not health.barometer:
            return Result.FAILED
        self._parts.announce(_INFO, "Calibrating barometer")
        self._parts.announce(_INFO, "Barometer 1 calibration complete")
        if health.has_airspeed:
            self._parts.announce(_INFO, "Airspeed calibration started")
        return Result.ACCEPTED

    def _trim(self) -> Result:
        """Trim the level attitude; fails when the vehicle is tilted by more than 10 degrees."""
        roll, pitch, _ = self._commander.context.nav[nav.EULER_RAD].tolist()
        if not self._commander.situation.health.accelerometer:
            return Result.FAILED
        if not max(abs(roll), abs(pitch)) <= math.radians(10.0):
            self._parts.announce(_INFO, "trim over maximum of 10 degrees")
            return Result.FAILED
        self._parts.announce(_INFO, f"Trim OK: roll={roll:.2f} pitch={pitch:.2f} yaw=0.00")
        return Result.ACCEPTED

    # the accelerometer, one position after the other

    @command(dialect.MAV_CMD_ACCELCAL_VEHICLE_POS)
    def _vehicle_position(self, command: Command, source: Source) -> Result:
        """ACCELCAL_VEHICLE_POS: the vehicle is in the requested position."""
        if self._position is None or self._measured_us is not None:
            return Result.FAILED
        if whole(command.p1) != _POSITIONS[self._position][0]:
            return Result.FAILED
        self._measure()
        return Result.ACCEPTED

    def _measure(self) -> None:
        self._measured_us = self._commander.time_us + _MEASURE_US

    def _ask(self, index: int) -> None:
        if index == len(_POSITIONS):
            return self._end(dialect.ACCELCAL_VEHICLE_POS_SUCCESS, "Calibration successful")
        position, words = _POSITIONS[index]
        self._position, self._measured_us = index, None
        self._begun_us = self._commander.time_us
        self._commander.situation.calibrating = True
        self._parts.announce(_CRITICAL, f"Place vehicle {words} and press any key.")
        self._send(position)

    def _send(self, position: int) -> None:
        self._requested_us = self._commander.time_us
        send_to_all(
            self._parts.broadcast,
            dialect.MAVLink_command_long_message(
                0, 0, dialect.MAV_CMD_ACCELCAL_VEHICLE_POS, 0, float(position), *(0.0,) * 6
            ),
        )

    def _end(self, outcome: int, text: str) -> None:
        self._position = None
        self._commander.situation.calibrating = False
        self._parts.announce(_CRITICAL, text)
        self._send(outcome)


_COMPASS: Final = 0
_MASK: Final = 1 << _COMPASS
_TURNING_US: Final = 20_000_000
_FIRST_STEP: Final = 0.5  # of the time: a sphere is fitted, then an ellipsoid
_PROGRESS_US: Final = 500_000
_REPORT_US: Final = 1_000_000
_SECTIONS: Final = 80  # of the sphere, as bits of completion_mask
_MILLIGAUSS: Final = 1000.0


class CompassCalibration(Microservice):
    """Calibration of the one compass."""

    coarse_timers = True

    def __init__(self, parts: AutopilotParts) -> None:
        self._parts = parts
        self._commander = parts.commander
        self._start_us: int | None = None
        self._next_us = 0
        self._autosave = False
        self._finished: int | None = None  # MAG_CAL_STATUS, until it is accepted or cancelled
        self._strengths: list[float] = []

    def tick(self, time_us: int) -> None:
        """Send progress while the calibration runs, and reports when it has ended."""
        if time_us < self._next_us or (self._start_us is None and self._finished is None):
            return
        if self._finished is not None:
            self._next_us = time_us + _REPORT_US
            return self._report(self._finished)
        assert self._start_us is not None
        self._next_us = time_us + _PROGRESS_US
        if not self._commander.situation.health.magnetometer:
            return self._finish(dialect.MAG_CAL_FAILED)
        self._strengths.append(math.hypot(*self._parts.readings.magnetometer.values.tolist()))
        done = (time_us - self._start_us) / _TURNING_US
        if done >= 1.0:
            return self._finish(dialect.MAG_CAL_SUCCESS)
        if done >= 0.0:
            self._progress(done)

    @command(dialect.MAV_CMD_DO_START_MAG_CAL)
    def _start(self, command: Command, source: Source) -> Result:
        """DO_START_MAG_CAL: p1 compasses (0: all), p3 autosave, p4 delay in seconds."""
        if self._commander.armed:
            self._parts.announce(_NOTICE, "Disarm to allow calibration")
            return Result.FAILED
        mask = flags(command.p1)
        if mask not in (0, _MASK) or command.p1 < 0.0 or not self._commander.situation.health.magnetometer:
            return Result.FAILED
        delay_s = command.p4 if 0.0 <= command.p4 <= 3600.0 else 0.0
        self._start_us = self._commander.time_us + round(delay_s * 1e6)
        self._next_us = self._start_us
        self._autosave, self._finished = bool(whole(command.p3, 0)), None
        self._strengths.clear()
        self._commander.situation.calibrating = True
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_DO_ACCEPT_MAG_CAL)
    def _accept(self, command: Command, source: Source) -> Result:
        if self._finished != dialect.MAG_CAL_SUCCESS or flags(command.p1) not in (0, _MASK):
            return Result.FAILED
        self._finished = None
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_DO_CANCEL_MAG_CAL)
    def _cancel(self, command: Command, source: Source) -> Result:
        self._start_us = self._finished = None
        self._commander.situation.calibrating = False
        return Result.ACCEPTED

    @command(dialect.MAV_CMD_FIXED_MAG_CAL_YAW)
    def _known_heading(self, command: Command, source: Source) -> Result:
        """FIXED_MAG_CAL_YAW: the heading is known, so the vehicle need not be turned."""
        return Result.FAILED if self._commander.armed else Result.ACCEPTED

    def _finish(self, status: int) -> None:
        self._start_us = None
        self._commander.situation.calibrating = False
        self._finished = status
        self._next_us = self._commander.time_us + _REPORT_US
        self._report(status)
        if self._autosave:
            self._finished = None

    def _progress(self, done: float) -> None:
        step = dialect.MAG_CAL_RUNNING_STEP_ONE if done < _FIRST_STEP else dialect.MAG_CAL_RUNNING_STEP_TWO
        seen = (1 << math.floor(done * _SECTIONS)) - 1
        field = self._parts.readings.magnetometer.values.tolist()
        send_to_all(
            self._parts.broadcast,
            dialect.MAVLink_mag_cal_progress_message(
                _COMPASS,
                _MASK,
                step,
                1,
                math.floor(100.0 * done),
                list(seen.to_bytes(_SECTIONS // 8, "little")),
                *field,
            ),
        )

    def _report(self, status: int) -> None:
        """Report unchanged offsets; the fitness is the variation of the measured strength, milligauss."""
        count = len(self._strengths)
        mean = sum(self._strengths) / count if count else 0.0
        variance = sum((value - mean) ** 2 for value in self._strengths) / count if count else 0.0
        parameters = self._parts.parameters
        offsets = [parameters.get(f"COMPASS_OFS_{axis}") for axis in "XYZ"]
        saved = int(self._autosave and status == dialect.MAG_CAL_SUCCESS)
        send_to_all(
            self._parts.broadcast,
            dialect.MAVLink_mag_cal_report_message(
                _COMPASS,
                _MASK,
                status,
                saved,
                math.sqrt(variance) * _MILLIGAUSS,
                offsets[0],
                offsets[1],
                offsets[2],
                *(1.0, 1.0, 1.0),
                *(0.0, 0.0, 0.0),
                scale_factor=1.0,
            ),
        )
