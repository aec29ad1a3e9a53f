"""One simulated vehicle: a JSBSim model in its air, stepped by actuator commands, writing its truth."""

import math
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.actuation import FixedWingActuators
from flightsim.airframe import (
    Airframe,
    AirframeError,
    AirframeKind,
    LaunchKind,
    LaunchParameters,
    Role,
    load_airframe,
)
from flightsim.crash import hits_ground, lay_down
from flightsim.environment import Environment
from flightsim.foundation.magnetics import magnetic_field_ned_gauss
from flightsim.home import Home
from flightsim.initial_state import InitialState, initialise, set_battery
from flightsim.interface import MAX_ACTUATORS
from flightsim.jsbsim_model import find_property, hold_motion, load_fdm
from flightsim.jsbsim_package import jsbsim
from flightsim.launcher import Launcher
from flightsim.truth_reading import Motion, TruthReader
from flightsim.vehicle_air import VehicleAir
from flightsim.wind_profile import WindProfile

__all__ = ["InitialState", "Vehicle", "VehicleDivergedError"]

Array = NDArray[np.float64]

_FOLLOW_S: Final = 10.0  # in which actuators and engines follow the commands of a start in the air
_MAGNETIC_REFRESH_S: Final = 10
_SETTLE_S: Final = 1.0
_SOUND: Final = int(Motion.SOUND)
_SETTLE_FIXED_WING_S: Final = 4.0  # gear springs are softer, and it may stand on a tail wheel


class VehicleDivergedError(ArithmeticError):
    """The simulated motion is no longer possible, and nothing was hit: the commands or the physics rate do
    not suit the model.
    """


class Vehicle:
    """A JSBSim vehicle.

    Attributes:
        truth: (TRUTH_SIZE,) float64, layout in `flightsim.truth`; written in place by every step.
        airframe: the model's description.
        home: origin of the world.
        environment: the air.
        launcher: holds and launches it; None for a vehicle without a launcher.
        crash: text about its crash, for users; None: not crashed. A crashed vehicle does not move again.
        physics_rate_hz: steps per second.
        load_warnings: JSBSim's warnings about the model; empty if there are none.
    """

    def __init__(
        self,
        model: str | Path = "iris",
        *,
        home: Home,
        environment: Environment,
        seed_sequence: np.random.SeedSequence,
        physics_rate_hz: int = 250,
        slow_rate_hz: int | None = None,
        initial: InitialState | None = None,
    ) -> None:
        """Load the model and start it.

        Args:
            model: name of a model that comes with the package, or a path (see `load_airframe`).
            home: origin of the world; the ground is level at its altitude.
            environment: the air.
            seed_sequence: the vehicle's own random stream (turbulence).
            physics_rate_hz: 100 to 2000.
            slow_rate_hz: how often the part of `truth` that is not motion (air, power, ground contact) is
                read from JSBSim, from the first step on; None: every step.
            initial: how it starts; by default standing at home.

        Raises:
            AirframeError: the model cannot be used.
            ValueError: rate out of range.
        """
        if not 100 <= physics_rate_hz <= 2000:
            raise ValueError(f"physics rate {physics_rate_hz} Hz is not in 100..2000 Hz")
        if 1_000_000 % physics_rate_hz:
            raise ValueError(
                f"physics rate {physics_rate_hz} Hz is not a whole number of microseconds; try 250 or 400"
            )
        self.airframe: Airframe = load_airframe(model)
        self.home = home
        self.environment = environment
        self.physics_rate_hz = physics_rate_hz
        self.truth: Array = np.zeros(t.TRUTH_SIZE)
        self._seed_sequence = seed_sequence
        self._slow_steps = max(1, physics_rate_hz // (slow_rate_hz or physics_rate_hz))
        self._magnetic_steps = _MAGNETIC_REFRESH_S * physics_rate_hz
        self._initial = initial or InitialState()
        self.reset(self._initial)

    @property
    def actuator_count(self) -> int:
        """How many of the actuator commands the vehicle uses."""
        return self.airframe.actuator_count

    @property
    def steps(self) -> int:
        """Physics steps since the start."""
        return self._steps

    def reset(self, initial: InitialState | None = None) -> None:
        """Start again, with a fresh JSBSim instance and the random stream from its beginning.

        Args:
            initial: how to start; by default as at construction.

        Raises:
            AirframeError: the model cannot be used, or its motion is not possible where it starts.
        """
        try:
            self._start(initial or self._initial)
        except jsbsim.BaseError as error:
            raise AirframeError(f"{self._unusable}: JSBSim says: {' '.join(str(error).split())}") from None

    @property
    def _unusable(self) -> str:
        return f"vehicle '{self.airframe.name}' can't be simulated from its start"

    def _start(self, start: InitialState) -> None:
        fixed_wing = self.airframe.kind is AirframeKind.FIXED_WING
        launch = _launch_parameters(self.airframe, start)
        fdm, self.load_warnings = load_fdm(self.airframe, self.physics_rate_hz, launcher=launch is not None)
        self._fdm = fdm
        self._run = fdm.run
        self._surfaces = FixedWingActuators(fdm, self.airframe) if fixed_wing else None
        self._reader = TruthReader(
            fdm,
            self.airframe,
            self.truth,
            ground_alt_m=float(self.home.alt_m),
            physics_rate_hz=self.physics_rate_hz,
            slow_steps=self._slow_steps,
        )
        self._read = self._reader.read
        owner = f"vehicle '{self.airframe.name}'"
        self._set_actuators = tuple(
            find_property(fdm, prop, needed_by=owner).set_double_value for prop in self.airframe.actuators
        )
        self._motor_effectiveness = tuple(
            find_property(fdm, prop, needed_by=owner) for prop in self.airframe.effectiveness
        )
        self._steps = 0
        self.crash: str | None = None
        self.launcher: Launcher | None = None
        initialise(fdm, self.airframe, self.home, self.environment, start, launch)
        for index, constant in self.airframe.constants:
            self.truth[index] = constant
        if start.actuators is not None:
            self._let_actuators_follow(start)
        if launch is not None:
            self.launcher = Launcher(fdm, launch, physics_rate_hz=self.physics_rate_hz)
        if start.height_m is None:
            self._settle(_SETTLE_FIXED_WING_S if fixed_wing else _SETTLE_S)
            set_battery(fdm, self.airframe, start)
        else:
            fdm.suspend_integration()  # forces of this state, then the specific force out of them
            fdm.run()
            fdm.run()
            fdm.resume_integration()
        self._air = VehicleAir(
            fdm,
            self.truth,
            self.environment,
            ground_alt_m=float(self.home.alt_m),
            physics_rate_hz=self.physics_rate_hz,
            seed_sequence=self._seed_sequence,
        )
        if self._read(self._steps) != _SOUND:
            raise AirframeError(
                f"{self._unusable}: forces, attitude or position become infinite before the first step; "
                f"check {self.airframe.xml_path} (mass, inertia, gear)"
            )
        self._let_launcher_carry(self.launcher)
        self._refresh_magnetic_field()

    def step(self, actuators: Array) -> None:
        """Advance one physics step and write `truth`. For a crashed vehicle only the time advances.

        Args:
            actuators: (MAX_ACTUATORS,) commands, motors 0..1, surfaces -1..1; those that the vehicle does not
                have are ignored. They act from this step on: rotors follow in this step, the motion from the
                next one.

        Raises:
            VehicleDivergedError: the motion is no longer possible, and nothing was hit.
        """
        if self.crash is not None:
            self._steps += 1
            return
        if self._air.stirs:
            self._air.step(self._steps)
        surfaces = self._surfaces
        if surfaces is None:
            for set_actuator, value in zip(self._set_actuators, actuators.tolist(), strict=False):
                set_actuator(value)
        else:
            surfaces.write(actuators)
            if self._steps % self._slow_steps == 0:
                surfaces.write_slow(actuators)
        launcher = self.launcher
        if launcher is not None:
            launcher.step()
        try:
            self._run()
        except jsbsim.BaseError as error:
            raise self._diverged(f"JSBSim says: {' '.join(str(error).split())}") from None
        self._steps += 1
        motion = self._read(self._steps)
        if launcher is not None:
            self._let_launcher_carry(launcher)
        if motion != _SOUND:
            self._end(motion, actuators)
        if self._steps % self._magnetic_steps == 0:
            self._refresh_magnetic_field()

    def launch(self) -> None:
        """Let the launch crew launch it; nothing for a vehicle that takes off from a runway or flies."""
        if self.launcher is not None:
            self.launcher.launch()
            self._fixed_wing_actuators().parked = False

    def motor_effectiveness(self, index: int) -> float:
        """Effectiveness of an actuator: 1 sound, 0 failed."""
        if self._surfaces is not None and index == 0:
            return self._surfaces.effectiveness(Role.THROTTLE)
        return float(self._effectiveness_node(index).get_double_value())

    def set_motor_effectiveness(self, index: int, value: float) -> None:
        """Weaken or fail an actuator in flight.

        Args:
            index: 0 is the first actuator; of a fixed-wing vehicle the motor.
            value: 1 sound, 0 failed.
        """
        if not 0.0 <= value <= 1.0:
            raise ValueError(f"motor effectiveness {value} is not in 0..1")
        if self._surfaces is not None and index == 0:
            self._surfaces.set_effectiveness(Role.THROTTLE, value)
            return
        self._effectiveness_node(index).set_double_value(value)

    def set_actuator_effectiveness(self, role: Role, value: float) -> None:
        """Weaken or fail an actuator of a fixed-wing vehicle in flight.

        Args:
            role: which actuator; `Role.THROTTLE` is the motor.
            value: 1 sound, 0 failed: a motor stops, a surface has no effect.
        """
        self._fixed_wing_actuators().set_effectiveness(role, value)

    def set_actuator_stuck(self, role: Role, stuck: bool = True) -> None:
        """Let an actuator of a fixed-wing vehicle stay where its command is now, or set it free."""
        self._fixed_wing_actuators().set_stuck(role, stuck)

    def set_wind(
        self,
        wind_ned_m_s: tuple[float, float, float],
        *,
        profile: WindProfile | None = None,
        wind_at_20_ft_m_s: float | None = None,
    ) -> None:
        """The air moves like this around this vehicle from now on.

        Args:
            wind_ned_m_s: of the air over ground, at the profile's reference height.
            profile: horizontal wind over height; None: as it was.
            wind_at_20_ft_m_s: intensity of Dryden turbulence that begins now, 0: none; None: as it was.
        """
        height_m = float(self.truth[t.ALT_M] - self.home.alt_m)
        self._air.set_wind(wind_ned_m_s, height_m, profile=profile, wind_at_20_ft_m_s=wind_at_20_ft_m_s)

    def _fixed_wing_actuators(self) -> FixedWingActuators:
        if self._surfaces is None:
            raise ValueError(
                f"vehicle '{self.airframe.name}' is a {self.airframe.kind}: its actuators have no roles"
            )
        return self._surfaces

    def _effectiveness_node(self, index: int) -> Any:
        if not 0 <= index < len(self._motor_effectiveness):
            raise ValueError(
                f"vehicle '{self.airframe.name}' has no actuator {index} that can fail; accepted are "
                f"0 to {len(self._motor_effectiveness) - 1}"
            )
        return self._motor_effectiveness[index]

    def _let_launcher_carry(self, launcher: Launcher | None) -> None:
        if launcher is not None and not launcher.released:
            self.truth[t.ON_GROUND] = 1.0

    def _settle(self, duration_s: float) -> None:
        """Let it come to rest where it stands or is held."""
        if self._surfaces is not None:
            self._surfaces.parked = self.launcher is None
            self._surfaces.write(np.zeros(MAX_ACTUATORS))
            self._surfaces.write_slow(np.zeros(MAX_ACTUATORS))
        for _ in range(round(duration_s * self.physics_rate_hz)):
            if self.launcher is not None:
                self.launcher.step()
            self._run()

    def _let_actuators_follow(self, start: InitialState) -> None:
        """Run the actuators to their commands, then start again with them there."""
        commands = np.zeros(MAX_ACTUATORS)
        given = (start.actuators or ())[:MAX_ACTUATORS]
        commands[: len(given)] = given
        if self._surfaces is None:
            for set_actuator, value in zip(self._set_actuators, commands.tolist(), strict=False):
                set_actuator(value)
        hold_motion(self._fdm, True)
        if self._surfaces is not None:
            self._surfaces.write_below(commands)
            for _ in range(round(_FOLLOW_S * self.physics_rate_hz / 10)):
                self._run()
            self._surfaces.write(commands)
            self._surfaces.write_slow(commands)
        for _ in range(round(_FOLLOW_S * self.physics_rate_hz)):
            self._run()
        hold_motion(self._fdm, False)
        initialise(self._fdm, self.airframe, self.home, self.environment, start, prepare=False)

    def _end(self, motion: int, actuators: Array) -> None:
        """What can't go on: a crash, or a model that diverged."""
        ground_alt_m = self.home.alt_m
        touched = self._reader.touches.recent(self._steps)
        sound = bool(np.all(np.isfinite(actuators[: self.actuator_count])))
        broken = motion == Motion.BROKEN
        if not (sound and (broken or hits_ground(self.truth, ground_alt_m, touched=touched))):
            raise self._diverged()
        self.crash = self._reader.touches.words(self._steps, self.truth)
        lay_down(self.truth, ground_alt_m)

    def _diverged(self, why: str = "its motion is not possible") -> VehicleDivergedError:
        return VehicleDivergedError(
            f"vehicle '{self.airframe.name}' diverged at step {self._steps} "
            f"({self._steps / self.physics_rate_hz:.3f} s): {why}"
        )

    def _refresh_magnetic_field(self) -> None:
        truth = self.truth
        truth[t.MAG_NED_GAUSS] = magnetic_field_ned_gauss(
            math.degrees(truth[t.LAT_RAD]),
            math.degrees(truth[t.LON_RAD]),
            float(truth[t.ALT_M]),
            self.environment.decimal_year,
        )


def _launch_parameters(airframe: Airframe, start: InitialState) -> LaunchParameters | None:
    """The launcher on which it starts, if any."""
    if start.height_m is not None:
        return None
    if airframe.kind is not AirframeKind.FIXED_WING:
        if start.launch is not None:
            raise ValueError(f"vehicle '{airframe.name}' is a {airframe.kind}; only a fixed wing is launched")
        return None
    kind = LaunchKind(start.launch or airframe.launch_kind)
    return None if kind is LaunchKind.RUNWAY else airframe.launch(kind)
