"""Position and velocity control of a multicopter: trajectory setpoint to thrust vector and attitude.

The structure PX4 publishes (Multicopter Position Control; `PositionControl`): position P gives a velocity,
velocity PID gives an acceleration, feed-forward adds at both places, the acceleration becomes a thrust
vector under tilt and thrust limits with the vertical first, and the integrator follows what was really
given (tracking anti-windup).

Added to it: drag, which the accelerometer measures directly across the
thrust axis, is fed forward below a cut-off on axes whose velocity is controlled (Kai, Allibert, Hua, Hamel,
"Nonlinear feedback control of quadrotors exploiting first-order drag effects", 2017).
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.multicopter.attitude import body_z_of, quaternion_from_thrust_axis
from autopilot_bridge.control.multicopter.layout import MulticopterState
from autopilot_bridge.control.multicopter.parameters import MulticopterParameters
from autopilot_bridge.control.multicopter.setpoint import Setpoint
from autopilot_bridge.navigation.layout import NavigationState
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import body_axis

Array = NDArray[np.float64]


_MIN_HOVER: Final = 0.05
_MAX_HOVER: Final = 0.9
_HOVER_PROCESS_STD_1_S: Final = 0.0036  # 1/sqrt(s) (PX4 HTE_HT_NOISE)
_HOVER_ACCEL_STD_M_S2: Final = 1.0
_HOVER_GATE: Final = 3.0  # standard deviations (PX4 HTE_ACC_GATE)
_HOVER_MIN_STD: Final = 0.003  # keeps the estimate able to follow a battery
_DRAG_MAX_M_S2: Final = 6.0
_BUMP_TIME_S: Final = 0.3
_AIRBORNE_CLIMB_M: Final = 0.2
_AIRBORNE_SPEED_M_S: Final = 0.5


@kernel
def lowpass_gain(dt: float, cutoff_hz: float) -> float:
    """Gain of a first-order low-pass step."""
    return dt / (dt + 1.0 / (2.0 * math.pi * cutoff_hz))


@kernel
def estimate_hover_thrust(
    nav: NavigationState, p: MulticopterParameters, s: MulticopterState, dt: float
) -> None:
    """One step of the scalar Kalman filter on hover thrust (PX4's idea, along the thrust axis).

    The accelerometer along body z reads the thrust alone, g thrust / hover, whatever the tilt and the motion.
    On the ground this is not valid: the decreasing thrust after a touchdown would be learnt as hover thrust,
    and the landing would not be detected.
    """
    s.thrust_lagged += (s.thrust_given - s.thrust_lagged) * min(1.0, dt / max(dt, p.rotor_time_constant_s))
    measured = -nav.specific_force_frd_m_s2[2]
    if not p.use_hover_thrust_estimate or s.airborne == 0.0 or s.ground_contact != 0.0:
        return
    if not math.isfinite(measured):
        return
    variance = s.hover_variance + _HOVER_PROCESS_STD_1_S * _HOVER_PROCESS_STD_1_S * dt
    hover = s.hover
    predicted = GRAVITY_M_S2 * s.thrust_lagged / hover
    slope = -predicted / hover
    innovation = measured - predicted
    spread = slope * slope * variance + _HOVER_ACCEL_STD_M_S2 * _HOVER_ACCEL_STD_M_S2
    if innovation * innovation <= _HOVER_GATE * _HOVER_GATE * spread:
        gain = variance * slope / spread
        new = min(_MAX_HOVER, max(_MIN_HOVER, hover + gain * innovation))
        variance = (1.0 - gain * slope) * variance
        # shift the vertical integrator so that the better estimate doesn't jerk the thrust
        acc_z = s.acc_setpoint[2]
        if math.isfinite(acc_z):
            s.vel_integral[2] += (acc_z - GRAVITY_M_S2) * hover / new + GRAVITY_M_S2 - acc_z
        s.hover = new
    else:
        variance *= 1.0 + 2.0 * dt  # gated out: grow, so that a wrong start can't lock the filter out
    s.hover_variance = min(0.04, max(_HOVER_MIN_STD * _HOVER_MIN_STD, variance))


@kernel
def update_airborne(nav: NavigationState, s: MulticopterState) -> None:
    """Latch AIRBORNE once the vehicle has moved vertically under power; OFF and IDLE clear it."""
    if s.airborne == 0.0 and (
        abs(nav.vel_ned_m_s[2]) > _AIRBORNE_SPEED_M_S or s.start_down_m - nav.pos_ned_m[2] > _AIRBORNE_CLIMB_M
    ):
        s.airborne = 1.0


@kernel
def update_filters(nav: NavigationState, p: MulticopterParameters, s: MulticopterState, dt: float) -> None:
    """Low-passed acceleration (the velocity derivative) and measured drag."""
    alpha = lowpass_gain(dt, p.vel_derivative_cutoff_hz)
    for i in range(3):
        acc = nav.acc_ned_m_s2[i]
        if math.isfinite(acc):
            s.acc_filtered[i] += alpha * (acc - s.acc_filtered[i])
    if p.drag_compensation_cutoff_hz <= 0.0 or s.airborne == 0.0:
        s.drag[0] = 0.0
        s.drag[1] = 0.0
        return
    w, x, y, z = nav.q_ned_from_frd[0], nav.q_ned_from_frd[1], nav.q_ned_from_frd[2], nav.q_ned_from_frd[3]
    x_north, x_east, _ = body_axis(w, x, y, z, 0)
    y_north, y_east, _ = body_axis(w, x, y, z, 1)
    fx, fy = nav.specific_force_frd_m_s2[0], nav.specific_force_frd_m_s2[1]
    north, east = x_north * fx + y_north * fy, x_east * fx + y_east * fy
    if s.ground_contact != 0.0:
        # a sideways force of the ground is no drag: tilting against it would overturn the vehicle
        north, east = 0.0, 0.0
    size = math.sqrt(north * north + east * east)
    if not math.isfinite(size):
        return
    if size > _DRAG_MAX_M_S2:
        north *= _DRAG_MAX_M_S2 / size
        east *= _DRAG_MAX_M_S2 / size
    beta = lowpass_gain(dt, p.drag_compensation_cutoff_hz)
    s.drag[0] += beta * (north - s.drag[0])
    s.drag[1] += beta * (east - s.drag[1])


@kernel
def _velocity_setpoint(
    nav: NavigationState, sp: Setpoint, p: MulticopterParameters, s: MulticopterState
) -> None:
    """VEL_SETPOINT from position P and feed-forward, limited; NaN where the velocity isn't controlled."""
    px, py = 0.0, 0.0  # share of the position loop, which keeps its right of way under the speed limit
    vx, vy = sp.vel_ned_m_s[0], sp.vel_ned_m_s[1]
    ex, ey = sp.pos_ned_m[0] - nav.pos_ned_m[0], sp.pos_ned_m[1] - nav.pos_ned_m[1]
    if math.isfinite(ex):
        px = p.pos_xy_p_1_s * ex
        vx = vx if math.isfinite(vx) else 0.0
    elif math.isnan(vx) and math.isnan(sp.acc_ned_m_s2[0]):
        vx = 0.0  # not commanded: stand still
    if math.isfinite(ey):
        py = p.pos_xy_p_1_s * ey
        vy = vy if math.isfinite(vy) else 0.0
    elif math.isnan(vy) and math.isnan(sp.acc_ned_m_s2[1]):
        vy = 0.0
    limit = p.speed_xy_max_m_s
    size = math.sqrt(px * px + py * py)
    if size > limit:
        px *= limit / size
        py *= limit / size
    fx = vx if math.isfinite(vx) else 0.0
    fy = vy if math.isfinite(vy) else 0.0
    if (px + fx) * (px + fx) + (py + fy) * (py + fy) > limit * limit:
        # largest share k of the feed-forward with |p + k f| = limit
        ff = fx * fx + fy * fy
        pf = px * fx + py * fy
        pp = px * px + py * py
        k = (-pf + math.sqrt(max(0.0, pf * pf - ff * (pp - limit * limit)))) / max(ff, 1e-9)
        k = min(1.0, max(0.0, k))
        fx *= k
        fy *= k
    s.vel_setpoint[0] = px + fx if math.isfinite(vx) else math.nan
    s.vel_setpoint[1] = py + fy if math.isfinite(vy) else math.nan

    vz = sp.vel_ned_m_s[2]
    ez = sp.pos_ned_m[2] - nav.pos_ned_m[2]
    if math.isfinite(ez):
        vz = (vz if math.isfinite(vz) else 0.0) + p.pos_z_p_1_s * ez
    elif math.isnan(vz) and math.isnan(sp.acc_ned_m_s2[2]):
        vz = 0.0
    if math.isfinite(vz):
        vz = min(p.speed_down_max_m_s, max(-p.speed_up_max_m_s, vz))
    s.vel_setpoint[2] = vz


@kernel
def _finite_or_zero(value: float) -> float:
    return value if math.isfinite(value) else 0.0


@kernel
def _acceleration_axis(
    axis: int, nav: NavigationState, sp: Setpoint, kp: float, kd: float, s: MulticopterState
) -> tuple[float, float, bool]:
    """(acceleration, velocity error, controlled) of one NED axis."""
    acc = _finite_or_zero(sp.acc_ned_m_s2[axis])
    error = s.vel_setpoint[axis] - nav.vel_ned_m_s[axis]
    if not math.isfinite(error):
        s.vel_integral[axis] = 0.0
        return acc, 0.0, False
    return (acc + kp * error + s.vel_integral[axis] - kd * s.acc_filtered[axis], error, True)


@kernel
def vertical_control(
    nav: NavigationState,
    sp: Setpoint,
    p: MulticopterParameters,
    s: MulticopterState,
    dt: float,
    entering: bool,
) -> float:
    """Vertical thrust (positive up, normalised, before tilt) from the vertical part of the setpoint."""
    acc, error, controlled = _acceleration_axis(2, nav, sp, p.vel_z_p_1_s, p.vel_z_d, s)
    hover = s.hover
    if entering and s.airborne != 0.0:
        # start from the thrust flown so far, so that the switch isn't felt
        _, _, cos_tilt = body_z_of(nav.q_ned_from_frd)
        present = GRAVITY_M_S2 * (1.0 - s.thrust_given * max(0.3, cos_tilt) / hover)
        s.bump[2] = min(5.0, max(-5.0, present - acc))
    acc += s.bump[2]
    s.bump[2] *= math.exp(-dt / _BUMP_TIME_S)
    s.acc_setpoint[2] = acc
    up = hover * (1.0 - acc / GRAVITY_M_S2)
    if controlled:
        at_min = up <= p.thrust_min and error >= 0.0
        at_max = up >= p.thrust_max and error <= 0.0
        # before lift-off only upwards: the ground holds the vehicle back, not a lack of sinking
        grounded = s.airborne == 0.0 and error >= 0.0
        if not (at_min or at_max or grounded):
            new = s.vel_integral[2] + p.vel_z_i_1_s2 * error * dt
            s.vel_integral[2] = min(GRAVITY_M_S2, max(-GRAVITY_M_S2, new))
    return min(p.thrust_max, max(0.0, up))


@kernel
def trajectory_control(
    nav: NavigationState,
    sp: Setpoint,
    p: MulticopterParameters,
    s: MulticopterState,
    dt: float,
    entering: bool,
) -> None:
    """One step of the position loop: writes Q_SETPOINT, THRUST_SETPOINT and YAW_RATE_FF."""
    _velocity_setpoint(nav, sp, p, s)
    ax, error_x, control_x = _acceleration_axis(0, nav, sp, p.vel_xy_p_1_s, p.vel_xy_d, s)
    ay, error_y, control_y = _acceleration_axis(1, nav, sp, p.vel_xy_p_1_s, p.vel_xy_d, s)
    hover = s.hover
    thrust_max = p.thrust_max
    if entering and s.airborne != 0.0:
        zx, zy, _ = body_z_of(nav.q_ned_from_frd)
        pull = GRAVITY_M_S2 * s.thrust_given / hover
        s.bump[0] = -zx * pull + s.drag[0] - ax
        s.bump[1] = -zy * pull + s.drag[1] - ay
    # drag is fought only for a wanted velocity: without one it is what brings the vehicle to rest in the air
    drag_x, drag_y = s.drag[0], s.drag[1]
    if not control_x:
        drag_x = 0.0
        s.bump[0] = 0.0
    if not control_y:
        drag_y = 0.0
        s.bump[1] = 0.0
    up = vertical_control(nav, sp, p, s, dt, entering)
    ax += s.bump[0]
    ay += s.bump[1]
    decay = math.exp(-dt / _BUMP_TIME_S)
    s.bump[0] *= decay
    s.bump[1] *= decay
    s.acc_setpoint[0] = ax
    s.acc_setpoint[1] = ay

    # horizontal thrust for the wanted acceleration against the measured drag, in units of hover thrust / g
    wanted_x, wanted_y = ax - drag_x, ay - drag_y
    tx, ty = hover * wanted_x / GRAVITY_M_S2, hover * wanted_y / GRAVITY_M_S2
    wanted = math.sqrt(tx * tx + ty * ty)
    # vertical first, but keep a margin for staying on the path when climbing at full thrust
    margin = min(wanted, p.thrust_xy_margin * thrust_max)
    up = min(up, math.sqrt(thrust_max * thrust_max - margin * margin))
    room = math.sqrt(max(0.0, thrust_max * thrust_max - up * up))
    # a tilted vehicle must still push up: below half of hover the tilt is taken as if pushing half
    room = min(room, math.tan(p.tilt_max_rad) * up)
    given = wanted
    if wanted > room:
        given = room
        tx *= room / wanted
        ty *= room / wanted
    scale = GRAVITY_M_S2 / hover
    missing_x, missing_y = wanted_x - tx * scale, wanted_y - ty * scale
    if wanted > given:
        # tracking anti-windup (Visioli; PX4 uses gain 2 / P)
        back = 2.0 / p.vel_xy_p_1_s
        error_x -= back * missing_x
        error_y -= back * missing_y
    if s.airborne != 0.0:
        if control_x:
            s.vel_integral[0] += p.vel_xy_i_1_s2 * error_x * dt
        if control_y:
            s.vel_integral[1] += p.vel_xy_i_1_s2 * error_y * dt
        size = math.sqrt(s.vel_integral[0] ** 2 + s.vel_integral[1] ** 2)
        if size > GRAVITY_M_S2:
            s.vel_integral[0] *= GRAVITY_M_S2 / size
            s.vel_integral[1] *= GRAVITY_M_S2 / size
    else:
        s.vel_integral[0] = 0.0
        s.vel_integral[1] = 0.0

    thrust = math.sqrt(tx * tx + ty * ty + up * up)
    zx, zy, zz = 0.0, 0.0, 1.0
    if thrust > 1e-6:
        zx, zy, zz = -tx / thrust, -ty / thrust, up / thrust
    s.thrust_setpoint = max(thrust, p.thrust_min)
    yaw = sp.yaw_rad
    if not math.isfinite(yaw):
        yaw = nav.euler_rad[2]
    s.yaw_rate_ff = _finite_or_zero(sp.yaw_rate_rad_s)
    quaternion_from_thrust_axis(zx, zy, zz, yaw, s.q_setpoint)
