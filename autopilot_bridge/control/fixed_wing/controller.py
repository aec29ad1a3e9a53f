"""The fixed-wing controller: navigation state and setpoint in, actuator commands out, every physics step."""

import math
from typing import Final

from autopilot_bridge.control.controller import Array, Controller
from autopilot_bridge.control.fixed_wing import setpoint
from autopilot_bridge.control.fixed_wing.layout import FixedWingState
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.control.fixed_wing.step import control_step

GUIDANCE_RATE_HZ: Final = 50.0
_HOVER_THRUST: Final = 0.5


class FixedWingController(Controller[FixedWingParameters, FixedWingState]):
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

    The setpoint has the layout `control.fixed_wing.setpoint`, the actuators the roles of
    `flightsim.interface`, `AILERON` ... `BRAKE`. Of the wanted velocity only the vertical part is known.
    `attitude_setpoint` has wanted roll and pitch at the present yaw.

    Args:
        parameters: gains and limits.
        physics_rate_hz: rate at which `step` is called.
        nav: navigation state, layout `navigation.layout`, shared with the filter.
    """

    def __init__(
        self, parameters: FixedWingParameters | None = None, *, physics_rate_hz: float, nav: Array
    ) -> None:
        super().__init__(
            FixedWingParameters() if parameters is None else parameters,
            physics_rate_hz=physics_rate_hz,
            nav=nav,
            kernel=control_step,
            state=FixedWingState,
            setpoint=setpoint,
            outer_rate_hz=GUIDANCE_RATE_HZ,
        )
        self.step()

    @property
    def hover_thrust(self) -> float:
        """0.5: an aircraft has none; here so that both controllers have the property."""
        return _HOVER_THRUST

    @property
    def thrust(self) -> float:
        """Throttle given, 0..1."""
        return float(self._state.throttle)

    @property
    def roll_setpoint_rad(self) -> float:
        """Bank angle wanted of the attitude loop."""
        return float(self._state.roll_setpoint)

    @property
    def pitch_setpoint_rad(self) -> float:
        """Pitch angle wanted of the attitude loop."""
        return float(self._state.pitch_setpoint)

    @property
    def roll_limit_rad(self) -> float:
        """Bank limit in force in the lateral guidance."""
        return float(self._state.roll_limited)

    @property
    def lateral_acceleration_setpoint_m_s2(self) -> float:
        """Wanted lateral acceleration, to the right."""
        return float(self._state.lateral_acceleration)

    @property
    def course_setpoint_rad(self) -> float:
        """Course being flown, -pi..pi; NaN where none is."""
        return float(self._state.course_setpoint)

    @property
    def heading_setpoint_rad(self) -> float:
        """Heading through the air being flown, -pi..pi; NaN where none is."""
        return float(self._state.heading_setpoint)

    @property
    def down_reference_m(self) -> float:
        """Height (local down, m) the energy control follows at this moment; NaN where none is."""
        controlled = self._state.height_controlled != 0.0
        return -float(self._state.height_reference) if controlled else math.nan

    @property
    def airspeed_setpoint_m_s(self) -> float:
        """Equivalent airspeed being flown, limits applied."""
        return float(self._state.airspeed_setpoint)

    @property
    def airspeed_error_m_s(self) -> float:
        """Wanted less filtered equivalent airspeed; NaN where the airspeed isn't known."""
        if self._state.eas_known == 0.0:
            return math.nan
        return float(self._state.airspeed_setpoint - self._state.eas)

    @property
    def underspeed(self) -> float:
        """How much too slow the vehicle is for the energy control: 0 not at all, 1 near the stall."""
        return float(self._state.underspeed)
