"""The onboard calibration of the compass as ArduPilot does it: start, progress, report, accept or cancel.

Source: MAVLink's DO_START_MAG_CAL, DO_ACCEPT_MAG_CAL, DO_CANCEL_MAG_CAL, MAG_CAL_PROGRESS, MAG_CAL_REPORT.
A simulated user turns the vehicle through all directions. The compass is not really turned, so no offset is
found or changed.
"""

import math
from collections.abc import Mapping
from typing import Final

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.services.channel import Source, send_to_all
from autopilot_bridge.services.commands.handlers import Command, Handler, flags, whole
from autopilot_bridge.services.microservice import AutopilotParts, Microservice

_COMPASS: Final = 0
_MASK: Final = 1 << _COMPASS
_NOTICE: Final = mavlink.MAV_SEVERITY_NOTICE
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

    @property
    def commands(self) -> Mapping[int, Handler]:
        """DO_START_MAG_CAL, DO_ACCEPT_MAG_CAL, DO_CANCEL_MAG_CAL, FIXED_MAG_CAL_YAW."""
        return {
            mavlink.MAV_CMD_DO_START_MAG_CAL: self._start,
            mavlink.MAV_CMD_DO_ACCEPT_MAG_CAL: self._accept,
            mavlink.MAV_CMD_DO_CANCEL_MAG_CAL: self._cancel,
            mavlink.MAV_CMD_FIXED_MAG_CAL_YAW: self._known_heading,
        }

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
            return self._finish(mavlink.MAG_CAL_FAILED)
        self._strengths.append(math.hypot(*self._parts.readings.magnetometer.values.tolist()))
        done = (time_us - self._start_us) / _TURNING_US
        if done >= 1.0:
            return self._finish(mavlink.MAG_CAL_SUCCESS)
        if done >= 0.0:
            self._progress(done)

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

    def _accept(self, command: Command, source: Source) -> Result:
        if self._finished != mavlink.MAG_CAL_SUCCESS or flags(command.p1) not in (0, _MASK):
            return Result.FAILED
        self._finished = None
        return Result.ACCEPTED

    def _cancel(self, command: Command, source: Source) -> Result:
        self._start_us = self._finished = None
        self._commander.situation.calibrating = False
        return Result.ACCEPTED

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
        step = mavlink.MAG_CAL_RUNNING_STEP_ONE if done < _FIRST_STEP else mavlink.MAG_CAL_RUNNING_STEP_TWO
        seen = (1 << math.floor(done * _SECTIONS)) - 1
        field = self._parts.readings.magnetometer.values.tolist()
        send_to_all(
            self._parts.broadcast,
            mavlink.MAVLink_mag_cal_progress_message(
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
        saved = int(self._autosave and status == mavlink.MAG_CAL_SUCCESS)
        send_to_all(
            self._parts.broadcast,
            mavlink.MAVLink_mag_cal_report_message(
                _COMPASS,
                _MASK,
                status,
                saved,
                math.sqrt(variance) * _MILLIGAUSS,
                *offsets,
                *(1.0, 1.0, 1.0),
                *(0.0, 0.0, 0.0),
                scale_factor=1.0,
            ),
        )
