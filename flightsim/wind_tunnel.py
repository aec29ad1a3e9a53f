"""A JSBSim aircraft held in a state of motion while actuators and engines settle: forces and moments of it.

JSBSim's integrators are switched off, so position, attitude, velocity and rates stay as they were set, while
everything with its own dynamics (servos, rotors, engines) continues. The readings are then the accelerations
that the aircraft would have.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.actuation import FixedWingActuators
from flightsim.airframe import Airframe, AirframeError, AirframeKind, Role, load_airframe
from flightsim.environment import Environment
from flightsim.foundation.atmosphere import SEA_LEVEL_DENSITY_KG_M3
from flightsim.foundation.imperial import KG_M3_PER_SLUG_FT3, KG_PER_SLUG, M_PER_FT, N_PER_LBF
from flightsim.foundation.rotations import quaternion_from_euler, rotate
from flightsim.home import Home
from flightsim.initial_state import InitialState, height_on_wheels_m, initialise
from flightsim.interface import MAX_ACTUATORS
from flightsim.jsbsim_model import find_property, hold_motion, load_fdm

Array = NDArray[np.float64]

_BLOCK_S: Final = 0.4  # servos have followed by then
_SETTLED: Final = 2e-5  # m/s2 and rad/s2 from block to block
_LONGEST_S: Final = 20.0  # a jet needs that to spool up
_ACCELERATIONS: Final = (
    *(f"accelerations/{axis}dot-ft_sec2" for axis in "uvw"),
    *(f"accelerations/{axis}dot-rad_sec2" for axis in "pqr"),
)
_SCALES: Final = np.array([M_PER_FT, M_PER_FT, M_PER_FT, 1.0, 1.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightState:
    """A state of motion through still air.

    Attributes:
        vel_frd_m_s: velocity, body axes.
        rates_frd_rad_s: body rates against the Earth.
        roll_rad, pitch_rad: attitude.
        actuators: commands by role, in the order of `flightsim.interface`.
    """

    vel_frd_m_s: tuple[float, float, float]
    rates_frd_rad_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    actuators: tuple[float, ...] = field(default=(0.0,) * MAX_ACTUATORS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """What the tunnel's balance shows.

    Attributes:
        accelerations: (6,) derivatives of the body-axis velocity (m/s2) and rates (rad/s2).
        force_frd_n: (3,) of air and propulsion, body axes.
    """

    accelerations: Array
    force_frd_n: Array


class WindTunnel:
    """Holds one aircraft.

    Attributes:
        airframe: its description.
        actuators: writes its commands.
        density_kg_m3: of the air at the height of the measurements.
        mass_kg, wing_span_m, wing_area_m2, chord_m: of the model.
        standing_height_m: of its centre of gravity over the ground, on its wheels.
    """

    def __init__(
        self,
        model: str | Path | Airframe,
        *,
        home: Home | None = None,
        environment: Environment | None = None,
        height_m: float = 100.0,
        physics_rate_hz: int = 125,
    ) -> None:
        """Load an aircraft.

        Args:
            model: as for `Vehicle`.
            home: place; its altitude plus `height_m` makes the density.
            environment: only its temperature counts.
            height_m: over the ground, clear of ground effect.
            physics_rate_hz: step of the model.

        Raises:
            AirframeError: no usable fixed-wing model.
        """
        airframe = model if isinstance(model, Airframe) else load_airframe(model)
        if airframe.kind is not AirframeKind.FIXED_WING:
            raise AirframeError(
                f"vehicle '{airframe.name}' is a {airframe.kind}; accepted here are fixed-wing vehicles"
            )
        self.airframe = airframe
        self._fdm, _ = load_fdm(airframe, physics_rate_hz)
        hold_motion(self._fdm, True)
        self._home = home or Home()
        air = environment or Environment()
        self._environment = Environment(temperature_offset_k=air.temperature_offset_k)
        self._height_m = height_m
        self._block_steps = round(_BLOCK_S * physics_rate_hz)
        self._start_done = False
        self._sticky = "hysteresis_width" in airframe.xml_path.read_text(errors="replace")

        def getters(names: tuple[str, ...]) -> tuple[Any, ...]:
            return tuple(
                find_property(self._fdm, name, needed_by="the wind tunnel").get_double_value for name in names
            )

        self._get = getters(_ACCELERATIONS)
        self._forces = getters(tuple(f"forces/fb{axis}-total-lbs" for axis in "xyz"))
        self.actuators = FixedWingActuators(self._fdm, airframe)
        self._initialise(FlightState(vel_frd_m_s=(30.0, 0.0, 0.0)))
        fuel_freeze = self._fdm.get_property_manager().get_node("propulsion/fuel_freeze")
        if fuel_freeze is not None:
            fuel_freeze.set_double_value(1.0)
        value = self._fdm.get_property_value
        self.density_kg_m3 = float(value("atmosphere/rho-slugs_ft3")) * KG_M3_PER_SLUG_FT3
        self.mass_kg = float(value("inertia/mass-slugs")) * KG_PER_SLUG
        self.wing_span_m = float(value("metrics/bw-ft")) * M_PER_FT
        self.wing_area_m2 = float(value("metrics/Sw-sqft")) * M_PER_FT**2
        self.chord_m = float(value("metrics/cbarw-ft")) * M_PER_FT
        self.standing_height_m = height_on_wheels_m(self._fdm, airframe)

    @property
    def powered(self) -> bool:
        """Whether a throttle does something."""
        return Role.THROTTLE in self.actuators.roles

    def true_airspeed_m_s(self, equivalent_m_s: float) -> float:
        """True airspeed at the tunnel's density."""
        return equivalent_m_s * math.sqrt(SEA_LEVEL_DENSITY_KG_M3 / self.density_kg_m3)

    def measure(self, state: FlightState, *, engines: bool = True) -> Reading:
        """Hold the aircraft in a state and read its accelerations.

        Args:
            state: motion and commands.
            engines: wait for engines too, not for servos only. They need not settle again after a small
                change of anything but throttle and airspeed.
        """
        self._initialise(state)
        commands = np.array(state.actuators, np.float64)
        run = self._fdm.run
        if self._sticky:
            self.actuators.write_below(commands)
            for _ in range(self._block_steps // 2):
                run()
        self.actuators.write(commands)
        self.actuators.write_slow(commands)
        last = np.full(6, np.inf)
        for _ in range(round(_LONGEST_S / _BLOCK_S)):
            for _ in range(self._block_steps):
                run()
            accelerations = np.array([get() for get in self._get]) * _SCALES
            if not engines or float(np.max(np.abs(accelerations - last))) < _SETTLED:
                break
            last = accelerations
        force = np.array([get() for get in self._forces]) * N_PER_LBF
        return Reading(accelerations=accelerations, force_frd_n=force)

    def value(self, name: str) -> float:
        """A JSBSim property of the model, now."""
        return float(find_property(self._fdm, name, needed_by="the wind tunnel").get_double_value())

    def truth_value(self, index: int) -> float:
        """What the model has for a place of the truth vector, now; NaN where it has nothing."""
        scales = self.airframe.truth_scale or (1.0,) * len(self.airframe.truth)
        for (place, name), scale in zip(self.airframe.truth, scales, strict=True):
            if place == index:
                return float(self._fdm.get_property_value(name)) * scale
        return dict(self.airframe.constants).get(index, math.nan)

    def rotor_rad_s(self) -> tuple[float, ...]:
        """Speeds of the rotors the description names."""
        return tuple(
            self.truth_value(index)
            for index, _ in self.airframe.truth
            if t.ROTOR_RAD_S.start <= index < t.ROTOR_RAD_S.stop
        )

    def _initialise(self, state: FlightState) -> None:
        yaw = math.radians(self._home.heading_deg)
        q, vel_ned = np.empty(4), np.empty(3)
        quaternion_from_euler(state.roll_rad, state.pitch_rad, yaw, q)
        rotate(q, np.array(state.vel_frd_m_s), vel_ned)
        north, east, down = vel_ned.tolist()
        start = InitialState(
            height_m=self._height_m,
            roll_rad=state.roll_rad,
            pitch_rad=state.pitch_rad,
            yaw_rad=yaw,
            vel_ned_m_s=(north, east, down),
            rates_frd_rad_s=state.rates_frd_rad_s,
        )
        initialise(
            self._fdm, self.airframe, self._home, self._environment, start, prepare=not self._start_done
        )
        self._start_done = True
