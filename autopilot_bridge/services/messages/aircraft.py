"""The common sources of the messages of both firmwares' aircraft: airspeed, wind and the path being flown."""

import math
from typing import NamedTuple

import numpy as np

from autopilot_bridge.control.fixed_wing import FixedWingController
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.navigation import layout as nav
from autopilot_bridge.services.messages.flight_path import FlightPath, flight_path
from autopilot_bridge.services.parts import AutopilotParts
from flightsim import interface
from flightsim.foundation.rotations import rotate_inverse


class Surfaces(NamedTuple):
    """Actuators of an aircraft: surfaces -1..1, throttle 0..1."""

    aileron: float
    elevator: float
    throttle: float
    rudder: float


class AircraftState:
    """Reads an aircraft's sources."""

    def __init__(self, parts: AutopilotParts) -> None:
        self._parts = parts
        self._context = parts.commander.context
        self._path: FlightPath | None = None
        self._path_of: tuple[int, object] = (-1, None)

    @property
    def airspeed_m_s(self) -> float:
        """Equivalent airspeed; 0 where it isn't known."""
        airspeed = float(self._parts.navigation.state[nav.AIRSPEED_M_S])
        return airspeed if math.isfinite(airspeed) else 0.0

    @property
    def wind_ned_m_s(self) -> tuple[float, float, float] | None:
        """The estimated wind; None where there is no estimate. A vertical part isn't estimated."""
        north, east, down = self._parts.navigation.state[nav.WIND_NED_M_S].tolist()
        if not (math.isfinite(north) and math.isfinite(east)):
            return None
        return north, east, down if math.isfinite(down) else 0.0

    @property
    def air_velocity_frd_m_s(self) -> tuple[float, float, float]:
        """Velocity through the air along the body's axes, by ground velocity and wind; zero without wind."""
        wind = self.wind_ned_m_s
        if wind is None:
            return 0.0, 0.0, 0.0
        state = self._parts.navigation.state
        body = np.zeros(3)
        rotate_inverse(state[nav.Q_NED_FROM_FRD], state[nav.VEL_NED_M_S] - np.array(wind), body)
        forward, right, down = body.tolist()
        return forward, right, down

    @property
    def path(self) -> FlightPath | None:
        """The path being flown; determined once per step, since several messages need it."""
        if not self._context.armed:
            return None
        commander = self._parts.commander
        task = commander.tasks.task
        now = (self._parts.view.time_us, task)
        if now != self._path_of:
            self._path_of = now
            self._path = flight_path(task, self._context, commander.missions)
        return self._path

    @property
    def surfaces(self) -> Surfaces:
        """The commands of the actuators."""
        values = self._parts.controller.actuators.tolist()
        return Surfaces(
            values[interface.AILERON],
            values[interface.ELEVATOR],
            values[interface.THROTTLE],
            values[interface.RUDDER],
        )

    @property
    def powered(self) -> bool:
        """The motor may turn: the vehicle is armed, and the task is not idle."""
        context = self._context
        return context.armed and bool(context.setpoint[sp.LEVEL] > sp.IDLE)

    @property
    def controller(self) -> FixedWingController:
        """The control laws of an aircraft."""
        controller = self._parts.controller
        assert isinstance(controller, FixedWingController)
        return controller

    @property
    def pitot_pressure_pa(self) -> float | None:
        """Newest differential pressure; None before the first sample, or without a tube."""
        reading = self._parts.readings.airspeed
        if reading.time_us < 0:
            return None
        return float(reading.values[interface.AIRSPEED_DIFFERENTIAL_PRESSURE_PA])


class AircraftAir:
    """What both firmwares' common messages report of the air around an aircraft."""

    _aircraft: AircraftState

    def airspeed_m_s(self) -> float:
        """VFR_HUD's airspeed."""
        return self._aircraft.airspeed_m_s

    def differential_pressure_hpa(self) -> float:
        """SCALED_PRESSURE's pitot pressure."""
        pressure_pa = self._aircraft.pitot_pressure_pa
        return 0.0 if pressure_pa is None else pressure_pa * 0.01
