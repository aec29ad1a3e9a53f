"""Jerk-limited motion along straight legs, online: position, velocity and acceleration to feed the control
laws.

Two nested laws per tick, horizontally on the vector (so that path and limits don't depend on the axes) and
vertically on the scalar: a velocity wanted from the geometry of the leg (braking distance to its end speed,
cross-track correction), and an acceleration that brings the velocity there under acceleration and jerk
limits, a = sqrt(2 j |dv|) towards it, the time-optimal surface of the double integrator (Bryson and Ho,
1975, section 3.9). The idea of running such a smoother in front of the position loop is PX4's
(`PositionSmoothing`).
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.parameters import FlightParameters
from flightsim.foundation.kernels import bound, kernel

Array = NDArray[np.float64]

# limits
SPEED: Final = 0  # along a leg, horizontal
SPEED_UP: Final = 1
SPEED_DOWN: Final = 2
ACC: Final = 3
ACC_UP: Final = 4
ACC_DOWN: Final = 5
JERK: Final = 6
GAIN: Final = 7
SPEED_TURN: Final = 8  # in the corner before the leg; infinite when it is behind
LIMITS_SIZE: Final = 9

_SURFACE_SHARE: Final = 0.8  # of the jerk, used by the switching surface; the rest absorbs the 50 Hz grid
_BRAKE_SHARE: Final = 0.8  # of the acceleration, used for the braking profile
_VELOCITY_GAIN_1_S: Final = 7.0
_CROSS_ACC_SHARE: Final = 0.7  # of the acceleration, used by the profile with which a leg is joined
_TURNED_M_S: Final = 0.3  # this close to the velocity behind a corner the turn is over


@kernel
def braking_speed(distance: float, end_speed: float, acc: float, jerk: float, gain: float) -> float:
    """Speed at `distance` before a point that is passed at `end_speed`.

    Far from the point, it is the square-root profile of constant deceleration, shortened by the distance
    needed to build up that deceleration from full acceleration; near a stop it is the linear law `gain *
    distance`.
    """
    a = _BRAKE_SHARE * acc
    if distance <= 0.0:
        return end_speed
    # v^2/(2a) + v a/j = d + ve^2/(2a) + ve a/j  (deceleration built up at limited jerk)
    b = a * a / jerk
    v = -b + math.sqrt(b * b + 2.0 * a * distance + end_speed * end_speed + 2.0 * b * end_speed)
    return min(v, end_speed + gain * distance)


@kernel
def _room(distance: float, speed: float, acc: float, jerk: float) -> float:
    """Distance left for braking after a present acceleration towards the point has been removed."""
    if acc <= 0.0 or speed <= 0.0:
        return distance
    return max(0.0, distance - (speed + acc * acc / (3.0 * jerk)) * acc / jerk)


@kernel
def _approach2(s: Array, vx: float, vy: float, acc_max: float, jerk: float, dt: float) -> None:
    """Horizontal velocity of the state towards (vx, vy)."""
    dvx, dvy = vx - s[3], vy - s[4]
    size = math.sqrt(dvx * dvx + dvy * dvy)
    ax, ay = 0.0, 0.0
    if size > 1e-9:
        want = min(acc_max, math.sqrt(2.0 * _SURFACE_SHARE * jerk * size), _VELOCITY_GAIN_1_S * size)
        ax, ay = want * dvx / size, want * dvy / size
    jx, jy = ax - s[6], ay - s[7]
    change = math.sqrt(jx * jx + jy * jy)
    if change > jerk * dt:
        jx *= jerk * dt / change
        jy *= jerk * dt / change
    for i, j in ((0, jx), (1, jy)):
        a0 = s[6 + i]
        a1 = a0 + j
        s[i] += s[3 + i] * dt + (2.0 * a0 + a1) * dt * dt / 6.0
        s[3 + i] += 0.5 * (a0 + a1) * dt
        s[6 + i] = a1


@kernel
def _approach_leg(
    s: Array, ux: float, uy: float, v_along: float, v_left: float, acc_max: float, jerk: float, dt: float
) -> None:
    """Horizontal velocity of the state towards a velocity along and to the left of a leg's direction.

    The velocity across the leg comes first, and the rest of the acceleration acts along it: a vehicle that
    accelerated at once to full speed after a corner would have no acceleration left for the turn, and would
    overshoot.
    """
    dv_along = v_along - (s[3] * ux + s[4] * uy)
    dv_left = v_left - (s[3] * uy - s[4] * ux)
    want = min(
        acc_max, math.sqrt(2.0 * _SURFACE_SHARE * jerk * abs(dv_left)), _VELOCITY_GAIN_1_S * abs(dv_left)
    )
    left = want if dv_left > 0.0 else -want
    rest = math.sqrt(acc_max * acc_max - left * left)
    want = min(
        rest, math.sqrt(2.0 * _SURFACE_SHARE * jerk * abs(dv_along)), _VELOCITY_GAIN_1_S * abs(dv_along)
    )
    along = want if dv_along > 0.0 else -want
    j_left = left - (s[6] * uy - s[7] * ux)
    j_along = along - (s[6] * ux + s[7] * uy)
    change = math.sqrt(j_left * j_left + j_along * j_along)
    if change > jerk * dt:
        j_left *= jerk * dt / change
        j_along *= jerk * dt / change
    for i, j in ((0, j_along * ux + j_left * uy), (1, j_along * uy - j_left * ux)):
        a0 = s[6 + i]
        a1 = a0 + j
        s[i] += s[3 + i] * dt + (2.0 * a0 + a1) * dt * dt / 6.0
        s[3 + i] += 0.5 * (a0 + a1) * dt
        s[6 + i] = a1


@kernel
def _approach1(s: Array, vz: float, up: float, down: float, jerk: float, dt: float) -> None:
    """Vertical velocity of the state towards vz (NED down)."""
    dv = vz - s[5]
    want = min(math.sqrt(2.0 * _SURFACE_SHARE * jerk * abs(dv)), _VELOCITY_GAIN_1_S * abs(dv))
    a = min(want, down) if dv > 0.0 else -min(want, up)
    j = min(jerk * dt, max(-jerk * dt, a - s[8]))
    a0 = s[8]
    a1 = a0 + j
    s[2] += s[5] * dt + (2.0 * a0 + a1) * dt * dt / 6.0
    s[5] += 0.5 * (a0 + a1) * dt
    s[8] = a1


@kernel
def _track_velocity(s: Array, vx: float, vy: float, vz: float, lim: Array, dt: float) -> None:
    _approach2(s, vx, vy, lim[ACC], lim[JERK], dt)
    _approach1(s, vz, lim[ACC_UP], lim[ACC_DOWN], lim[JERK], dt)


@kernel
def _join_leg(
    s: Array, rx: float, ry: float, ux: float, uy: float, speed: float, lim: Array, dt: float
) -> None:
    """One tick towards and along the line in direction u through the point at r from the state."""
    cross = rx * uy - ry * ux  # distance to the leg, positive where it is on the left
    off = abs(cross)
    side = 1.0 if cross > 0.0 else -1.0
    closing = side * (s[3] * uy - s[4] * ux)
    pull = side * (s[6] * uy - s[7] * ux)
    back = _room(off, closing, pull, lim[JERK])
    profile = braking_speed(back, 0.0, _CROSS_ACC_SHARE * lim[ACC], lim[JERK], lim[GAIN])
    v_cross = min(0.6 * max(speed, 1.0), profile)
    sideways = max(v_cross, abs(closing))  # includes the acceleration not yet removed
    v_along = math.sqrt(max(0.0, speed * speed - sideways * sideways))
    _approach_leg(s, ux, uy, v_along, side * v_cross, lim[ACC], lim[JERK], dt)


@kernel
def _follow_leg(
    s: Array, start: Array, end: Array, lim: Array, end_speed: float, turn_in: float, dt: float
) -> None:
    """One tick along the straight leg start -> end, to be left at `end_speed`, `turn_in` before its end."""
    lx, ly, lz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    flat = math.sqrt(lx * lx + ly * ly)
    rx, ry = end[0] - s[0], end[1] - s[1]
    remaining = math.sqrt(rx * rx + ry * ry)
    gain = lim[GAIN]
    # vertical speed that matches the leg's slope limits the horizontal speed too
    speed = lim[SPEED]
    v_limit_z = lim[SPEED_UP] if end[2] < s[2] else lim[SPEED_DOWN]
    z_target, slope_rate = end[2], 0.0
    if flat < 0.5 or remaining < 1e-6:
        # a vertical or short leg: straight to its end
        vx, vy = 0.0, 0.0
        if remaining > 1e-6:
            rate, pull = (s[3] * rx + s[4] * ry) / remaining, (s[6] * rx + s[7] * ry) / remaining
            room = _room(remaining, rate, pull, lim[JERK])
            v = min(speed, braking_speed(room, 0.0, lim[ACC], lim[JERK], gain))
            vx, vy = v * rx / remaining, v * ry / remaining
        _approach2(s, vx, vy, lim[ACC], lim[JERK], dt)
    else:
        ux, uy = lx / flat, ly / flat
        slope = lz / flat
        if abs(slope) > 1e-6:
            leg_limit_z = lim[SPEED_UP] if lz < 0.0 else lim[SPEED_DOWN]
            speed = min(speed, leg_limit_z / abs(slope))
        along = rx * ux + ry * uy
        if along <= 0.0 and end_speed <= 0.0:
            v = min(speed, braking_speed(remaining, 0.0, lim[ACC], lim[JERK], gain))
            _approach2(s, v * rx / remaining, v * ry / remaining, lim[ACC], lim[JERK], dt)
        else:
            room = _room(max(0.0, along - turn_in), s[3] * ux + s[4] * uy, s[6] * ux + s[7] * uy, lim[JERK])
            v = min(speed, braking_speed(room, end_speed, lim[ACC], lim[JERK], gain))
            turn = min(v, lim[SPEED_TURN])
            tx, ty = turn * ux, turn * uy
            if math.isfinite(lim[SPEED_TURN]) and math.hypot(tx - s[3], ty - s[4]) < _TURNED_M_S:
                lim[SPEED_TURN] = math.inf
            if math.isfinite(lim[SPEED_TURN]):
                # in a corner: from one leg's velocity to the other's; its end was planned
                _approach2(s, tx, ty, lim[ACC], lim[JERK], dt)
            else:
                # speed across the leg reduces the speed along it
                across = s[4] * ux - s[3] * uy
                along_limit = math.sqrt(max(0.04 * speed * speed, speed * speed - across * across))
                _join_leg(s, rx, ry, ux, uy, min(v, along_limit), lim, dt)
        part = min(1.0, max(0.0, 1.0 - along / flat))
        z_target = start[2] + part * lz
        if 0.0 < part < 1.0:
            slope_rate = slope * (s[3] * ux + s[4] * uy)
    ez = z_target - s[2]
    acc_z = min(lim[ACC_UP], lim[ACC_DOWN])
    sign = 1.0 if ez > 0.0 else -1.0
    room = _room(abs(ez), s[5] * sign, s[8] * sign, lim[JERK])
    v_z = min(v_limit_z, braking_speed(room, 0.0, acc_z, lim[JERK], gain))
    vz = slope_rate + sign * v_z
    vz = min(lim[SPEED_DOWN], max(-lim[SPEED_UP], vz))
    _approach1(s, vz, lim[ACC_UP], lim[ACC_DOWN], lim[JERK], dt)


class TrajectoryGenerator:
    """A moving point with limited speed, acceleration and jerk.

    Attributes:
        position_ned_m, velocity_ned_m_s, acceleration_ned_m_s2: views of the state, (3,) each.
        limits: float64 (9,), see the indices of this module; writable.
    """

    def __init__(self, parameters: FlightParameters, *, speed_m_s: float | None = None) -> None:
        self._setpoint: Array = np.full(sp.SETPOINT_SIZE, math.nan)  # with the state in its place
        self._setpoint[sp.LEVEL] = sp.TRAJECTORY
        self._state: Array = self._setpoint[sp.MOTION]
        self._state[:] = 0.0
        self.position_ned_m: Array = self._state[0:3]
        self.velocity_ned_m_s: Array = self._state[3:6]
        self.acceleration_ned_m_s2: Array = self._state[6:9]
        self.limits: Array = np.zeros(LIMITS_SIZE)
        self._start_ned_m, self._end_ned_m = np.zeros(3), np.zeros(3)
        self._follow_leg = bound(
            _follow_leg, self._state, self._start_ned_m, self._end_ned_m, self.limits, then=(0.0, 0.0, 0.0)
        )
        self.stretch = 1.0
        self.set_limits(parameters, speed_m_s=speed_m_s)

    def set_limits(self, parameters: FlightParameters, *, speed_m_s: float | None = None) -> None:
        """Set the limits from the parameters; `speed_m_s` replaces the cruise speed, within the maximum."""
        speed = parameters.cruise_speed_m_s if speed_m_s is None else speed_m_s
        self.limits[:] = (
            min(max(speed, 0.05), parameters.max_speed_m_s),
            parameters.climb_speed_m_s,
            parameters.descend_speed_m_s,
            parameters.acceleration_m_s2,
            parameters.acceleration_up_m_s2,
            parameters.acceleration_down_m_s2,
            parameters.jerk_m_s3,
            parameters.trajectory_p_1_s,
            math.inf,
        )

    def reset(
        self, position_ned_m: Array, velocity_ned_m_s: Array, acceleration_ned_m_s2: Array | None = None
    ) -> None:
        """Start from a present state; acceleration beyond the limits is clipped."""
        self._state[0:3] = position_ned_m
        self._state[3:6] = velocity_ned_m_s
        self._state[6:9] = 0.0
        if acceleration_ned_m_s2 is not None:
            ax, ay, az = (float(a) for a in acceleration_ned_m_s2)
            size = math.hypot(ax, ay)
            scale = min(1.0, self.limits[ACC] / size) if size > 0.0 else 0.0
            self._state[6] = ax * scale
            self._state[7] = ay * scale
            self._state[8] = min(float(self.limits[ACC_DOWN]), max(-float(self.limits[ACC_UP]), az))
        self.stretch = 1.0

    def wait_for(self, vehicle_ned_m: Array, error_max_m: float) -> None:
        """Slow the next tick down when the vehicle lags behind, to a stop at `error_max_m` (PX4
        MPC_XY_ERR_MAX).
        """
        error = math.dist(vehicle_ned_m[0:2].tolist(), self._state[0:2].tolist())
        free = 0.4 * error_max_m
        self.stretch = min(1.0, max(0.0, (error_max_m - error) / (error_max_m - free)))

    def follow_leg(
        self,
        start_ned_m: Array,
        end_ned_m: Array,
        end_speed_m_s: float,
        dt_s: float,
        *,
        turn_in_m: float = 0.0,
    ) -> None:
        """One tick along a straight leg.

        Args:
            start_ned_m, end_ned_m: the leg, (3,).
            end_speed_m_s: speed at which its end is passed; 0: stop there.
            dt_s: length of the tick.
            turn_in_m: distance before the end at which that speed is reached and the turn begins.
        """
        self._start_ned_m[:] = start_ned_m
        self._end_ned_m[:] = end_ned_m
        self._follow_leg(end_speed_m_s, turn_in_m, dt_s * self.stretch)

    def track_velocity(self, north_m_s: float, east_m_s: float, down_m_s: float, dt_s: float) -> None:
        """One tick towards a velocity."""
        _track_velocity(self._state, north_m_s, east_m_s, down_m_s, self.limits, dt_s)

    def write(self, setpoint: Array) -> None:
        """Write a control setpoint of position, velocity and acceleration alone."""
        setpoint[:] = self._setpoint
        if self.stretch < 1.0:
            setpoint[sp.VEL_HORIZONTAL] *= self.stretch
            setpoint[sp.ACC_HORIZONTAL] *= self.stretch
