"""ArduPilot as a backend: its SITL with the model JSON, in lockstep with the world.

ArduPilot sends its servo outputs to a UDP port and waits for the answer, one line of JSON with the motion of
the vehicle; each answer is one step of its clock. ArduCopter's loop runs once in two of these at most, so
there a physics step is answered twice, in the middle and at its end, with the same motion. Its sensors are
its own, made from that motion: the world's sensors and their faults do not reach it.

Source: ArduPilot's documentation of the JSON interface ("libraries/SITL/examples/JSON/readme.md").
"""

import json
import math
import os
import re
import socket
import struct
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.firmware_process.airframes import airframe_parameters, ardupilot_outputs
from autopilot_bridge.firmware_process.ardupilot_faults import ParameterChange, parameter_changes
from autopilot_bridge.firmware_process.errors import FirmwareError
from autopilot_bridge.firmware_process.process import FirmwareProcess
from autopilot_bridge.firmware_process.relay import LOOPBACK, FirmwareLinks, FirmwarePort
from autopilot_bridge.firmware_process.working_folder import WorkingFolder
from autopilot_bridge.mavlink import Frame, FrameEncoder, decode_as, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT, SIMULATOR_COMPONENT
from autopilot_bridge.sitl.backend import BackendSetup
from flightsim import interface as i
from flightsim import truth as t
from flightsim.airframe import AirframeKind
from flightsim.foundation.firmware_frames import ArduPilotFrame
from flightsim.foundation.geodesy import GeodeticPosition

_FIRST_PORT: Final = 9002  # of the physics; plus 10 for each instance
_INSTANCES: Final = 100
_ROLES: Final = ("onboard", "gcs", "payload")  # on the serial ports 0, 1 and 2
_STARTING_S: Final = 30.0
_ANSWER_LIMIT_S: Final = 30.0  # a process may be paused for as long
_SPEEDUP: Final = 100  # as fast as the world asks it to
_SERVOS: Final = struct.Struct("<HHI16H")  # magic number, frame rate, frame count, pulse widths, us
_MAGIC: Final = 18458
_NEUTRAL_US, _RANGE_US, _LOW_US = 1500.0, 500.0, 1000.0
_VEHICLE_TYPES: Final[Mapping[AirframeKind, frozenset[int]]] = {
    AirframeKind.MULTICOPTER: frozenset({dialect.MAV_TYPE_QUADROTOR}),
    AirframeKind.FIXED_WING: frozenset({dialect.MAV_TYPE_FIXED_WING}),
}
_FASTEST_LOOP_HZ: Final = 400  # ArduCopter's own rate
_COPTER_PARTS: Final = 2  # answers in a physics step
_UNKNOWN_PARAMETER: Final = re.compile(r"unknown param (\w+)")
_ITS_OWN: Final = (
    *("STAT_", "SR0_", "SR1_", "SR2_", "SYSID_", "SERIAL", "SIM_"),
    *("BARO", "INS_GYR", "ARSPD_OFFSET", "COMPASS_DEV_ID", "COMPASS_PRIO"),
)
"""Parameters of the emulated table that a firmware finds out, counts, or has from its command line."""


class ArduPilotBackend:
    """One start of ArduPilot; see `AutopilotBackend`.

    Args:
        setup: the vehicle and its motion.
        program: `arducopter` or `arduplane`.
        folder: where it works.
        unix_us: Unix time of the boot.

    Attributes:
        armed: as its heartbeat says.

    Raises:
        FirmwareError: ArduPilot does not start.
        ValueError: the vehicle can't fly.
    """

    def __init__(self, setup: BackendSetup, program: Path, folder: WorkingFolder, unix_us: int) -> None:
        self.armed = False
        self._truth = setup.truth
        self._readings = setup.readings
        self._kind = setup.airframe.kind
        home = setup.world.place
        self._frame = ArduPilotFrame(  # of the metres that it makes latitude and longitude of again
            GeodeticPosition(lat_deg=home.lat_deg, lon_deg=home.lon_deg, alt_m=home.alt_m)
        )
        self._actuators = np.zeros(i.MAX_ACTUATORS)
        self._encoder = FrameEncoder(setup.vehicle.system_id, SIMULATOR_COMPONENT)
        self._boot_us = unix_us - setup.world.unix_epoch_us  # in the time of the world
        self._changes = deque(parameter_changes(setup.world.faults, setup.vehicle.system_id))
        self._peer: tuple[str, int] | None = None
        self._folder = folder
        self._parts = _COPTER_PARTS if self._kind is AirframeKind.MULTICOPTER else 1
        self._stepped_us = 0
        self._answers: deque[dict[str, Any]] = deque()
        self._given = tuple(setup.vehicle.parameters)
        self._received = False
        instance, self._physics = _free_instance()
        ports = {role: FirmwarePort() for role in _ROLES}
        self._links = FirmwareLinks(setup.vehicle.system_id, ports, self._look)
        try:
            parameters = folder.path / "vehicle.parm"
            first = not parameters.exists()
            if first:
                _write_parameters(parameters, setup)
            serial = [
                part
                for number, port in enumerate(ports.values())
                for part in (f"--serial{number}", f"udpclient:{LOOPBACK}:{port.number}")
            ]
            self._process = FirmwareProcess(
                "ArduPilot",
                [
                    program,
                    *("--model", f"JSON:{LOOPBACK}"),
                    *("--speedup", str(_SPEEDUP)),
                    *("--defaults", parameters),
                    *("--instance", str(instance)),
                    *("--home", f"{home.lat_deg!r},{home.lon_deg!r},{home.alt_m!r},{home.heading_deg!r}"),
                    *("--start-time", str(unix_us // 1_000_000)),
                    *serial,
                    *(("--wipe",) if first else ()),
                ],
                folder=folder.path,
                environment=os.environ,
            )
            try:
                if not self._servos(_STARTING_S):
                    raise FirmwareError(
                        f"ArduPilot sent no servo outputs within {_STARTING_S:g} s of its start"
                        f"{self._process.last_words()}"
                    )
            except BaseException:
                self._process.stop()
                raise
        except BaseException:
            self._links.close()
            self._physics.close()
            raise

    @property
    def links(self) -> FirmwareLinks:
        """Its MAVLink links."""
        return self._links

    def begin_step(self, time_us: int) -> None:
        """Send the motion of a step, and with it its time, or that of its first part."""
        while self._changes and time_us >= self._changes[0].time_us - self._boot_us:
            self._set(self._changes.popleft())
        motion = self._motion()
        part_us = (time_us - self._stepped_us) // self._parts
        times_us = [time_us - part_us * (self._parts - part) for part in range(1, self._parts + 1)]
        self._answers = deque({"timestamp": at_us * 1e-6, **motion} for at_us in times_us)
        self._stepped_us = time_us
        self._send()

    def step(self, time_us: int) -> NDArray[np.float64]:
        """The actuator commands of a step."""
        self._await_servos(time_us)
        while self._answers:
            self._send()
            self._await_servos(time_us)
        self._links.exchange()
        return self._actuators

    def close(self) -> None:
        """End ArduPilot."""
        self._process.stop()
        self._physics.close()
        self._links.close()
        self._folder.keep("logs/*.BIN")

    def _set(self, change: ParameterChange) -> None:
        """Set a parameter of its simulator."""
        message = dialect.MAVLink_param_set_message(
            target_system=self._encoder.system_id,
            target_component=AUTOPILOT_COMPONENT,
            param_id=change.name.encode(),
            param_value=change.value,
            param_type=dialect.MAV_PARAM_TYPE_REAL32,
        )
        self._links.send(self._encoder.encode(message))

    def _await_servos(self, time_us: int) -> None:
        if not self._servos(_ANSWER_LIMIT_S):
            raise FirmwareError(
                f"ArduPilot gave no servo outputs for {_ANSWER_LIMIT_S:g} s at {time_us * 1e-6:.3f} s of "
                f"vehicle time{self._process.last_words()}"
            )

    def _send(self) -> None:
        """Send the next answer."""
        assert self._peer is not None
        text = json.dumps(self._answers.popleft(), separators=(",", ":"))  # no space is accepted after a name
        try:
            self._physics.sendto(f"\n{text}\n".encode(), self._peer)
        except ConnectionError:
            self._process.require_running()

    def _servos(self, longest_s: float) -> bool:
        """Receive the newest servo outputs; False: there were none in this time."""
        while self._process.wait_readable(self._physics, longest_s):
            try:
                data, self._peer = self._physics.recvfrom(_SERVOS.size)
            except ConnectionError:  # nothing receives at the port of a process that has ended
                self._process.require_running()
                continue
            if len(data) != _SERVOS.size:
                continue
            magic, _rate_hz, _count, *pulses_us = _SERVOS.unpack(data)
            if magic != _MAGIC:
                continue
            self._take(pulses_us)
            return True
        return False

    def _take(self, pulses_us: list[int]) -> None:
        for index in range(i.MAX_ACTUATORS):
            pulse_us = pulses_us[index]
            one_way = self._kind is AirframeKind.MULTICOPTER or index in (i.THROTTLE, i.FLAPS)
            if pulse_us == 0:  # no output
                self._actuators[index] = 0.0
            elif one_way:
                self._actuators[index] = min(1.0, max(0.0, (pulse_us - _LOW_US) / (2.0 * _RANGE_US)))
            else:
                self._actuators[index] = min(1.0, max(-1.0, (pulse_us - _NEUTRAL_US) / _RANGE_US))

    def _motion(self) -> dict[str, Any]:
        truth, imu = self._truth, self._readings.imu.values
        state: dict[str, Any] = {
            "imu": {
                "gyro": imu[i.IMU_GYRO_FRD_RAD_S].tolist(),
                "accel_body": imu[i.IMU_ACCEL_FRD_M_S2].tolist(),
            },
            "position": self._frame.ned_from_geodetic(
                math.degrees(truth[t.LAT_RAD]), math.degrees(truth[t.LON_RAD]), float(truth[t.ALT_M])
            ),
            "quaternion": truth[t.Q_NED_FROM_FRD].tolist(),
            "velocity": truth[t.VEL_NED_M_S].tolist(),
        }
        if self._kind is AirframeKind.FIXED_WING:
            state["airspeed"] = float(truth[t.AIRSPEED_TRUE_M_S])
        distance_m = self._readings.rangefinder.values[i.RANGE_DISTANCE_M]
        if not math.isnan(distance_m):
            state["rng_1"] = float(distance_m)
        voltage_v, current_a = truth[t.BATTERY_VOLTAGE_V], truth[t.BATTERY_CURRENT_A]
        if voltage_v > 0.0:
            state["battery"] = {"voltage": float(voltage_v), "current": float(current_a)}
        return state

    def _look(self, frame: Frame) -> None:
        """Learn from a heartbeat whether it is armed.

        Raises:
            FirmwareError: the program is for another class of vehicle.
        """
        if frame.message_id != dialect.MAVLINK_MSG_ID_HEARTBEAT:
            return
        heartbeat = decode_as(frame, dialect.MAVLink_heartbeat_message)
        if not self._received:
            self._received = True
            self._process.require_known(self._given, _UNKNOWN_PARAMETER)
        self.armed = bool(heartbeat.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)
        if heartbeat.type not in _VEHICLE_TYPES[self._kind]:
            raise FirmwareError(
                f"ArduPilot's program is for a vehicle of MAV_TYPE {heartbeat.type}, and the model is a "
                f"{self._kind.value}; give arducopter for multicopters, arduplane for aircraft"
            )


def _write_parameters(path: Path, setup: BackendSetup) -> None:
    """The values of the emulated autopilot, so that both fly with equal ones, and the vehicle's own."""
    flavour = get_flavour(setup.vehicle.autopilot, setup.airframe.kind)
    values = {
        definition.name: float(definition.default)
        for definition in flavour.parameter_definitions()
        if not definition.name.startswith(_ITS_OWN)
    }
    # the emulated vehicle has one compass, ArduPilot's simulator three, all with the same offsets
    values |= {
        f"COMPASS_OFS{number}_{axis}": values[f"COMPASS_OFS_{axis}"] for number in (2, 3) for axis in "XYZ"
    }
    values |= airframe_parameters(setup) | ardupilot_outputs(setup)
    values["SYSID_THISMAV"] = setup.vehicle.system_id
    if setup.airframe.kind is AirframeKind.MULTICOPTER:
        values["SCHED_LOOP_RATE"] = min(_FASTEST_LOOP_HZ, setup.world.physics_rate_hz * _COPTER_PARTS // 2)
    values |= setup.vehicle.parameters
    path.write_text("".join(f"{name} {value:.9g}\n" for name, value in values.items()), encoding="ascii")


def _free_instance() -> tuple[int, socket.socket]:
    """The first instance whose port of the physics is free, and a socket on that port.

    Raises:
        FirmwareError: none is free.
    """
    for instance in range(_INSTANCES):
        physics = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            physics.bind((LOOPBACK, _FIRST_PORT + 10 * instance))
        except OSError:
            physics.close()
            continue
        return instance, physics
    raise FirmwareError(
        f"no free port for ArduPilot's physics; {_FIRST_PORT} and each 10 above it are in use"
    )
