"""The content of a vehicle's description, checked and typed. `flightsim.airframe` reads it from files."""

import itertools
import math
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Final

from flightsim.interface import AILERON, BRAKE, ELEVATOR, FLAPS, MAX_ACTUATORS, RUDDER, STEERING, THROTTLE


class AirframeError(ValueError):
    """A vehicle model cannot be used; the message names the file and the reason."""


class AirframeKind(StrEnum):
    """What kind of vehicle it is."""

    MULTICOPTER = "multicopter"
    FIXED_WING = "fixed_wing"


class Role(StrEnum):
    """What an actuator of a fixed-wing vehicle does."""

    AILERON = "aileron"
    ELEVATOR = "elevator"
    THROTTLE = "throttle"
    RUDDER = "rudder"
    FLAPS = "flaps"
    STEERING = "steering"
    BRAKE = "brake"

    @property
    def command(self) -> int:
        """Place in the actuator vector (`flightsim.interface`)."""
        return _COMMANDS[self]


_COMMANDS: Final = {
    Role.AILERON: AILERON,
    Role.ELEVATOR: ELEVATOR,
    Role.THROTTLE: THROTTLE,
    Role.RUDDER: RUDDER,
    Role.FLAPS: FLAPS,
    Role.STEERING: STEERING,
    Role.BRAKE: BRAKE,
}


class LaunchKind(StrEnum):
    """How a fixed-wing vehicle gets into the air."""

    RUNWAY = "runway"
    CATAPULT = "catapult"
    HAND = "hand"


@dataclass(frozen=True, slots=True, kw_only=True)
class ActuatorChannel:
    """From one actuator command to JSBSim properties: property = scale * command + offset, within limits.

    Attributes:
        role: which command.
        properties: JSBSim properties that take it.
        scale, offset: of the command. A negative scale turns the sign round.
        minimum, maximum: of the property.
        effectiveness: property of the actuator's effectiveness in the model (1 sound, 0 failed); None: the
            command of a failing actuator is set to neutral.
        optional: properties that the model does not have are left out.
    """

    role: Role
    properties: tuple[str, ...]
    scale: float = 1.0
    offset: float = 0.0
    minimum: float = -math.inf
    maximum: float = math.inf
    effectiveness: str | None = None
    optional: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightLimits:
    """Limits of a fixed-wing vehicle, for its autopilot and of its airframe; speeds are equivalent airspeeds.

    Attributes:
        airspeed_min_m_s, airspeed_trim_m_s, airspeed_max_m_s: None: worked out from the stall speed.
        bank_max_rad, pitch_min_rad, pitch_max_rad: attitude.
        throttle_max: highest throttle, 0..1.
        touchdown_sink_max_m_s: rate of sink beyond which it breaks when it meets the ground. By default that
            of a gear's reserve energy, 12 ft/s (14 CFR 25.723(b); it is designed for 10 ft/s, 23.473(d)).
    """

    airspeed_min_m_s: float | None = None
    airspeed_trim_m_s: float | None = None
    airspeed_max_m_s: float | None = None
    bank_max_rad: float = math.radians(45.0)
    pitch_min_rad: float = math.radians(-20.0)
    pitch_max_rad: float = math.radians(25.0)
    throttle_max: float = 1.0
    touchdown_sink_max_m_s: float = 3.66

    def __post_init__(self) -> None:
        speeds = [
            (name, value)
            for name in ("airspeed_min_m_s", "airspeed_trim_m_s", "airspeed_max_m_s")
            if (value := getattr(self, name)) is not None
        ]
        for name, value in speeds:
            if not 1.0 <= value <= 300.0:
                raise AirframeError(f"{name} {value} is not in 1..300 m/s")
        for (low, slower), (high, faster) in itertools.pairwise(speeds):
            if not slower < faster:
                raise AirframeError(f"{high} {faster} must be higher than {low} {slower}")
        for name, low_deg, high_deg in (("bank_max", 5, 80), ("pitch_min", -60, -1), ("pitch_max", 1, 80)):
            value_deg = math.degrees(getattr(self, f"{name}_rad"))
            if not low_deg <= round(value_deg, 9) <= high_deg:
                raise AirframeError(f"{name}_deg {value_deg:.6g} is not in {low_deg}..{high_deg} degrees")
        if not 0.5 <= self.touchdown_sink_max_m_s <= 50.0:
            raise AirframeError(
                f"touchdown_sink_max_m_s {self.touchdown_sink_max_m_s:.6g} is not in 0.5..50 m/s"
            )
        if not 0.0 < self.throttle_max <= 1.0:
            raise AirframeError(f"throttle_max {self.throttle_max} is not in 0..1")


@dataclass(frozen=True, slots=True, kw_only=True)
class LaunchParameters:
    """How the launch crew brings the vehicle into the air.

    Attributes:
        kind: catapult (a straight rail; a long one is a winch) or hand; with runway, where the vehicle takes
            off by itself, the rest means nothing.
        pitch_rad: of the rail or the throw, and of the vehicle on it.
        acceleration_m_s2: along the rail.
        speed_m_s: ground speed at which the vehicle is released, or which it keeps until `length_m`.
        length_m: shortest way along the rail; 0: released as soon as the speed is reached.
        height_m: of the centre of gravity over the ground before the launch.
    """

    kind: LaunchKind
    pitch_rad: float
    acceleration_m_s2: float
    speed_m_s: float
    length_m: float = 0.0
    height_m: float = 1.6

    def __post_init__(self) -> None:
        accepted = (
            ("pitch_deg", math.degrees(self.pitch_rad), -5.0, 60.0),
            ("acceleration_m_s2", self.acceleration_m_s2, 0.5, 500.0),
            ("speed_m_s", self.speed_m_s, 1.0, 200.0),
            ("length_m", self.length_m, 0.0, 2000.0),
            ("height_m", self.height_m, 0.0, 1000.0),
        )
        for name, value, low, high in accepted:
            if not low <= round(value, 9) <= high:
                raise AirframeError(f"launch {name} {value:.6g} is not in {low:g}..{high:g}")


DEFAULT_LAUNCHES: Final = (
    LaunchParameters(
        kind=LaunchKind.CATAPULT, pitch_rad=math.radians(12.0), acceleration_m_s2=50.0, speed_m_s=20.0
    ),
    LaunchParameters(
        kind=LaunchKind.HAND, pitch_rad=math.radians(10.0), acceleration_m_s2=30.0, speed_m_s=10.0
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Airframe:
    """The simulator's data of a JSBSim model.

    Attributes:
        name: short name.
        kind: kind of vehicle.
        folder, jsbsim: the JSBSim model is the file `folder/jsbsim.xml`.
        cg_height_at_rest_m: height of the centre of gravity over the ground when it stands; None: found out
            by letting it stand.
        actuators: property of each actuator command of a multicopter, in order.
        effectiveness: property of each actuator's effectiveness (1 sound, 0 failed); may be empty.
        channels: actuators of a fixed-wing vehicle, by role.
        truth: (index in the truth vector, property) of what only this model has.
        truth_scale: factor of each of those.
        constants: (index in the truth vector, value) of what the model does not have.
        start: (property, value) set once after the initial conditions: engine running, gear down.
        start_optional: whether properties of `start` that the model has not are left out.
        limits: for the autopilot.
        launch_kind: its default launch.
        launches: how a catapult or a hand does it.
    """

    name: str
    kind: AirframeKind
    folder: Path
    jsbsim: str
    cg_height_at_rest_m: float | None
    actuators: tuple[str, ...] = ()
    effectiveness: tuple[str, ...] = ()
    channels: tuple[ActuatorChannel, ...] = ()
    truth: tuple[tuple[int, str], ...] = ()
    truth_scale: tuple[float, ...] = ()
    constants: tuple[tuple[int, float], ...] = ()
    start: tuple[tuple[str, float], ...] = ()
    start_optional: bool = False
    limits: FlightLimits = field(default_factory=FlightLimits)
    launch_kind: LaunchKind = LaunchKind.RUNWAY
    launches: tuple[LaunchParameters, ...] = DEFAULT_LAUNCHES

    def __post_init__(self) -> None:
        fixed_wing = self.kind is AirframeKind.FIXED_WING
        if not fixed_wing and not 1 <= len(self.actuators) <= MAX_ACTUATORS:
            raise AirframeError(
                f"vehicle '{self.name}': {len(self.actuators)} actuators; accepted are 1 to {MAX_ACTUATORS}"
            )
        if self.effectiveness and len(self.effectiveness) != len(self.actuators):
            raise AirframeError(
                f"vehicle '{self.name}' names {len(self.effectiveness)} effectiveness properties for "
                f"{len(self.actuators)} actuators; give one for each, or none"
            )
        if self.cg_height_at_rest_m is not None and not 0.0 <= self.cg_height_at_rest_m <= 100.0:
            raise AirframeError(
                f"vehicle '{self.name}': cg_height_at_rest_m {self.cg_height_at_rest_m} is not 0..100"
            )
        if self.truth_scale and len(self.truth_scale) != len(self.truth):
            raise AirframeError(f"vehicle '{self.name}': one scale for each truth property, or none")

    @property
    def xml_path(self) -> Path:
        """The JSBSim file."""
        return self.folder / f"{self.jsbsim}.xml"

    @property
    def actuator_count(self) -> int:
        """How many places of the actuator vector it uses."""
        if self.kind is AirframeKind.FIXED_WING:
            return 1 + max((channel.role.command for channel in self.channels), default=-1)
        return len(self.actuators)

    def launch(self, kind: LaunchKind) -> LaunchParameters:
        """How a catapult or a hand launches it.

        Raises:
            AirframeError: a runway has no parameters.
        """
        for launch in self.launches:
            if launch.kind is kind:
                return launch
        raise AirframeError(f"vehicle '{self.name}' has no launch '{kind}'; accepted are catapult and hand")

    def channel(self, role: Role) -> ActuatorChannel | None:
        """The actuator with a role, if there is one."""
        return next((channel for channel in self.channels if channel.role is role), None)
