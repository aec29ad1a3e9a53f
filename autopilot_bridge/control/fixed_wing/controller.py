"""The fixed-wing controller: navigation state and setpoint in, actuator commands out, every physics step."""

import math
from dataclasses import astuple, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control import fixed_wing_setpoint as sp_layout
from autopilot_bridge.control.fixed_wing import layout as c
from autopilot_bridge.control.fixed_wing.air import update_air
from autopilot_bridge.control.fixed_wing.attitude import (
    attitude_control,
    limit_surfaces,
    rate_control,
    wheel_control,
)
from autopilot_bridge.control.fixed_wing.energy import PITCH_LIMIT_RAD, energy_control
from autopilot_bridge.control.fixed_wing.lateral import lateral_control
from autopilot_bridge.control.fixed_wing.parameters import FixedWingParameters
from autopilot_bridge.navigation.layout import NAV_SIZE
from flightsim.interface import AILERON, BRAKE, ELEVATOR, FLAPS, MAX_ACTUATORS, RUDDER, STEERING, THROTTLE
from flightsim.kernels import kernel
from flightsim.rotations import quaternion_from_euler

Array = NDArray[np.float64]

GUIDANCE_RATE_HZ: Final = 50.0
_NAV_RATES: Final = 4  # navigation slots, as in navigation.layout
_NAV_ROLL: Final = 25
_NAV_PITCH: Final = 26
_NAV_YAW: Final = 27
_SP_THROTTLE: Final = 8  # setpoint slots, as in control.fixed_wing_setpoint
_SP_RATES: Final = 9
_SP_SURFACES: Final = 12
_SP_STEERING: Final = 15
_SP_LEVEL: Final = 19
_SP_FLAPS: Final = 21
_SP_BRAKE: Final = 22
_SP_YAW_STICK: Final = 23
_HOVER_THRUST: Final = 0.5


@kernel
def _given(value: float, low: float, high: float) -> float:
    """The value within limits; 0 for NaN."""
    return min(high, max(low, value)) if math.isfinite(value) else 0.0


@kernel
def _rest(nav: Array, s: Array, actuators: Array) -> None:
    """Propeller stopped, surfaces neutral, every integrator and filter at its start."""
    for i in range(actuators.shape[0]):
        actuators[i] = 0.0
    for i in range(c.COUNTER, c.STATE_SIZE):
        s[i] = 0.0
    s[c.COUNTER] = s[c.DIVISOR]
    s[c.Q_SETPOINT] = 1.0
    s[c.HEADING_SETPOINT] = math.nan
    s[c.COURSE_SETPOINT] = math.nan
    for i in range(3):
        s[c.VEL_SETPOINT + i] = math.nan
        rate = nav[_NAV_RATES + i]
        s[c.RATE_PREVIOUS + i] = rate if math.isfinite(rate) else 0.0


@kernel
def _sum_of_guidance(s: Array) -> float:
    """Finite as long as all is that guidance carries on from step to step."""
    total = s[c.EAS] + s[c.EAS_RATE] + s[c.EAS_TO_TAS] + s[c.ENERGY_RATE]
    for i in range(c.ROLL_SETPOINT, c.HEIGHT_CONTROLLED):
        total += s[i]
    for i in range(c.AIRSPEED_SETPOINT, c.Q_SETPOINT):
        total += s[i]
    return total


@kernel
def _guide(nav: Array, sp: Array, p: Array, s: Array, level: float) -> None:
    """The 50 Hz part: airspeed filter, lateral guidance, energy control."""
    dt = s[c.DT] * s[c.DIVISOR]
    update_air(nav, p, s, dt)
    if level != sp_layout.FLY:
        s[c.FLYING] = 0.0
        s[c.VEL_SETPOINT + 2] = math.nan
        s[c.HEADING_SETPOINT] = math.nan
        s[c.COURSE_SETPOINT] = math.nan
        s[c.HEIGHT_CONTROLLED] = 0.0
        s[c.UNDERSPEED] = 0.0
        s[c.ROLL_SETPOINT] = nav[_NAV_ROLL]
        s[c.PITCH_SETPOINT] = nav[_NAV_PITCH]
        s[c.THROTTLE] = _given(sp[_SP_THROTTLE], 0.0, 1.0)
        return
    entering = s[c.FLYING] == 0.0
    if entering:  # from the attitude flown so far, so that the switch isn't felt
        s[c.FLYING] = 1.0
        s[c.ROLL_SETPOINT] = nav[_NAV_ROLL]
        s[c.PITCH_SETPOINT] = min(PITCH_LIMIT_RAD, max(-PITCH_LIMIT_RAD, nav[_NAV_PITCH]))
    lateral_control(nav, sp, p, s, dt)
    energy_control(nav, sp, p, s, dt, entering)
    if not math.isfinite(_sum_of_guidance(s)):  # absurd inputs have overflowed: begin again
        for i in range(c.FLYING, c.Q_SETPOINT):
            s[i] = 0.0


@kernel
def _step(nav: Array, sp: Array, p: Array, s: Array, actuators: Array) -> None:
    level = sp[_SP_LEVEL]
    flown = level == sp_layout.FLY or level == sp_layout.RATES or level == sp_layout.SURFACES_DIRECT
    known = True
    for i in range(7):  # attitude and rates
        known = known and math.isfinite(nav[i])
    known = known and math.isfinite(nav[_NAV_ROLL] + nav[_NAV_PITCH] + nav[_NAV_YAW])
    direct = level == sp_layout.SURFACES_DIRECT
    if not flown or not (known or direct):
        _rest(nav, s, actuators)
        return

    s[c.COUNTER] += 1.0
    if known and (s[c.COUNTER] >= s[c.DIVISOR] or level != s[c.LAST_LEVEL]):
        s[c.COUNTER] = 0.0
        _guide(nav, sp, p, s, level)
    s[c.LAST_LEVEL] = level

    surfaces = actuators[0:3]  # in the kernels' order: aileron, elevator, rudder
    yaw_stick = _given(sp[_SP_YAW_STICK], -1.0, 1.0)
    steering = yaw_stick
    if direct:
        for i in range(3):
            surfaces[i] = _given(sp[_SP_SURFACES + i], -1.0, 1.0)
            s[c.RATE_INTEGRAL + i] = 0.0
            s[c.RATE_SETPOINT + i] = 0.0
        s[c.THROTTLE] = _given(sp[_SP_THROTTLE], 0.0, 1.0)
        steering = surfaces[2]
    else:
        if level == sp_layout.RATES:
            for i in range(3):
                s[c.RATE_SETPOINT + i] = _given(sp[_SP_RATES + i], -20.0, 20.0)
            s[c.THROTTLE] = _given(sp[_SP_THROTTLE], 0.0, 1.0)
        else:
            attitude_control(nav, p, s)
        rolling = math.isfinite(sp[_SP_STEERING])
        if rolling:
            steering = min(1.0, max(-1.0, wheel_control(nav, sp, p, s) + yaw_stick))
            yaw_stick = steering  # the rudder helps the wheels
        else:
            s[c.WHEEL_INTEGRAL] = 0.0
        rate_control(nav, p, s, surfaces, rolling)
        limit_surfaces(p, s, yaw_stick, surfaces)
    aileron, elevator, rudder = surfaces[0], surfaces[1], surfaces[2]
    actuators[AILERON] = aileron
    actuators[ELEVATOR] = elevator
    actuators[THROTTLE] = s[c.THROTTLE]
    actuators[RUDDER] = rudder
    actuators[FLAPS] = _given(sp[_SP_FLAPS], 0.0, 1.0)
    actuators[STEERING] = steering
    actuators[BRAKE] = _given(sp[_SP_BRAKE], 0.0, 1.0)
    quaternion_from_euler(
        s[c.ROLL_SETPOINT], s[c.PITCH_SETPOINT], nav[_NAV_YAW], s[c.Q_SETPOINT : c.Q_SETPOINT + 4]
    )


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
    * airspeed not known: pitch flies height, the throttle what the energy of the climb asks for.

    Levels OFF and IDLE, unknown levels, and an unknown attitude (except with SURFACES_DIRECT) stop the
    propeller and centre the surfaces.

    Args:
        parameters: gains and limits.
        physics_rate_hz: rate at which `step` is called.
        nav: navigation state, layout `navigation.layout`, shared with the filter.

    Attributes:
        setpoint: layout `control.fixed_wing_setpoint`; starts at level OFF.
        actuators: roles of `flightsim.interface`, `AILERON` ... `BRAKE`.
    """

    __slots__ = ("_nav", "_packed", "_parameters", "_state", "actuators", "setpoint")

    def __init__(
        self, parameters: FixedWingParameters | None = None, *, physics_rate_hz: float, nav: Array
    ) -> None:
        if not 50.0 <= physics_rate_hz <= 4000.0:
            raise ValueError(f"physics_rate_hz = {physics_rate_hz} is not in 50..4000")
        if nav.shape != (NAV_SIZE,) or nav.dtype != np.float64:
            raise ValueError(
                f"nav has shape {nav.shape} and type {nav.dtype}; float64 ({NAV_SIZE},) is accepted"
            )
        self._nav = nav
        self._packed: Array = np.zeros(len(c.PARAMETER_NAMES))
        self._state: Array = np.zeros(c.STATE_SIZE)
        self.setpoint: Array = np.full(sp_layout.SETPOINT_SIZE, np.nan)
        self.setpoint[sp_layout.LEVEL] = sp_layout.OFF
        self.actuators: Array = np.zeros(MAX_ACTUATORS)
        state = self._state
        state[c.DT] = 1.0 / physics_rate_hz
        state[c.DIVISOR] = max(1.0, math.floor(physics_rate_hz / GUIDANCE_RATE_HZ))
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

    def step(self) -> None:
        """Write `actuators` for this physics step from `nav` and `setpoint`."""
        _step(self._nav, self.setpoint, self._packed, self._state, self.actuators)

    @property
    def hover_thrust(self) -> float:
        """0.5: an aircraft has none; here so that either controller can be asked."""
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
