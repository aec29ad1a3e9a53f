"""Flights of a fixed wing that are pure kinematics: truth vectors of launch, climb and turns in wind.

Independent of the vehicle model and of the filter: heading, airspeed and climb are prescribed; the air moves
with a steady wind and with first-order turbulence (the length scales of MIL-F-8785C at 100 m); the vehicle's
velocity follows the gusts with a lag, as its heading does (weathercock). Sideslip is what is left over, and a
constant trim.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from flightsim import truth as t
from flightsim.foundation.geodesy import LocalFrame
from tests.navigation.kinematic_flight import (
    EARTH_RATE,
    GRAVITY_M_S2,
    HOME,
    MAG_NED_GAUSS,
    RATE_HZ,
    quaternions,
    smooth,
)

Array = NDArray[np.float64]

_ALPHA_RAD = 0.05
_FOLLOW_S = 2.0  # ground velocity after a gust
_WEATHERCOCK_S = 0.5


@dataclass(frozen=True, kw_only=True)
class Wing:
    """What is flown, in which air.

    Attributes:
        turns: (start s, end s, heading rate deg/s), one after the other.
        speed_m_s: true airspeed after the climb-out.
        height_m: climbed to after the launch.
        launch_s: of the catapult; its push takes `push_s` to 18 m/s.
        wind_ne_m_s: steady wind, where it blows to.
        gust_m_s: 1-sigma of the turbulence, horizontal and vertical.
        gust_m: its correlation lengths.
        trim_sideslip_rad: constant sideslip of the trimmed aircraft.
        swing_m_s: amplitude of slow changes of the airspeed.
    """

    turns: tuple[tuple[float, float, float], ...] = ()
    heading_rad: float = 0.7
    speed_m_s: float = 25.0
    height_m: float = 100.0
    launch_s: float = 8.0
    push_s: float = 0.5
    wind_ne_m_s: tuple[float, float] = (-3.2, 2.4)
    gust_m_s: tuple[float, float] = (1.0, 0.75)
    gust_m: tuple[float, float] = (260.0, 100.0)
    trim_sideslip_rad: float = 0.01
    swing_m_s: float = 1.0


def low_pass(x: Array, time_s: float, dt: float) -> Array:
    """Second-order low-pass (two equal lags)."""
    k = dt / (time_s + dt)
    for _ in range(2):
        x = lfilter([k], [1.0, k - 1.0], x, axis=0, zi=(1.0 - k) * x[:1])[0]
    return x


def turbulence(wing: Wing, n: int, dt: float, rng: np.random.Generator) -> Array:
    """Gusts (n, 3), NED: Gauss-Markov, from a stationary start."""
    out = np.zeros((n, 3))
    for i in range(3):
        vertical = int(i == 2)
        sigma, tau = wing.gust_m_s[vertical], wing.gust_m[vertical] / wing.speed_m_s
        decay = np.exp(-dt / tau)
        noise = sigma * np.sqrt(1.0 - decay * decay) * rng.standard_normal(n)
        noise[0] = sigma * rng.standard_normal()
        out[:, i] = lfilter([1.0], [1.0, -decay], noise)
    return out


def fly_wing(duration_s: float, wing: Wing, *, seed: int = 0, rate_hz: int = RATE_HZ) -> Array:
    """Truth vectors (n, TRUTH_SIZE) of the flight, the first at one step after zero."""
    n = round(duration_s * rate_hz)
    dt = 1.0 / rate_hz
    time_s = np.arange(1, n + 1) * dt
    rng = np.random.default_rng(seed)
    gust = turbulence(wing, n, dt, rng)
    off = smooth(time_s, wing.launch_s, wing.push_s)
    follow = smooth(time_s, wing.launch_s + 0.5, 4.0)[:, None]  # how far the air carries the vehicle along

    rate = np.zeros(n)
    for start, end, deg_s in wing.turns:
        rate += np.radians(deg_s) * (smooth(time_s, start, 2.0) - smooth(time_s, end, 2.0))  # type: ignore[operator]
    heading = wing.heading_rad + np.cumsum(rate) * dt
    speed = 18.0 * off + (wing.speed_m_s - 18.0) * smooth(time_s, wing.launch_s + 3.0, 10.0)  # type: ignore[operator]
    speed = speed + wing.swing_m_s * follow[:, 0] * np.sin(0.11 * time_s)
    climb = wing.height_m / 25.0 * (
        smooth(time_s, wing.launch_s, 1.0) - smooth(time_s, wing.launch_s + 25.0, 4.0)  # type: ignore[operator]
    ) + 0.5 * follow[:, 0] * np.sin(0.17 * time_s)
    level = np.sqrt(np.maximum(speed**2 - climb**2, 0.0)) * off
    own = np.stack([level * np.cos(heading), level * np.sin(heading), -climb * off], axis=1)
    steady = np.array([*wing.wind_ne_m_s, 0.0])
    carried = low_pass(gust * [1.0, 1.0, 0.3], _FOLLOW_S, dt)
    vel = own + follow * (steady + carried)
    air = vel - steady - gust * off[:, None]

    flow = own + follow * (carried - gust)
    swing = np.arctan2(
        flow[:, 1] * np.cos(heading) - flow[:, 0] * np.sin(heading),
        np.maximum(flow[:, 0] * np.cos(heading) + flow[:, 1] * np.sin(heading), 1.0),
    )
    swing = low_pass(swing[:, None], _WEATHERCOCK_S, dt)[:, 0]
    yaw = heading + follow[:, 0] * (swing - wing.trim_sideslip_rad)
    pitch = np.arctan2(climb, np.maximum(level, 15.0)) + _ALPHA_RAD
    roll = np.arctan(speed * rate / GRAVITY_M_S2)
    rotation = rotations(roll, pitch, yaw)

    acceleration = np.gradient(vel, dt, axis=0)
    position = np.cumsum(0.5 * (vel + np.vstack([np.zeros(3), vel[:-1]])), axis=0) * dt
    lat = np.radians(HOME.lat_deg)
    earth = EARTH_RATE * np.array([np.cos(lat), 0.0, -np.sin(lat)])
    force = acceleration + 2.0 * np.cross(earth, vel) - [0.0, 0.0, GRAVITY_M_S2]
    euler_rate = np.gradient(np.stack([roll, pitch, yaw], axis=1), dt, axis=0)
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    rates = np.stack(
        [
            euler_rate[:, 0] - sp * euler_rate[:, 2],
            cr * euler_rate[:, 1] + sr * cp * euler_rate[:, 2],
            -sr * euler_rate[:, 1] + cr * cp * euler_rate[:, 2],
        ],
        axis=1,
    )

    out = np.zeros((n, t.TRUTH_SIZE))
    lat_deg, lon_deg, alt_m = LocalFrame(HOME).geodetic_from_ned(*position.T)
    out[:, t.LAT_RAD], out[:, t.LON_RAD], out[:, t.ALT_M] = np.radians(lat_deg), np.radians(lon_deg), alt_m
    out[:, t.VEL_NED_M_S] = vel
    out[:, t.Q_NED_FROM_FRD] = quaternions(rotation)
    out[:, t.RATES_FRD_RAD_S] = rates + np.einsum("nji,j->ni", rotation, earth)
    out[:, t.SPECIFIC_FORCE_FRD_M_S2] = np.einsum("nji,nj->ni", rotation, force)
    out[:, t.TEMPERATURE_K] = 288.15 - 0.0065 * np.asarray(alt_m)
    out[:, t.PRESSURE_PA] = 101325.0 * (1.0 - 0.0065 * np.asarray(alt_m) / 288.15) ** 5.2558797
    out[:, t.DENSITY_KG_M3] = out[:, t.PRESSURE_PA] / (287.05287 * out[:, t.TEMPERATURE_K])
    out[:, t.WIND_NED_M_S] = steady + gust
    out[:, t.MAG_NED_GAUSS] = MAG_NED_GAUSS
    out[:, t.HEIGHT_ABOVE_GROUND_M] = 0.2 - position[:, 2]
    out[:, t.ON_GROUND] = time_s < wing.launch_s
    body = np.einsum("nji,nj->ni", rotation, air)
    true = np.linalg.norm(air, axis=1)
    out[:, t.AIRSPEED_TRUE_M_S] = true
    out[:, t.DYNAMIC_PRESSURE_PA] = 0.5 * out[:, t.DENSITY_KG_M3] * true**2
    out[:, t.ANGLE_OF_ATTACK_RAD] = np.arctan2(body[:, 2], body[:, 0])
    out[:, t.SIDESLIP_RAD] = np.arcsin(body[:, 1] / np.maximum(true, 0.1))
    out[:, t.BATTERY_VOLTAGE_V] = 16.0
    out[:, t.BATTERY_CAPACITY_AH] = 5.0
    return out


def rotations(roll: Array, pitch: Array, yaw: Array) -> Array:
    """r_ned_from_frd (n, 3, 3) of Euler angles."""
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    sy, cy = np.sin(yaw), np.cos(yaw)
    return np.stack(
        [
            np.stack([cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy], axis=1),
            np.stack([cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy], axis=1),
            np.stack([-sp, sr * cp, cr * cp], axis=1),
        ],
        axis=1,
    )
