"""PX4 as a backend: `simulator_mavlink`, in lockstep with the world.

PX4 is the client of a TCP port and takes its clock from HIL_SENSOR, one for each physics step, or for each
second, third, ... of a world that is faster than 250 Hz: PX4 answers one with HIL_ACTUATOR_CONTROLS only when
its rate loop has run, at 400 Hz at most (IMU_GYRO_RATEMAX). Its start script stands still until the first
HIL_SENSOR, and needs real time until the first answer: so long the world goes no faster than that.

Source: MAVLink common.xml (HIL_SENSOR, HIL_GPS, HIL_ACTUATOR_CONTROLS, HIL_SENSOR_UPDATED_FLAGS); PX4 user
guide, "Simulation", "Simulator MAVLink API" and "Lockstep simulation".
"""

import math
import os
import re
import socket
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.clock.pacing import wall_time_s
from autopilot_bridge.firmware_process.airframes import airframe_parameters, px4_outputs
from autopilot_bridge.firmware_process.errors import FirmwareError
from autopilot_bridge.firmware_process.process import FirmwareProcess
from autopilot_bridge.firmware_process.px4_files import AIRFRAME_NUMBER, write_start_files
from autopilot_bridge.firmware_process.relay import LOOPBACK, FirmwareLinks, ports_to
from autopilot_bridge.firmware_process.working_folder import WorkingFolder
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode_as, dialect, wire_units
from autopilot_bridge.mavlink.components import SIMULATOR_COMPONENT
from autopilot_bridge.sitl.backend import BackendSetup
from flightsim import interface as i
from flightsim.airframe import AirframeKind

_FIRST_PORT: Final = 4560  # of the simulator; plus the instance
_INSTANCES: Final = 250
_ROLES: Final = ("onboard", "gcs", "payload")
_CONNECTING_S: Final = 20.0
_BOOT_STEP_S: Final = 0.004  # real time that the start script gets for a step of the clock
_BOOT_LIMIT_S: Final = 60.0
_ANSWER_LIMIT_S: Final = 30.0  # a process may be paused for as long
_FASTEST_HZ: Final = 250  # of HIL_SENSOR
_GYRO_AND_ACCEL: Final = 0x3F
_MAG: Final = 0x1C0
_DIFFERENTIAL_PRESSURE: Final = 0x400
_BAROMETER: Final = 0x1A00  # pressure, pressure altitude, temperature
_ARMED: Final = dialect.MAV_MODE_FLAG_SAFETY_ARMED
_CONTROLS: Final = dialect.MAVLINK_MSG_ID_HIL_ACTUATOR_CONTROLS
_FULL_CIRCLE_CDEG: Final = 36000
_UNKNOWN_PARAMETER: Final = re.compile(r"[Pp]arameter (\w+) not found")
_OWN_PARAMETERS: Final[Mapping[str, float]] = {
    "IMU_GYRO_CAL_EN": 0,  # its timers may be lost by it (docs/firmware/flights.md)
    "EKF2_GPS_DELAY": 110,  # of the receivers of `flightsim`; the start script assumes 10 ms
}


class Px4Backend:
    """One boot of PX4; see `AutopilotBackend`.

    Args:
        setup: the vehicle and its readings.
        build: PX4's build folder.
        folder: where it works.
        unix_us: Unix time of the boot.

    Attributes:
        armed: as its actuator commands say.

    Raises:
        FirmwareError: PX4 does not start, or does not connect.
        ValueError: the vehicle can't fly.
    """

    def __init__(self, setup: BackendSetup, build: Path, folder: WorkingFolder, unix_us: int) -> None:
        self.armed = False
        self._readings = setup.readings
        self._aircraft = setup.airframe.kind is AirframeKind.FIXED_WING
        self._unix_us = unix_us
        self._given = tuple(setup.vehicle.parameters)
        self._every = -(-setup.world.physics_rate_hz // _FASTEST_HZ)
        self._steps = 0
        self._sent = False  # the readings of this step
        readings = setup.readings
        self._slow = (
            readings.magnetometer,
            readings.barometer,
            readings.airspeed,
            readings.rangefinder,
            readings.gps,
        )
        self._new: list[i.Reading] = []  # those of `_slow` that are new since the last HIL_SENSOR
        self._time_us = 0
        self._answered_us = -1  # newest time that PX4 has answered
        self._boot_until_s = wall_time_s() + _BOOT_LIMIT_S
        self._actuators = np.zeros(i.MAX_ACTUATORS)
        self._encoder = FrameEncoder(setup.vehicle.system_id, SIMULATOR_COMPONENT)
        self._parser = FrameParser()
        instance, listener = _free_instance()
        ports = dict(zip(_ROLES, ports_to(len(_ROLES)), strict=True))
        self._links = FirmwareLinks(setup.vehicle.system_id, ports)
        self._folder = folder
        try:
            etc = write_start_files(
                build,
                folder.path,
                kind=setup.airframe.kind,
                system_id=setup.vehicle.system_id,
                parameters={
                    **_OWN_PARAMETERS,
                    **airframe_parameters(setup),
                    **px4_outputs(setup),
                    **setup.vehicle.parameters,
                },
                links={role: (port.remote, port.number) for role, port in ports.items()},
            )
            home = setup.world.place
            self._process = FirmwareProcess(
                "PX4",
                [build / "bin" / "px4", "-d", "-i", str(instance), "-w", folder.path, etc],
                folder=folder.path,
                environment={
                    **{name: value for name, value in os.environ.items() if not name.startswith("PX4_")},
                    "PX4_SYS_AUTOSTART": str(AIRFRAME_NUMBER),
                    "PX4_HOME_LAT": repr(home.lat_deg),
                    "PX4_HOME_LON": repr(home.lon_deg),
                    "PX4_HOME_ALT": repr(home.alt_m),
                },
            )
            try:
                if not self._process.wait_readable(listener, _CONNECTING_S):
                    raise FirmwareError(
                        f"PX4 did not connect to the simulator's port {listener.getsockname()[1]} within "
                        f"{_CONNECTING_S:g} s{self._process.last_words()}"
                    )
                self._simulator, _ = listener.accept()
            except BaseException:
                self._process.stop()
                raise
        except BaseException:
            self._links.close()
            raise
        finally:
            listener.close()
        self._simulator.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    @property
    def links(self) -> FirmwareLinks:
        """Its MAVLink links."""
        return self._links

    def begin_step(self, time_us: int) -> None:
        """Send the readings of a step, and with them its time, when they are due."""
        self._time_us = time_us
        self._new += [reading for reading in self._slow if reading.fresh]
        self._sent = self._steps % self._every == 0
        self._steps += 1
        if not self._sent:
            return
        data = self._sensors(time_us)
        if self._readings.rangefinder in self._new:
            data = self._range(time_us) + data
        if self._readings.gps in self._new:
            data = self._position() + data
        self._new.clear()
        try:
            self._simulator.sendall(data)
        except OSError:
            self._process.link_closed("its simulator link")

    def step(self, time_us: int) -> NDArray[np.float64]:
        """The actuator commands of a step, or still those before."""
        if not self._sent:
            pass
        elif self._answered_us < 0:
            self._boot()
            if self._answered_us >= 0:
                self._process.require_known(self._given, _UNKNOWN_PARAMETER)
        elif not self._answer(time_us, _ANSWER_LIMIT_S):
            raise FirmwareError(
                f"PX4 gave no actuator commands for {_ANSWER_LIMIT_S:g} s at {time_us * 1e-6:.3f} s of its "
                f"time{self._process.last_words()}"
            )
        self._links.exchange()
        return self._actuators

    def close(self) -> None:
        """End PX4, and keep its logs."""
        self._process.stop()
        self._simulator.close()
        self._links.close()
        self._folder.keep("log/**/*.ulg")

    def _boot(self) -> None:
        """Let the start script have the real time that it needs."""
        self._answer(self._time_us, _BOOT_STEP_S)
        if self._answered_us < 0 and wall_time_s() > self._boot_until_s:
            raise FirmwareError(
                f"PX4 gave no actuator commands within {_BOOT_LIMIT_S:g} s of its start"
                f"{self._process.last_words()}"
            )

    def _answer(self, time_us: int, longest_s: float) -> bool:
        """Receive actuator commands until those for a time; False: they did not come."""
        while self._answered_us < time_us:
            if not self._process.wait_readable(self._simulator, longest_s):
                return False
            try:
                data = self._simulator.recv(4096)
            except ConnectionError:
                data = b""
            if not data:
                self._process.link_closed("its simulator link")
            for frame in self._parser.feed(data):
                if frame.message_id == _CONTROLS:
                    self._take(decode_as(frame, dialect.MAVLink_hil_actuator_controls_message))
        return True

    def _take(self, message: dialect.MAVLink_hil_actuator_controls_message) -> None:
        self.armed = bool(message.mode & _ARMED)
        self._answered_us = message.time_usec
        commands = np.nan_to_num(np.asarray(message.controls[: i.MAX_ACTUATORS], dtype=float))
        if self._aircraft:
            commands[i.THROTTLE] = max(0.0, commands[i.THROTTLE])  # -1 is a motor that stands
        self._actuators[:] = commands

    def _sensors(self, time_us: int) -> bytes:
        readings = self._readings
        fields = 0
        if readings.imu.fresh or self._answered_us < 0:
            fields |= _GYRO_AND_ACCEL
        if readings.magnetometer in self._new:
            fields |= _MAG
        if readings.barometer in self._new:
            fields |= _BAROMETER
        if readings.airspeed in self._new:
            fields |= _DIFFERENTIAL_PRESSURE
        imu, mag = readings.imu.values, readings.magnetometer.values
        accel, gyro = imu[i.IMU_ACCEL_FRD_M_S2], imu[i.IMU_GYRO_FRD_RAD_S]
        pressure_pa = readings.barometer.values[i.BARO_PRESSURE_PA]
        field_gauss = mag[i.MAG_FRD_GAUSS]
        message = dialect.MAVLink_hil_sensor_message(
            time_usec=time_us,
            xacc=_number(accel[0]),
            yacc=_number(accel[1]),
            zacc=_number(accel[2]),
            xgyro=_number(gyro[0]),
            ygyro=_number(gyro[1]),
            zgyro=_number(gyro[2]),
            xmag=_number(field_gauss[0]),
            ymag=_number(field_gauss[1]),
            zmag=_number(field_gauss[2]),
            abs_pressure=_number(pressure_pa) * 0.01,
            diff_pressure=_number(readings.airspeed.values[i.AIRSPEED_DIFFERENTIAL_PRESSURE_PA]) * 0.01,
            pressure_alt=0.0,  # PX4 computes its own
            temperature=_number(readings.barometer.values[i.BARO_TEMPERATURE_C]),
            fields_updated=fields,
            id=0,
        )
        return self._encoder.encode(message)

    def _position(self) -> bytes:
        gps = self._readings.gps
        values = gps.values
        north, east, down = (_number(speed) * 100.0 for speed in values[i.GPS_VEL_NED_M_S])
        course_cdeg = round(math.degrees(math.atan2(east, north)) * 100.0) % _FULL_CIRCLE_CDEG
        message = dialect.MAVLink_hil_gps_message(
            time_usec=self._unix_us + gps.time_us,
            fix_type=int(values[i.GPS_FIX_TYPE]),
            lat=wire_units.e7(_number(values[i.GPS_LAT_DEG])),
            lon=wire_units.e7(_number(values[i.GPS_LON_DEG])),
            alt=wire_units.mm(_number(values[i.GPS_ALT_M])),
            eph=min(65535, round(_number(values[i.GPS_EPH_M]) * 100.0)),
            epv=min(65535, round(_number(values[i.GPS_EPV_M]) * 100.0)),
            vel=min(65535, round(math.hypot(north, east))),
            vn=round(north),
            ve=round(east),
            vd=round(down),
            cog=course_cdeg,
            satellites_visible=int(_number(values[i.GPS_SATELLITES])),
        )
        return self._encoder.encode(message)

    def _range(self, time_us: int) -> bytes:
        values = self._readings.rangefinder.values
        distance_m = values[i.RANGE_DISTANCE_M]
        if math.isnan(distance_m):
            return b""
        message = dialect.MAVLink_distance_sensor_message(
            time_boot_ms=time_us // 1000,
            min_distance=round(values[i.RANGE_MIN_M] * 100.0),
            max_distance=round(values[i.RANGE_MAX_M] * 100.0),
            current_distance=round(distance_m * 100.0),
            type=dialect.MAV_DISTANCE_SENSOR_LASER,
            id=1,
            orientation=dialect.MAV_SENSOR_ROTATION_PITCH_270,
            covariance=0,
        )
        return self._encoder.encode(message)


def _number(value: float) -> float:
    """A reading as PX4 takes it; one that is not there yet is 0, and its field is not marked as new."""
    return 0.0 if value != value else float(value)


def _free_instance() -> tuple[int, socket.socket]:
    """The first instance that does not run and whose simulator port is free, and a listener on that port.

    Raises:
        FirmwareError: none is free.
    """
    for instance in range(_INSTANCES):
        if _runs(instance):
            continue
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            listener.bind((LOOPBACK, _FIRST_PORT + instance))
            listener.listen(1)
        except OSError:
            listener.close()
            continue
        return instance, listener
    raise FirmwareError(
        f"no free port for PX4's simulator link; {_FIRST_PORT} to {_FIRST_PORT + _INSTANCES - 1} are in use"
    )


def _runs(instance: int) -> bool:
    """Whether a PX4 of this machine has the instance: its server takes commands at a socket of its number."""
    if sys.platform == "win32":
        return False
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(f"{tempfile.gettempdir()}/px4-sock-{instance}")
        except OSError:
            return False
    return True
