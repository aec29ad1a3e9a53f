"""The fixed-wing controller: navigation state and setpoint in, actuator commands out, every physics step."""

import math
from collections.abc import Callable
from dataclasses import astuple, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing import layout as c
from autopilot_bridge.control.fixed_wing import setpoint as sp_layout
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.control.fixed_wing.step import control_step
from autopilot_bridge.navigation.layout import NAV_SIZE
from flightsim.foundation.kernels import bound
from flightsim.interface import MAX_ACTUATORS

Array = NDArray[np.float64]

GUIDANCE_RATE_HZ: Final = 50.0
_HOVER_THRUST: Final = 0.5


class FixedWingController:
    """Lateral guidance, total-energy control, attitude and rate control of a fixed wing.

    What a setpoint at level FLY leaves open (NaN) is filled as follows, so that no NaN reaches an actuator.
    Lateral: wings level. Longitudinal, by what is given of pitch, throttle and height (DOWN_M,
    HEIGHT_RATE_M_S):

    * nothing: the present height is held;
    * pitch, but no height: the throttle flies the airspeed;
    * throttle, but no height: the pitch flies the airspeed;
    * throttle and a height rate without a height: the pitch flies the height rate alone, even into the stall
      (the flare);
    * airspeed not known: pitch flies height, the throttle what the energy of the climb requires.

    Levels OFF and IDLE, unknown levels, and an unknown attitude (except with SURFACES_DIRECT) stop the
    propeller and centre the surfaces.

    Args:
        parameters: gains and limits.
        physics_rate_hz: rate at which `step` is called.
        nav: navigation state, layout `navigation.layout`, shared with the filter.

    Attributes:
        step: writes `actuators` for this physics step from `nav` and `setpoint`.
        setpoint: layout `control.fixed_wing.setpoint`; starts at level OFF.
        actuators: roles of `flightsim.interface`, `AILERON` ... `BRAKE`.
    """

    def __init__(
        self, parameters: FixedWingParameters | None = None, *, physics_rate_hz: float, nav: Array
    ) -> None:
        if not 50.0 <= physics_rate_hz <= 4000.0:
            raise ValueError(f"physics_rate_hz = {physics_rate_hz} is not in 50..4000")
        if nav.shape != (NAV_SIZE,) or nav.dtype != np.float64:
            raise ValueError(
                f"nav has shape {nav.shape} and type {nav.dtype}; float64 ({NAV_SIZE},) is accepted"
            )
        self._packed: Array = np.zeros(len(c.PARAMETER_NAMES))
        self._state: Array = np.zeros(c.STATE_SIZE)
        self.setpoint: Array = np.full(sp_layout.SETPOINT_SIZE, np.nan)
        self.setpoint[sp_layout.LEVEL] = sp_layout.OFF
        self.actuators: Array = np.zeros(MAX_ACTUATORS)
        state = self._state
        state[c.DT] = 1.0 / physics_rate_hz
        state[c.DIVISOR] = max(1.0, math.floor(physics_rate_hz / GUIDANCE_RATE_HZ))
        self.step: Callable[[], None] = bound(
            control_step, nav, self.setpoint, self._packed, state, self.actuators
        )
        self.set_parameters(FixedWingParameters() if parameters is None else parameters)
        self.step()

    @property
    def parameters(self) -> FixedWingParameters:
        """Gains and limits in use."""
        return self._parameters

    def set_parameters(self, parameters: FixedWingParameters) -> None:
        """Replace gains and limits, in flight too."""
        self._parameters = parameters
        self._packed[:] = astuple(parameters)

    def change(self, **values: float | bool) -> None:
        """Replace single parameters by their field names."""
        self.set_parameters(replace(self._parameters, **values))  # type: ignore[arg-type]

    def set_ground_contact(self, contact: bool) -> None:
        """Tell whether the ground or a launcher may carry the vehicle; integrators rest meanwhile."""
        self._state[c.GROUND_CONTACT] = 1.0 if contact else 0.0

    @property
    def hover_thrust(self) -> float:
        """0.5: an aircraft has none; here so that both controllers have the property."""
        return _HOVER_THRUST

    @property
    def thrust(self) -> float:
        """Throttle given, 0..1."""
        return float(self._state[c.THROTTLE])

    @property
    def attitude_setpoint(self) -> Array:
        """q_ned_from_frd of wanted roll and pitch at the present yaw, a view (4,)."""
        return self._state[c.Q_SETPOINT : c.Q_SETPOINT + 4]

    @property
    def rate_setpoint_frd_rad_s(self) -> Array:
        """Body rates wanted by the rate loop, a view (3,)."""
        return self._state[c.RATE_SETPOINT : c.RATE_SETPOINT + 3]

    @property
    def velocity_setpoint_ned_m_s(self) -> Array:
        """Wanted velocity, a view (3,): NaN but for the vertical one, and that too where it isn't flown."""
        return self._state[c.VEL_SETPOINT : c.VEL_SETPOINT + 3]

    @property
    def roll_setpoint_rad(self) -> float:
        """Bank angle wanted of the attitude loop."""
        return float(self._state[c.ROLL_SETPOINT])

    @property
    def pitch_setpoint_rad(self) -> float:
        """Pitch angle wanted of the attitude loop."""
        return float(self._state[c.PITCH_SETPOINT])

    @property
    def roll_limit_rad(self) -> float:
        """Bank limit in force in the lateral guidance."""
        return float(self._state[c.ROLL_LIMITED])

    @property
    def lateral_acceleration_setpoint_m_s2(self) -> float:
        """Wanted lateral acceleration, to the right."""
        return float(self._state[c.LATERAL_ACCELERATION])

    @property
    def course_setpoint_rad(self) -> float:
        """Course being flown, -pi..pi; NaN where none is."""
        return float(self._state[c.COURSE_SETPOINT])

    @property
    def heading_setpoint_rad(self) -> float:
        """Heading through the air being flown, -pi..pi; NaN where none is."""
        return float(self._state[c.HEADING_SETPOINT])

    @property
    def down_reference_m(self) -> float:
        """Height (local down, m) the energy control follows at this moment; NaN where none is."""
        controlled = self._state[c.HEIGHT_CONTROLLED] != 0.0
        return -float(self._state[c.HEIGHT_REFERENCE]) if controlled else math.nan

    @property
    def airspeed_setpoint_m_s(self) -> float:
        """Equivalent airspeed being flown, limits applied."""
        return float(self._state[c.AIRSPEED_SETPOINT])

    @property
    def airspeed_error_m_s(self) -> float:
        """Wanted less filtered equivalent airspeed; NaN where the airspeed isn't known."""
        if self._state[c.EAS_KNOWN] == 0.0:
            return math.nan
        return float(self._state[c.AIRSPEED_SETPOINT] - self._state[c.EAS])

    @property
    def underspeed(self) -> float:
        """How much too slow the vehicle is for the energy control: 0 not at all, 1 near the stall."""
        return float(self._state[c.UNDERSPEED])
