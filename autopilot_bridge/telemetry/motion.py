"""The fastest messages, packed and framed by compiled kernels straight from the navigation state.

Six messages make up three quarters of PX4's onboard traffic. Their payloads are stored consecutively in a
record with exactly the layout of the wire. One call fills all of them, another makes frames of those that are
due on a channel.
"""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.mavlink import FrameEncoder, dialect
from autopilot_bridge.mavlink.definitions import definition
from autopilot_bridge.mavlink.frame import OVERHEAD_V2
from autopilot_bridge.navigation import NavigationFilter
from autopilot_bridge.navigation import layout as n
from autopilot_bridge.navigation.states import ATT, POS, VEL
from autopilot_bridge.telemetry.records import record_type, whole
from autopilot_bridge.telemetry.streams import Builder
from autopilot_bridge.telemetry.view import TelemetryView, pressure_altitude_m
from flightsim import interface
from flightsim.foundation.kernels import bound, kernel
from flightsim.interface import SensorReadings

Array = NDArray[np.float64]

MESSAGES: Final = (
    "ATTITUDE",
    "ATTITUDE_QUATERNION",
    "LOCAL_POSITION_NED",
    "GLOBAL_POSITION_INT",
    "HIGHRES_IMU",
    "ODOMETRY",
)
_POSE_POSITION: Final = (0, 6, 11)  # diagonal of an upper-triangular 6x6 covariance, row by row
_POSE_ATTITUDE: Final = (15, 18, 20)
_INERTIAL_FIELDS: Final = 0x3F  # of HIGHRES_IMU.fields_updated: accelerometer and gyro, in every message
_MAG_FIELDS: Final = 0x1C0
_BARO_FIELDS: Final = 0x1A00  # pressure, pressure altitude, temperature
_DIFFERENTIAL_FIELD: Final = 0x400
_PLACE_SIZE: Final = 3  # latitude and longitude in degrees, altitude in metres
_GYRO: Final[int] = interface.IMU_GYRO_FRD_RAD_S.start
_ACCEL: Final[int] = interface.IMU_ACCEL_FRD_M_S2.start
_MAG: Final[int] = interface.MAG_FRD_GAUSS.start
_NEED_ATTITUDE: Final = 0b100011  # bits of MESSAGES
_NEED_FRAME: Final = 0b001000
_NEED_SENSORS: Final = 0b010000
_pressure_altitude_m = kernel(pressure_altitude_m)


@kernel
def _fill(
    nav: Array,
    imu: Array,
    mag: Array,
    baro: Array,
    pitot: Array,
    covariance: Array,
    place: Array,
    home_ned_m: Array,
    out: NDArray[np.void],
    time_us: int,
) -> None:
    roll, pitch, yaw = nav[n.ROLL], nav[n.PITCH], nav[n.YAW]
    north, east, down = nav[n.POS], nav[n.POS + 1], nav[n.POS + 2]
    vn, ve, vd = nav[n.VEL], nav[n.VEL + 1], nav[n.VEL + 2]
    wx, wy, wz = nav[n.RATES], nav[n.RATES + 1], nav[n.RATES + 2]
    gx, gy, gz = imu[_GYRO], imu[_GYRO + 1], imu[_GYRO + 2]
    ax, ay, az = imu[_ACCEL], imu[_ACCEL + 1], imu[_ACCEL + 2]
    r = out[0]
    time_ms = time_us // 1000
    r.attitude__time_boot_ms = time_ms
    r.attitude__roll, r.attitude__pitch, r.attitude__yaw = roll, pitch, yaw
    r.attitude__rollspeed, r.attitude__pitchspeed, r.attitude__yawspeed = wx, wy, wz

    r.attitude_quaternion__time_boot_ms = time_ms
    r.attitude_quaternion__q1, r.attitude_quaternion__q2 = nav[n.Q], nav[n.Q + 1]
    r.attitude_quaternion__q3, r.attitude_quaternion__q4 = nav[n.Q + 2], nav[n.Q + 3]
    r.attitude_quaternion__rollspeed = wx
    r.attitude_quaternion__pitchspeed = wy
    r.attitude_quaternion__yawspeed = wz

    r.local_position_ned__time_boot_ms = time_ms
    r.local_position_ned__x, r.local_position_ned__y, r.local_position_ned__z = north, east, down
    r.local_position_ned__vx, r.local_position_ned__vy, r.local_position_ned__vz = vn, ve, vd

    r.global_position_int__time_boot_ms = time_ms
    r.global_position_int__lat = whole(place[0] * 1e7, 1.8e9)
    r.global_position_int__lon = whole(place[1] * 1e7, 1.8e9)
    r.global_position_int__alt = whole(place[2] * 1e3, 2e9)
    home_down_m = home_ned_m[2] if home_ned_m[2] == home_ned_m[2] else 0.0
    r.global_position_int__relative_alt = whole((home_down_m - down) * 1e3, 2e9)
    r.global_position_int__vx = whole(vn * 100.0, 32767.0)
    r.global_position_int__vy = whole(ve * 100.0, 32767.0)
    r.global_position_int__vz = whole(vd * 100.0, 32767.0)
    r.global_position_int__hdg = whole(math.degrees(yaw) % 360.0 * 100.0, 36000.0) % 36000

    r.highres_imu__time_usec = time_us
    r.highres_imu__xacc, r.highres_imu__yacc, r.highres_imu__zacc = ax, ay, az
    r.highres_imu__xgyro, r.highres_imu__ygyro, r.highres_imu__zgyro = gx, gy, gz
    field_known = mag[_MAG] == mag[_MAG]
    r.highres_imu__xmag = mag[_MAG] if field_known else 0.0
    r.highres_imu__ymag = mag[_MAG + 1] if field_known else 0.0
    r.highres_imu__zmag = mag[_MAG + 2] if field_known else 0.0
    r.highres_imu__abs_pressure = baro[interface.BARO_PRESSURE_PA]  # in pascal, as PX4 fills it
    difference_pa = pitot[interface.AIRSPEED_DIFFERENTIAL_PRESSURE_PA]
    r.highres_imu__diff_pressure = difference_pa if difference_pa == difference_pa else 0.0
    r.highres_imu__pressure_alt = _pressure_altitude_m(max(0.0, baro[interface.BARO_PRESSURE_PA]))
    r.highres_imu__temperature = imu[interface.IMU_TEMPERATURE_C]

    r.odometry__time_usec = time_us
    r.odometry__x, r.odometry__y, r.odometry__z = north, east, down
    r.odometry__vx, r.odometry__vy, r.odometry__vz = vn, ve, vd
    r.odometry__rollspeed, r.odometry__pitchspeed, r.odometry__yawspeed = wx, wy, wz
    for k in range(4):
        r.odometry__q[k] = nav[n.Q + k]
    for k in range(3):
        r.odometry__pose_covariance[_POSE_POSITION[k]] = covariance[POS + k, POS + k]
        r.odometry__pose_covariance[_POSE_ATTITUDE[k]] = covariance[ATT + k, ATT + k]
        r.odometry__velocity_covariance[_POSE_POSITION[k]] = covariance[VEL + k, VEL + k]


def _crc_table() -> NDArray[np.uint16]:
    """CRC-16/MCRF4XX by bytes (MAVLink guide, "Checksum": polynomial 0x1021, reflected)."""
    table = np.zeros(256, np.uint16)
    for byte in range(256):
        crc = byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
        table[byte] = crc
    return table


def _parts() -> NDArray[np.int64]:
    """(n, 4) of `MESSAGES`: first byte in the record, size, message id, CRC_EXTRA."""
    parts = np.zeros((len(MESSAGES), 4), np.int64)
    start = 0
    for index, found in enumerate(map(definition, MESSAGES)):
        parts[index] = start, found.size, found.message_id, found.crc_extra
        start += found.size
    return parts


_CRC_TABLE: Final = _crc_table()
_PARTS: Final = _parts()


@kernel
def _frames(record: NDArray[np.uint8], out: NDArray[np.uint8], due: int, sender: int, sequence: int) -> int:
    """MAVLink 2 frames of the parts whose bit is set in `due`, in sequence; returns their length.

    Args:
        sender: system id x 256 + component id.
    """
    end = 0
    for part in range(_PARTS.shape[0]):
        if not due >> part & 1:
            continue
        first, size, message_id = _PARTS[part, 0], _PARTS[part, 1], _PARTS[part, 2]
        while size > 1 and record[first + size - 1] == 0:
            size -= 1
        out[end] = 0xFD
        out[end + 1] = size
        out[end + 2] = 0
        out[end + 3] = 0
        out[end + 4] = sequence & 0xFF
        out[end + 5] = sender >> 8
        out[end + 6] = sender & 0xFF
        out[end + 7] = message_id & 0xFF
        out[end + 8] = message_id >> 8 & 0xFF
        out[end + 9] = message_id >> 16 & 0xFF
        for i in range(size):
            out[end + 10 + i] = record[first + i]
        crc = 0xFFFF
        for i in range(end + 1, end + 10 + size):
            crc = crc >> 8 ^ int(_CRC_TABLE[(crc ^ int(out[i])) & 0xFF])
        crc = crc >> 8 ^ int(_CRC_TABLE[(crc ^ _PARTS[part, 3]) & 0xFF])
        end += 10 + size
        out[end] = crc & 0xFF
        out[end + 1] = crc >> 8
        end += 2
        sequence += 1
    return end


class MotionMessages:
    """Payloads of the messages in `MESSAGES`.

    Attributes:
        bits: message id -> its bit in `packet`.

    Args:
        view: provides the time of the step.
        context: local frame and home.
        navigation: the filter; without an attitude, messages with an attitude are not made.
        readings: the IMU, magnetometer and barometer behind HIGHRES_IMU.
    """

    def __init__(
        self,
        view: TelemetryView,
        context: FlightContext,
        navigation: NavigationFilter,
        readings: SensorReadings,
    ) -> None:
        self._view = view
        self._context = context
        self._navigation = navigation
        self._readings = readings
        self._place = np.zeros(_PLACE_SIZE)
        self._time_us = -1
        self._marked_us = -1
        self._groups = (
            (readings.magnetometer, _MAG_FIELDS),
            (readings.barometer, _BARO_FIELDS),
            (readings.airspeed, _DIFFERENTIAL_FIELD),
        )
        self._sent_us = [-1] * len(self._groups)  # times of the readings that HIGHRES_IMU has had
        self._record = np.zeros(1, record_type(*map(definition, MESSAGES), prefixed=True))
        self._bytes = self._record.view(np.uint8).data
        row = self._record[0]
        row["odometry__frame_id"] = row["odometry__child_frame_id"] = dialect.MAV_FRAME_LOCAL_NED
        row["odometry__estimator_type"] = dialect.MAV_ESTIMATOR_TYPE_AUTOPILOT
        row["odometry__pose_covariance"] = row["odometry__velocity_covariance"] = math.nan
        self._slices = {
            name: slice(first, first + size)
            for name, (first, size, _, _) in zip(MESSAGES, _PARTS.tolist(), strict=True)
        }
        self._packet = np.zeros(self._record.nbytes + len(MESSAGES) * OVERHEAD_V2, np.uint8)
        self._packet_bytes = self._packet.data
        self._make_frames = bound(_frames, self._record.view(np.uint8), self._packet, then=(0, 0, 0))
        self._fill = bound(
            _fill,
            navigation.state,
            readings.imu.values,
            readings.magnetometer.values,
            readings.barometer.values,
            readings.airspeed.values,
            navigation.covariance,
            self._place,
            context.home_ned_m,
            self._record,
            then=(0,),
        )
        self.bits: Mapping[int, int] = {
            message_id: 1 << index for index, (_, _, message_id, _) in enumerate(_PARTS.tolist())
        }
        self._message_ids = [
            tuple(message_id for message_id, bit in self.bits.items() if due & bit)
            for due in range(1 << len(self.bits))
        ]

    def packet(self, due: int, encoder: FrameEncoder) -> tuple[bytes, tuple[int, ...]]:
        """Frames of the messages whose `bits` are set and whose values are available, in one piece.

        Args:
            due: sum of `bits`.
            encoder: the channel's; provides sender and sequence numbers.

        Returns:
            The bytes, and the message id of each frame.
        """
        due = self._available(due)
        data = self._packet_bytes[: self._make(due, encoder)].tobytes() if due else b""
        return data, self._message_ids[due]

    def _available(self, due: int) -> int:
        """The bits whose values are available."""
        if not self._navigation.health.attitude:
            due &= ~_NEED_ATTITUDE
        if self._context.frame is None:
            due &= ~_NEED_FRAME
        if self._readings.barometer.time_us < 0 or self._readings.imu.time_us < 0:
            due &= ~_NEED_SENSORS
        return due

    def _make(self, due: int, encoder: FrameEncoder) -> int:
        """Make the frames; returns their length."""
        self._fresh()
        if due & _NEED_SENSORS:
            self._mark_updated()
        sequence = encoder.sequence
        encoder.sequence = (sequence + due.bit_count()) & 0xFF
        sender = encoder.system_id << 8 | encoder.component_id
        size: int = self._make_frames(due, sender, sequence)
        return size

    @property
    def builders(self) -> Mapping[int, Builder]:
        """Message id -> builder of its payload."""
        return {
            definition("ATTITUDE").message_id: self._with_attitude("ATTITUDE"),
            definition("ATTITUDE_QUATERNION").message_id: self._with_attitude("ATTITUDE_QUATERNION"),
            definition("ODOMETRY").message_id: self._with_attitude("ODOMETRY"),
            definition("LOCAL_POSITION_NED").message_id: self._local_position,
            definition("GLOBAL_POSITION_INT").message_id: self._global_position,
            definition("HIGHRES_IMU").message_id: self._highres_imu,
        }

    def _with_attitude(self, name: str) -> Builder:
        part, health = self._slices[name], self._navigation.health

        def build() -> bytes | None:
            return self._fresh()[part].tobytes() if health.attitude else None

        return build

    def _local_position(self) -> bytes:
        return self._fresh()[self._slices["LOCAL_POSITION_NED"]].tobytes()

    def _global_position(self) -> bytes | None:
        if self._context.frame is None:
            return None
        return self._fresh()[self._slices["GLOBAL_POSITION_INT"]].tobytes()

    def _highres_imu(self) -> bytes | None:
        if self._readings.imu.time_us < 0 or self._readings.barometer.time_us < 0:
            return None
        data = self._fresh()
        self._mark_updated()
        return data[self._slices["HIGHRES_IMU"]].tobytes()

    def _mark_updated(self) -> None:
        """Mark what is new in HIGHRES_IMU since the one before; in one step all have the same marks."""
        if self._marked_us == self._time_us:
            return
        self._marked_us = self._time_us
        fields = _INERTIAL_FIELDS
        for index, (reading, bits) in enumerate(self._groups):
            if reading.time_us > self._sent_us[index]:
                self._sent_us[index] = reading.time_us
                fields |= bits
        self._record[0]["highres_imu__fields_updated"] = fields

    def _fresh(self) -> memoryview:
        """The records of this step."""
        time_us = self._view.time_us
        if time_us == self._time_us:
            return self._bytes
        self._time_us = time_us
        frame = self._context.frame
        if frame is not None:
            self._place[:] = frame.geodetic_from_ned(*self._navigation.state[n.POS_NED_M].tolist())
        self._fill(time_us)
        return self._bytes
