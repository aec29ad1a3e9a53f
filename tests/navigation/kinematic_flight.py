"""A flight that is pure kinematics: the truth vectors of a multirotor that thrusts along its own axis.

Independent of the vehicle model and of the filter: positions are analytic, velocity and acceleration come
from five-point differences of them, the attitude points the thrust where the acceleration needs it, the rates
come from the attitude's differences.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsim import truth as t
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

Array = NDArray[np.float64]
Path = Callable[[Array], Array]

HOME = GeodeticPosition(lat_deg=47.397742, lon_deg=8.545594, alt_m=488.0)
GRAVITY_M_S2 = 9.80762  # of the normal ellipsoid at home
EARTH_RATE = 7.292115e-5
MAG_NED_GAUSS = (0.21556, 0.01200, 0.43052)  # close to WMM2025 at home; tests that need the model compute it
RATE_HZ = 250


def smooth(time_s: Array, start_s: float, duration_s: float) -> Array:
    """0 before, 1 after, a quintic between."""
    u = np.clip((time_s - start_s) / duration_s, 0.0, 1.0)
    return u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)


@dataclass(frozen=True, kw_only=True)
class Lissajous:
    """Rest, climb, a three-dimensional Lissajous curve with changing speed, hover."""

    size_m: float = 40.0
    height_m: float = 15.0
    swing_m: float = 4.0
    takeoff_s: float = 8.0
    figure_s: float = 16.0
    end_s: float = 1e9

    def __call__(self, time_s: Array) -> Array:
        climb = smooth(time_s, self.takeoff_s, 5.0)
        go = smooth(time_s, self.takeoff_s + 4.0, 6.0) * (1.0 - smooth(time_s, self.end_s, 8.0))
        w = 2.0 * np.pi / 40.0
        phase = w * (time_s - self.figure_s)
        return np.stack(
            [
                go * self.size_m * np.sin(2.0 * phase),
                go * self.size_m * np.sin(phase),
                -climb * self.height_m - go * self.swing_m * np.sin(3.0 * phase),
            ],
            axis=-1,
        )


def rotations(path: Path, yaw: Path, time_s: Array) -> Array:
    """r_ned_from_frd (n, 3, 3) with the body's z axis against the specific force."""
    force = acceleration(path, time_s) - [0.0, 0.0, GRAVITY_M_S2]
    down = -force / np.linalg.norm(force, axis=1, keepdims=True)
    angle = yaw(time_s)
    heading = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
    right = np.cross(down, heading)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    return np.stack([np.cross(right, down), right, down], axis=-1)


def velocity(path: Path, time_s: Array, h: float = 1e-2) -> Array:
    return (8.0 * (path(time_s + h) - path(time_s - h)) - (path(time_s + 2 * h) - path(time_s - 2 * h))) / (
        12.0 * h
    )


def acceleration(path: Path, time_s: Array, h: float = 1e-2) -> Array:
    near, far = path(time_s + h) + path(time_s - h), path(time_s + 2 * h) + path(time_s - 2 * h)
    return (16.0 * near - far - 30.0 * path(time_s)) / (12.0 * h * h)


def quaternions(rotation: Array) -> Array:
    """(n, 4) w x y z, by the largest-component method."""
    m = rotation
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    squares = np.stack(
        [1 + trace, *(1 + 2 * m[:, i, i] - trace for i in range(3))], axis=1
    )  # 4 w^2, 4 x^2, 4 y^2, 4 z^2
    wx, wy, wz = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    xy, xz, yz = m[:, 1, 0] + m[:, 0, 1], m[:, 0, 2] + m[:, 2, 0], m[:, 2, 1] + m[:, 1, 2]
    rows = np.stack(
        [
            np.stack([squares[:, 0], wx, wy, wz], axis=1),
            np.stack([wx, squares[:, 1], xy, xz], axis=1),
            np.stack([wy, xy, squares[:, 2], yz], axis=1),
            np.stack([wz, xz, yz, squares[:, 3]], axis=1),
        ],
        axis=1,
    )
    best = rows[np.arange(len(m)), np.argmax(squares, axis=1)]
    return best / np.linalg.norm(best, axis=1, keepdims=True)


def default_yaw(time_s: Array) -> Array:
    """Still, then slow turns both ways with some quick ones."""
    go = smooth(time_s, 14.0, 5.0)
    return 0.7 + go * (1.2 * np.sin(0.23 * time_s) + 0.5 * np.sin(0.9 * time_s))


def fly(
    duration_s: float,
    *,
    path: Path | None = None,
    yaw: Path = default_yaw,
    rate_hz: int = RATE_HZ,
    home: GeodeticPosition = HOME,
    mag_ned_gauss: tuple[float, float, float] = MAG_NED_GAUSS,
) -> Array:
    """Truth vectors (n, TRUTH_SIZE) of the flight, the first at one step after zero."""
    path = Lissajous() if path is None else path
    n = round(duration_s * rate_hz)
    time_s = np.arange(1, n + 1) / rate_hz
    out = np.zeros((n, t.TRUTH_SIZE))
    position, vel = path(time_s), velocity(path, time_s)
    rotation = rotations(path, yaw, time_s)
    h = 1e-4
    step = np.einsum(
        "nji,njk->nik", rotations(path, yaw, time_s - h), rotations(path, yaw, time_s + h)
    )  # about exp(2 h [w]x)
    rates = np.stack(
        [step[:, 2, 1] - step[:, 1, 2], step[:, 0, 2] - step[:, 2, 0], step[:, 1, 0] - step[:, 0, 1]], axis=1
    ) / (4.0 * h)
    lat = np.radians(home.lat_deg)
    earth = EARTH_RATE * np.array([np.cos(lat), 0.0, -np.sin(lat)])
    force = acceleration(path, time_s) + 2.0 * np.cross(earth, vel) - [0.0, 0.0, GRAVITY_M_S2]
    frame = LocalFrame(home)
    lat_deg, lon_deg, alt_m = frame.geodetic_from_ned(*position.T)  # type: ignore[arg-type]
    out[:, t.LAT_RAD], out[:, t.LON_RAD], out[:, t.ALT_M] = np.radians(lat_deg), np.radians(lon_deg), alt_m
    out[:, t.VEL_NED_M_S] = vel
    out[:, t.Q_NED_FROM_FRD] = quaternions(rotation)
    out[:, t.RATES_FRD_RAD_S] = rates + np.einsum("nji,j->ni", rotation, earth)
    out[:, t.SPECIFIC_FORCE_FRD_M_S2] = np.einsum("nji,nj->ni", rotation, force)
    out[:, t.TEMPERATURE_K] = 288.15 - 0.0065 * np.asarray(alt_m)
    out[:, t.PRESSURE_PA] = 101325.0 * (1.0 - 0.0065 * np.asarray(alt_m) / 288.15) ** 5.2558797
    out[:, t.DENSITY_KG_M3] = out[:, t.PRESSURE_PA] / (287.05287 * out[:, t.TEMPERATURE_K])
    out[:, t.MAG_NED_GAUSS] = mag_ned_gauss
    out[:, t.HEIGHT_ABOVE_GROUND_M] = home.alt_m + 0.1 - home.alt_m - position[:, 2]
    out[:, t.ON_GROUND] = -position[:, 2] < 1e-6
    out[:, t.BATTERY_VOLTAGE_V] = 16.0
    out[:, t.BATTERY_CAPACITY_AH] = 5.0
    return out
