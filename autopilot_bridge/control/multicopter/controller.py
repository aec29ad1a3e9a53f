"""The multicopter controller: navigation state and setpoint in, motor commands out, once per physics step."""

import math
from typing import Final

import numpy as np

from autopilot_bridge.control.controller import Array, Controller, RecordArray
from autopilot_bridge.control.multicopter import setpoint as to
from autopilot_bridge.control.multicopter.attitude import (
    attitude_control,
    body_z_of,
    limit_rates,
    rate_control,
)
from autopilot_bridge.control.multicopter.layout import MulticopterState
from autopilot_bridge.control.multicopter.mixer import MOTORS, allocate, command_from_thrust
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from autopilot_bridge.control.multicopter.position import (
    estimate_hover_thrust,
    trajectory_control,
    update_airborne,
    update_filters,
    vertical_control,
)
from autopilot_bridge.control.multicopter.setpoint import Setpoint
from autopilot_bridge.navigation.layout import NavigationState
from flightsim.foundation.kernels import kernel

POSITION_RATE_HZ: Final = 62.5  # of the position loop, at least
_MIN_COS_TILT: Final = 0.5  # collective isn't raised any more beyond 60 deg of tilt


@kernel
def _finite4(v: Array) -> bool:
    return math.isfinite(v[0]) and math.isfinite(v[1]) and math.isfinite(v[2]) and math.isfinite(v[3])


@kernel
def _rest(nav: NavigationState, s: MulticopterState, command: float, actuators: Array) -> None:
    """Motors at one command, every integrator and filter at its start."""
    for i in range(actuators.shape[0]):
        actuators[i] = command if i < MOTORS else 0.0
    s.counter = 0.0
    s.last_level = 0.0
    s.airborne = 0.0
    s.start_down_m = 0.0
    s.vel_integral[:] = 0.0
    s.acc_filtered[:] = 0.0
    s.drag[:] = 0.0
    s.bump[:] = 0.0
    s.acc_setpoint[:] = 0.0
    s.vel_setpoint[:] = 0.0
    s.q_setpoint[:] = 0.0
    s.rate_setpoint[:] = 0.0
    s.thrust_setpoint = 0.0
    s.yaw_rate_ff = 0.0
    s.rate_integral[:] = 0.0
    s.rate_previous[:] = 0.0
    s.rate_derivative[:] = 0.0
    s.unallocated[:] = 0.0
    s.yaw_torque = 0.0
    s.counter = s.divisor
    s.q_setpoint[0] = 1.0
    s.start_down_m = nav.pos_ned_m[2] if math.isfinite(nav.pos_ned_m[2]) else 0.0
    for i in range(3):
        rate = nav.rates_frd_rad_s[i]
        s.rate_previous[i] = rate if math.isfinite(rate) else 0.0
    s.thrust_given = 0.0
    s.thrust_lagged = 0.0


@kernel
def _collective(
    nav: NavigationState,
    sp: Setpoint,
    p: MulticopterParameters,
    s: MulticopterState,
    dt: float,
    entering: bool,
) -> float:
    """Thrust setpoint below level TRAJECTORY; NaN flies the vertical part of the trajectory fields."""
    if math.isfinite(sp.thrust):
        s.vel_integral[2] = 0.0
        s.bump[2] = 0.0
        s.acc_setpoint[2] = math.nan  # the vertical isn't controlled
        return min(1.0, max(0.0, sp.thrust))
    # same speed limits and position P as in flight along a trajectory
    vz = sp.vel_ned_m_s[2]
    ez = sp.pos_ned_m[2] - nav.pos_ned_m[2]
    if math.isfinite(ez):
        vz = (vz if math.isfinite(vz) else 0.0) + p.pos_z_p_1_s * ez
    elif math.isnan(vz) and math.isnan(sp.acc_ned_m_s2[2]):
        vz = 0.0
    s.vel_setpoint[2] = min(p.speed_down_max_m_s, max(-p.speed_up_max_m_s, vz)) if vz == vz else vz
    up = vertical_control(nav, sp, p, s, dt, entering)
    _, _, cos_tilt = body_z_of(nav.q_ned_from_frd)
    return min(p.thrust_max, max(p.thrust_min, up / max(_MIN_COS_TILT, cos_tilt)))


@kernel
def _step(
    navs: RecordArray,
    setpoints: RecordArray,
    parameters: RecordArray,
    states: RecordArray,
    scratch: Array,
    actuators: Array,
) -> None:
    nav: NavigationState = navs[0]
    sp: Setpoint = setpoints[0]
    p, s = parameters[0], states[0]
    level = sp.level
    dt = s.dt
    if not level >= to.IDLE:  # OFF, and NaN
        _rest(nav, s, 0.0, actuators)
        return
    rates = nav.rates_frd_rad_s
    attitude_known = _finite4(nav.q_ned_from_frd) and math.isfinite(rates[0] + rates[1] + rates[2])
    if level < to.RATES or not attitude_known:
        _rest(nav, s, p.motor_idle, actuators)
        return

    switched = level != s.last_level
    s.counter += 1.0
    if s.counter >= s.divisor or switched:
        dt_outer = s.dt * s.divisor
        s.counter = 0.0
        update_airborne(nav, s)
        estimate_hover_thrust(nav, p, s, dt_outer)
        update_filters(nav, p, s, dt_outer)
        if level == to.TRAJECTORY:
            trajectory_control(nav, sp, p, s, dt_outer, switched)
        else:
            s.vel_integral[0] = 0.0
            s.vel_integral[1] = 0.0
            entering = math.isnan(s.acc_setpoint[2]) or s.last_level == 0.0
            s.thrust_setpoint = _collective(nav, sp, p, s, dt_outer, entering)
            s.yaw_rate_ff = sp.yaw_rate_rad_s if math.isfinite(sp.yaw_rate_rad_s) else 0.0
    s.last_level = level

    rate_sp = s.rate_setpoint
    if level == to.RATES:
        for i in range(3):
            rate_sp[i] = sp.rates_frd_rad_s[i] if math.isfinite(sp.rates_frd_rad_s[i]) else 0.0
    else:
        q_sp = s.q_setpoint
        if level == to.ATTITUDE:
            norm = 0.0
            for i in range(4):
                norm += sp.q_ned_from_frd[i] * sp.q_ned_from_frd[i]
            if norm > 0.1 and math.isfinite(norm):
                scale = 1.0 / math.sqrt(norm)
                for i in range(4):
                    q_sp[i] = sp.q_ned_from_frd[i] * scale
            else:  # no attitude to fly: level, nose as it is
                q_sp[0], q_sp[1], q_sp[2] = math.cos(0.5 * nav.euler_rad[2]), 0.0, 0.0
                q_sp[3] = math.sin(0.5 * nav.euler_rad[2])
        attitude_control(nav.q_ned_from_frd, q_sp, s.yaw_rate_ff, p, rate_sp, scratch)
        if level == to.ATTITUDE:
            for i in range(3):
                if math.isfinite(sp.rates_frd_rad_s[i]):
                    rate_sp[i] += sp.rates_frd_rad_s[i]
    limit_rates(rate_sp, p)

    thrust = s.thrust_setpoint
    # on the ground the legs hold the vehicle: an integrator would only store a kick for take-off
    integrate = s.airborne != 0.0 or thrust > 0.6 * s.hover
    rate_control(rates, rate_sp, p, s, dt, integrate)
    if p.yaw_torque_cutoff_hz > 0.0:
        alpha = dt / (dt + 1.0 / (2.0 * math.pi * p.yaw_torque_cutoff_hz))
        s.yaw_torque += alpha * (s.unallocated[2] - s.yaw_torque)
    else:
        s.yaw_torque = s.unallocated[2]
    motor = s.motor_thrust
    allocate(s.unallocated[0], s.unallocated[1], s.yaw_torque, thrust, motor, s.unallocated)
    s.thrust_given = 0.25 * (motor[0] + motor[1] + motor[2] + motor[3])
    for i in range(MOTORS):
        command = command_from_thrust(motor[i], p.thrust_model_factor)
        command = max(p.motor_idle, command)
        actuators[i] = command if math.isfinite(command) else p.motor_idle
    for i in range(MOTORS, actuators.shape[0]):
        actuators[i] = 0.0


class MulticopterController(Controller[MulticopterParameters, MulticopterState]):
    """Cascaded control of a quad-X: position, velocity, attitude, body rates, mixing.

    The setpoint's level chooses where the cascade starts. Fields that are not set (NaN) are filled as
    follows, so that no NaN reaches a motor: an axis with neither position, velocity nor acceleration stands
    still; NaN yaw holds by yaw rate; a NaN or zero attitude is level flight at the present heading; NaN rates
    are zero; NaN thrust at levels RATES and ATTITUDE means that the vertical part of the trajectory fields is
    flown. Position and velocity loops do not use unknown parts of the navigation state; without attitude or
    rates the motors idle.

    The setpoint has the layout `control.multicopter.setpoint`, the actuators are motor commands 0..1 (front
    right, rear left, front left, rear right), then zeros. Hover thrust is not learnt with ground contact.

    Args:
        parameters: gains and limits.
        physics_rate_hz: rate at which `step` is called.
        nav: navigation state, layout `navigation.layout`, shared with the filter.
    """

    def __init__(
        self, parameters: MulticopterParameters | None = None, *, physics_rate_hz: float, nav: Array
    ) -> None:
        super().__init__(
            MulticopterParameters() if parameters is None else parameters,
            physics_rate_hz=physics_rate_hz,
            nav=nav,
            kernel=_step,
            state=MulticopterState,
            setpoint=to,
            outer_rate_hz=POSITION_RATE_HZ,
            scratch=(np.zeros(8),),
        )
        state = self._state
        state.counter = state.divisor
        state.q_setpoint[0] = 1.0
        state.hover_variance = 0.01
        state.hover = self.parameters.hover_thrust

    def set_parameters(self, parameters: MulticopterParameters) -> None:
        """Replace gains and limits, in flight too; the hover-thrust estimate is kept while it is in use."""
        super().set_parameters(parameters)
        if not parameters.use_hover_thrust_estimate:
            self._state.hover = parameters.hover_thrust

    @property
    def hover_thrust(self) -> float:
        """Estimate of the collective that hovers, 0..1."""
        return float(self._state.hover)

    @property
    def thrust(self) -> float:
        """Collective given by the motors after desaturation, 0..1."""
        return float(self._state.thrust_given)
