"""A pilot at the end of a memory link: flies an embedded SITL by MAVLink alone, and notes what it hears.

The vehicle is commanded and observed over the link only; the truth is for the tests.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode, dialect
from autopilot_bridge.sitl import Sitl
from estimators.status_texts import StatusTextAssembler
from flightsim import truth as t
from flightsim.environment import Environment
from flightsim.interface import MAX_ACTUATORS
from flightsim.payload import GroundTargetParameters, PayloadParameters
from flightsim.sensors import SensorSuiteParameters
from flightsim.world_spec import VehicleSpec, WorldSpec
from tests.rotations import yaw_rad

FLAVOURS: Final = ("px4", "ardupilot")
SYSTEM_ID: Final = 1
READY_LIMIT_S: Final = 60.0

_METRES_PER_RAD: Final = 6_371_000.0
_CUSTOM: Final = 1
_NOTICE_US: Final = 100_000
"""How often the pilot looks at the vehicle."""

_PX4_MODES: Final[Mapping[str, tuple[float, float]]] = {
    "manual": (1, 0),
    "altitude": (2, 0),
    "position": (3, 0),
    "hold": (4, 3),
    "mission": (4, 4),
    "return": (4, 5),
    "land": (4, 6),
    "offboard": (6, 0),
    "stabilized": (7, 0),
    "follow": (4, 8),
    "precision land": (4, 9),
}
_ARDUPILOT_MODES: Final[Mapping[str, tuple[float, float]]] = {
    "stabilize": (0, 0),
    "alt_hold": (2, 0),
    "auto": (3, 0),
    "guided": (4, 0),
    "loiter": (5, 0),
    "return": (6, 0),
    "circle": (7, 0),
    "land": (9, 0),
    "poshold": (16, 0),
    "brake": (17, 0),
    "follow": (23, 0),
}


class Flight:
    """One vehicle, and a ground station that talks to it.

    Args:
        flavour: "px4" or "ardupilot".
        parameters: that differ from the flavour's defaults.
        environment: the air.
        model, launch: the vehicle, and how it gets into the air.
        payload: what it carries; None: nothing.
        targets: what there is to see.
        sensors: of the vehicle; None: the usual ones.

    Attributes:
        heartbeats: (time s, custom_mode, base_mode, system_status).
        texts: (time s, text).
        acks: (time s, command, result).
        heartbeat: send a ground station's heartbeat each second.
        largest_command: largest actuator command so far, and whether all were finite.
    """

    def __init__(
        self,
        flavour: str = "px4",
        *,
        seed: int = 1,
        parameters: Mapping[str, float] | None = None,
        environment: Environment | None = None,
        model: str = "iris",
        launch: str | None = None,
        payload: PayloadParameters | None = None,
        targets: tuple[GroundTargetParameters, ...] = (),
        sensors: SensorSuiteParameters | None = None,
    ) -> None:
        specification = VehicleSpec(
            autopilot=flavour,
            parameters=parameters or {},
            model=model,
            launch=launch,
            payload=payload or PayloadParameters(),
            sensors=sensors,
        )
        self.sitl = Sitl(
            WorldSpec(vehicles=(specification,), seed=seed, air=environment or Environment(), targets=targets)
        )
        self.flavour = flavour
        self.vehicle = self.sitl.vehicles[0]
        self.truth: NDArray[np.float64] = self.vehicle.vehicle.truth
        self.heartbeats: list[tuple[float, int, int, int]] = []
        self.texts: list[tuple[float, str]] = []
        self.acks: list[tuple[float, int, int]] = []
        self.newest: dict[str, Any] = {}
        self.heartbeat = True
        self.actuators_finite = True
        self._modes = _PX4_MODES if flavour == "px4" else _ARDUPILOT_MODES
        self._encoder = FrameEncoder(255, 190)
        self._parser = FrameParser()
        self._texts = StatusTextAssembler()
        self._link = self.sitl.connect(0)
        self._link.on_receive = self._hear
        self._next_heartbeat_us = 0
        self._repeated: list[tuple[int, Callable[[float], Any]]] = []
        self._due_us: list[int] = []

    # what is received

    def _hear(self, data: bytes) -> None:
        for frame in self._parser.feed(data):
            message = decode(frame)
            name = message.get_type()
            self.newest[name] = message
            if name == "HEARTBEAT" and frame.component_id == 1:
                self.heartbeats.append(
                    (self.time_s, message.custom_mode, message.base_mode, message.system_status)  # type: ignore[attr-defined]
                )
            elif name == "STATUSTEXT":
                whole = self._texts.add(message)
                if whole is not None:
                    self.texts.append((self.time_s, whole.text.rstrip("\t")))
            elif name == "COMMAND_ACK":
                self.acks.append((self.time_s, message.command, message.result))  # type: ignore[attr-defined]

    @property
    def time_s(self) -> float:
        return self.sitl.time_us * 1e-6

    @property
    def armed(self) -> bool:
        return bool(self.heartbeats and self.heartbeats[-1][2] & 0x80)

    @property
    def custom_mode(self) -> int:
        return self.heartbeats[-1][1]

    @property
    def mode(self) -> str:
        """The pilot's name of the mode shown; the number where it has none."""
        for name, (main, sub) in self._modes.items():
            number = int(main) << 16 | int(sub) << 24 if self.flavour == "px4" else int(main)
            if number == self.custom_mode:
                return name
        return f"{self.custom_mode:#x}" if self.flavour == "px4" else str(self.custom_mode)

    def text_time(self, part: str, after_s: float = 0.0) -> float:
        """When a text that contains `part` was received first; infinity when it was not."""
        return next((s for s, text in self.texts if part in text and s >= after_s), math.inf)

    # the truth, for the tests

    @property
    def position_ned_m(self) -> tuple[float, float, float]:
        """True position from home, small angles."""
        home = self.sitl.spec.place
        truth = self.truth
        north = (truth[t.LAT_RAD] - math.radians(home.lat_deg)) * _METRES_PER_RAD
        east = (truth[t.LON_RAD] - math.radians(home.lon_deg)) * _METRES_PER_RAD
        return (float(north), float(east * math.cos(truth[t.LAT_RAD])), float(home.alt_m - truth[t.ALT_M]))

    @property
    def height_m(self) -> float:
        return float(self.truth[t.HEIGHT_ABOVE_GROUND_M])

    @property
    def velocity_ned_m_s(self) -> NDArray[np.float64]:
        return self.truth[t.VEL_NED_M_S].copy()

    @property
    def speed_m_s(self) -> float:
        """Over ground."""
        return float(np.hypot(*self.truth[t.VEL_NED_M_S][:2]))

    @property
    def tilt_deg(self) -> float:
        _, x, y, _ = self.truth[t.Q_NED_FROM_FRD]
        return math.degrees(math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (x * x + y * y)))))

    @property
    def yaw_rad(self) -> float:
        return yaw_rad(self.truth[t.Q_NED_FROM_FRD])

    # what is said

    def send(self, message: Any) -> None:
        self._link.send(self._encoder.encode(message))

    def command(self, command: int, *parameters: float) -> None:
        """COMMAND_LONG; the answer is in `acks`."""
        values = (*parameters, *(0.0,) * (7 - len(parameters)))
        self.send(dialect.MAVLink_command_long_message(SYSTEM_ID, 1, command, 0, *values))

    def result(self, command: int, *parameters: float) -> int | None:
        """COMMAND_LONG, and its last answer within half a second."""
        received = len(self.acks)
        self.command(command, *parameters)
        self.fly(0.5)
        answers = [result for _, number, result in self.acks[received:] if number == command]
        return answers[-1] if answers else None

    def ask_mode(self, name: str) -> None:
        main, sub = self._modes[name]
        self.command(dialect.MAV_CMD_DO_SET_MODE, _CUSTOM | (0x80 if self.armed else 0), main, sub)

    def set_mode(self, name: str, limit_s: float = 3.0) -> None:
        """Ask for a mode, and see it in a heartbeat."""
        self.ask_mode(name)
        self.fly_until(lambda: self.mode == name, limit_s, f"mode {name}")

    def inject(self, unit: int, failure: int) -> None:
        """Switch a failure of every instance: by command, where the firmware has one (PX4)."""
        if self.flavour == "px4":
            assert self.result(dialect.MAV_CMD_INJECT_FAILURE, unit, failure, 0) == 0
        else:
            assert self.vehicle.failures.inject(unit, failure, 0) == 0
            self.fly(0.5)

    def repeat(self, rate_hz: float, make: Callable[[float], Any]) -> None:
        """Send what `make` gives for the vehicle time, at a rate, from now on."""
        self._repeated.append((round(1e6 / rate_hz), make))
        self._due_us.append(self.sitl.time_us)

    def stop_repeating(self) -> None:
        self._repeated.clear()
        self._due_us.clear()

    def sticks(
        self, *, pitch: float = 0.0, roll: float = 0.0, throttle: float = 0.0, yaw: float = 0.0
    ) -> None:
        """Hold the sticks (each -1..1) from now on: MANUAL_CONTROL at 20 Hz."""
        self.stop_repeating()
        message = dialect.MAVLink_manual_control_message(
            SYSTEM_ID,
            round(1000 * pitch),
            round(1000 * roll),
            round(500 * (throttle + 1.0)),
            round(1000 * yaw),
            0,
        )
        self.repeat(20.0, lambda _: message)

    # time

    def _steps(self, seconds: float) -> Iterator[None]:
        """Vehicle time, in the pilot's own steps."""
        sitl = self.sitl
        per_look = _NOTICE_US // sitl.step_us
        actuators = self.vehicle.autopilot.actuators
        for _ in range(max(1, round(seconds * 1e6) // _NOTICE_US)):
            for _ in range(per_look):
                now = sitl.time_us
                if self.heartbeat and now >= self._next_heartbeat_us:
                    self._next_heartbeat_us = now + 1_000_000
                    self.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
                for k, (period_us, make) in enumerate(self._repeated):
                    if now >= self._due_us[k]:
                        self._due_us[k] += period_us
                        self.send(make(now * 1e-6))
                sitl.advance()
            assert actuators.shape == (MAX_ACTUATORS,)
            self.actuators_finite &= bool(np.isfinite(actuators).all())
            yield

    def fly(self, seconds: float, look: Callable[[], object] | None = None) -> None:
        """Let vehicle time pass; `look` is called every tenth of a second."""
        for _ in self._steps(seconds):
            if look is not None:
                look()

    def fly_until(self, condition: Callable[[], object], limit_s: float, what: str) -> float:
        """Fly until a condition holds; returns how long that took."""
        start_s = self.time_s
        for _ in self._steps(limit_s):
            if condition():
                return self.time_s - start_s
        raise AssertionError(f"no {what} within {limit_s} s; mode {self.mode}, {self.texts[-4:]}")

    # usual beginnings

    def get_ready(self) -> None:
        """From boot to ready to arm; asks for the streams the pilot looks at."""
        self.fly(1.5)
        for message_id, rate_hz in ((1, 2), (245, 5), (33, 10), (32, 10), (30, 10)):
            self.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e6 / rate_hz)

        def ready() -> bool:
            status = self.newest.get("SYS_STATUS")
            return status is not None and bool(status.onboard_control_sensors_health & 0x10000000)

        if self.flavour == "ardupilot":
            self.set_mode("guided")
        self.fly_until(ready, READY_LIMIT_S, "readiness")

    def arm(self) -> None:
        assert self.result(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == 0, self.texts

    def take_off(self, height_m: float = 10.0) -> None:
        """Get ready, arm, climb, and hold (PX4 in hold, ArduPilot in guided mode)."""
        self.get_ready()
        self.arm()
        nan = math.nan
        if self.flavour == "px4":
            altitude = self.newest["HOME_POSITION"].altitude * 1e-3 + height_m
            self.command(dialect.MAV_CMD_NAV_TAKEOFF, -1, nan, nan, nan, nan, nan, altitude)
        else:
            self.command(dialect.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, height_m)
        self.fly_until(lambda: self.height_m > height_m - 1.0, 20.0 + height_m, "takeoff")
        self.fly(4.0)
        if self.flavour == "px4" and self.mode != "hold":
            self.set_mode("hold")

    def wait_disarmed(self, limit_s: float = 120.0) -> float:
        return self.fly_until(lambda: not self.armed, limit_s, "disarming")

    def position_setpoint(
        self,
        position_ned_m: tuple[float, float, float] | None = None,
        velocity_ned_m_s: tuple[float, float, float] | None = None,
        yaw_rad: float | None = None,
    ) -> Any:
        """SET_POSITION_TARGET_LOCAL_NED in the vehicle's local frame."""
        mask = (
            0x1C0
            | 0x800
            | (0x007 if position_ned_m is None else 0)
            | (0x038 if velocity_ned_m_s is None else 0)
            | (0x400 if yaw_rad is None else 0)
        )
        return dialect.MAVLink_set_position_target_local_ned_message(
            self.sitl.time_us // 1000,
            SYSTEM_ID,
            1,
            1,
            mask,
            *(position_ned_m or (0.0, 0.0, 0.0)),
            *(velocity_ned_m_s or (0.0, 0.0, 0.0)),
            0.0,
            0.0,
            0.0,
            yaw_rad or 0.0,
            0.0,
        )
