"""Fixes of an external GPS receiver: GPS_INPUT and HIL_GPS, as ArduPilot accepts them with GPS1_TYPE 14.

They replace the onboard receiver from boot on, and pass the same checks as its fixes. A value that is missing
in a message is unknown: missing accuracies are derived from the dilutions of precision; without a velocity
the filter uses positions only; without dilutions of precision the fix is not good enough.

Source: MAVLink common.xml (GPS_INPUT 232, HIL_GPS 113); ArduPilot 4.6 AP_GPS_MAV.
"""

import math
from typing import Final

from autopilot_bridge.dispatch import receives
from autopilot_bridge.firmware.external_mapping import GpsSource, ardupilot_gps_source
from autopilot_bridge.firmware.mapping import clamp, number
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import degrees, m_s, metres
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts
from flightsim import interface as i

_FIX_3D: Final = 3
_LAST_FIX_TYPE: Final = dialect.GPS_FIX_TYPE_PPP
_WEEK_MS: Final = 604_800_000
_LATEST_US: Final = 500_000
_DRIFT_US: Final = 20
"""Increase of the assumed shortest delay with each message, because clocks drift."""
_DRIVER_DELAY_MS: Final = 200.0
_MAX_DELAY_MS: Final = 250.0
_UNKNOWN_DOP: Final = 99.99
_UNKNOWN_ACCURACY_M: Final = 99.0
_RANGE_ERROR_M: Final = 1.0
"""Multiplied by a dilution of precision, this is the accuracy of a fix that was sent without one."""
_SPEED_ACCURACY_M_S: Final = 0.3
_MAX_ALT_M: Final = 1e5
_MAX_SPEED_M_S: Final = 400.0
_UNKNOWN_SATELLITES: Final = 255


class GpsInputService(Microservice):
    """Writes fixes received by messages in the place of the onboard receiver's samples.

    Attributes:
        taken: number of accepted fixes.
        refused: number of messages with invalid values.
    """

    def __init__(self, parts: AutopilotParts) -> None:
        self._reading = parts.readings.gps
        self._parameters = parts.parameters
        self._listens = ardupilot_gps_source(parts.parameters) is GpsSource.MESSAGES
        self._offset_us: int | None = None  # vehicle time minus sender's time, at the shortest delay
        self.taken = self.refused = 0

    @receives(dialect.MAVLink_gps_input_message)
    def _on_gps_input(self, message: dialect.MAVLink_gps_input_message, source: Source, time_us: int) -> None:
        """Only the first receiver (`gps_id`) exists."""
        if self._listens and message.gps_id == 0:
            self._take(message, _gps_input(message), time_us)

    @receives(dialect.MAVLink_hil_gps_message)
    def _on_hil_gps(self, message: dialect.MAVLink_hil_gps_message, source: Source, time_us: int) -> None:
        if self._listens:
            self._take(message, _hil_gps(message), time_us)

    def _take(
        self,
        message: dialect.MAVLink_gps_input_message | dialect.MAVLink_hil_gps_message,
        values: list[float] | None,
        time_us: int,
    ) -> None:
        if values is None:
            self.refused += 1
            return
        delay_ms = number(self._parameters, "GPS1_DELAY_MS", 0.0)
        delay_ms = clamp(delay_ms if delay_ms > 0.0 else _DRIVER_DELAY_MS, 1.0, _MAX_DELAY_MS)
        measured_us = self._sent_us(message, values, time_us) - round(1e3 * delay_ms)
        if measured_us > self._reading.time_us:
            self._reading.values[:] = values
            self._reading.time_us = measured_us
            self.taken += 1

    def _sent_us(
        self,
        message: dialect.MAVLink_gps_input_message | dialect.MAVLink_hil_gps_message,
        values: list[float],
        time_us: int,
    ) -> int:
        """The send time of a fix from its GPS time, which removes the variation of the transport delay."""
        if isinstance(message, dialect.MAVLink_hil_gps_message):
            return time_us
        if message.time_week == 0 or values[i.GPS_FIX_TYPE] < _FIX_3D:
            return time_us
        stamp_us = 1000 * (message.time_week * _WEEK_MS + message.time_week_ms)
        offset_us = time_us - stamp_us
        if self._offset_us is None or not -_LATEST_US < offset_us - self._offset_us < _LATEST_US:
            self._offset_us = offset_us  # the first message, or another clock
        else:
            self._offset_us = min(self._offset_us + _DRIFT_US, offset_us)
        return stamp_us + self._offset_us


def _gps_input(message: dialect.MAVLink_gps_input_message) -> list[float] | None:
    """The values of a GPS_INPUT; None: not a fix."""
    ignored = int(message.ignore_flags)

    def unless(flag: int, value: float) -> float:
        return math.nan if ignored & flag else float(value)

    unmoved = bool(ignored & dialect.GPS_INPUT_IGNORE_FLAG_VEL_HORIZ)
    no_climb = unmoved or bool(ignored & dialect.GPS_INPUT_IGNORE_FLAG_VEL_VERT)
    reported = (message.vn, message.ve, message.vd)[: 0 if unmoved else 2 if no_climb else 3]
    if not all(abs(part) < _MAX_SPEED_M_S for part in reported):
        return None
    return _fix(
        message,
        alt_m=0.0 if ignored & dialect.GPS_INPUT_IGNORE_FLAG_ALT else float(message.alt),
        velocity=(*reported, math.nan, math.nan, math.nan)[:3],
        hdop=unless(dialect.GPS_INPUT_IGNORE_FLAG_HDOP, message.hdop),
        vdop=unless(dialect.GPS_INPUT_IGNORE_FLAG_VDOP, message.vdop),
        eph_m=unless(dialect.GPS_INPUT_IGNORE_FLAG_HORIZONTAL_ACCURACY, message.horiz_accuracy),
        epv_m=unless(dialect.GPS_INPUT_IGNORE_FLAG_VERTICAL_ACCURACY, message.vert_accuracy),
        speed_accuracy_m_s=unless(dialect.GPS_INPUT_IGNORE_FLAG_SPEED_ACCURACY, message.speed_accuracy),
    )


def _hil_gps(message: dialect.MAVLink_hil_gps_message) -> list[float] | None:
    """The values of a HIL_GPS, which has integers."""
    return _fix(
        message,
        alt_m=metres(message.alt),
        velocity=(m_s(message.vn), m_s(message.ve), m_s(message.vd)),
        hdop=message.eph * 0.01,
        vdop=message.epv * 0.01,
    )


def _fix(
    message: dialect.MAVLink_gps_input_message | dialect.MAVLink_hil_gps_message,
    *,
    alt_m: float,
    velocity: tuple[float, ...],
    hdop: float,
    vdop: float,
    eph_m: float = math.nan,
    epv_m: float = math.nan,
    speed_accuracy_m_s: float = math.nan,
) -> list[float] | None:
    """A sample as in `flightsim.interface`; NaN: value not sent. None: invalid values."""
    fix_type, satellites = int(message.fix_type), int(message.satellites_visible)
    if fix_type > _LAST_FIX_TYPE or not abs(alt_m) < _MAX_ALT_M:
        return None
    hdop, vdop = _least(hdop, _UNKNOWN_DOP), _least(vdop, _UNKNOWN_DOP)
    values = [0.0] * i.GPS_SIZE
    values[i.GPS_LAT_DEG] = degrees(message.lat)
    values[i.GPS_LON_DEG] = degrees(message.lon)
    values[i.GPS_ALT_M] = alt_m
    values[i.GPS_VEL_NED_M_S] = velocity
    values[i.GPS_EPH_M] = min(_least(eph_m, _RANGE_ERROR_M * hdop), _UNKNOWN_ACCURACY_M)
    values[i.GPS_EPV_M] = min(_least(epv_m, _RANGE_ERROR_M * vdop), _UNKNOWN_ACCURACY_M)
    values[i.GPS_SPEED_ACCURACY_M_S] = min(
        _least(speed_accuracy_m_s, _SPEED_ACCURACY_M_S), _UNKNOWN_ACCURACY_M
    )
    values[i.GPS_FIX_TYPE] = float(fix_type)
    values[i.GPS_SATELLITES] = 0.0 if satellites == _UNKNOWN_SATELLITES else float(satellites)
    values[i.GPS_HDOP], values[i.GPS_VDOP] = min(hdop, _UNKNOWN_DOP), min(vdop, _UNKNOWN_DOP)
    return values


def _least(reported: float, otherwise: float) -> float:
    """The received value if it is valid, else the other one."""
    return reported if reported > 0.0 else otherwise
