"""Passes over sources whose signatures are the simulator's own, with correlated errors of a map."""

import math

import numpy as np

from estimators.occupancy.placed_readings import PlacedReading
from flightsim.payload import DipoleSignature, GaussianSignature

FIELD_NED_NT = 48_000.0 * np.array([0.42, 0.02, 0.907])
DIRECTION = FIELD_NED_NT / np.linalg.norm(FIELD_NED_NT)
SPEED_M_S = 25.0
MAP_NT, CORRELATION_M, NOISE_NT = 1.0, 100.0, 0.2
HEIGHT_M = 80.0


def target(rng, place_ne_m=(0.0, 0.0)):
    """One of the class that is sought."""
    size = math.exp(0.07 * rng.standard_normal())
    return GaussianSignature(
        north_m=place_ne_m[0],
        east_m=place_ne_m[1],
        amplitude_nt=30.0 * math.exp(0.1 * rng.standard_normal()),
        sigma_along_m=80.0 * size,
        sigma_across_m=60.0 * size,
        heading_rad=rng.uniform(-math.pi, math.pi),
    )


def boat(rng, place_ne_m=(0.0, 0.0)):
    """A dipole of any direction."""
    direction = rng.standard_normal(3) + 2.0 * DIRECTION
    moment = rng.uniform(0.5e5, 2e5) * direction / np.linalg.norm(direction)
    return DipoleSignature(
        north_m=place_ne_m[0], east_m=place_ne_m[1], height_m=0.0, moment_ned_a_m2=tuple(moment)
    )


def track(rng, *, offset_m, course_rad, half_m=700.0, rate_hz=10):
    """Places (n, 2) of a straight pass at an offset from the origin."""
    along = np.arange(-half_m, half_m, SPEED_M_S / rate_hz)
    return np.column_stack(
        (
            along * math.cos(course_rad) - offset_m * math.sin(course_rad),
            along * math.sin(course_rad) + offset_m * math.cos(course_rad),
        )
    )


def map_errors_nt(rng, places):
    """Gauss-Markov errors along a track."""
    steps = np.hypot(*np.diff(places, axis=0).T)
    out = np.empty(len(places))
    out[0] = MAP_NT * rng.standard_normal()
    for k, step in enumerate(steps):
        decay = math.exp(-step / CORRELATION_M)
        out[k + 1] = decay * out[k] + MAP_NT * math.sqrt(1.0 - decay**2) * rng.standard_normal()
    return out


def differences_nt(rng, places, signatures):
    """Readings less map along a track."""
    north, east = places.T
    signal = sum(s.anomaly_nt(north, east, HEIGHT_M, FIELD_NED_NT) for s in signatures)
    return signal + map_errors_nt(rng, places) + NOISE_NT * rng.standard_normal(len(places))


def readings(rng, places, signatures, *, start_us=0, rate_hz=10):
    """Readings over a map that is zero."""
    values = differences_nt(rng, places, signatures)
    return [
        PlacedReading(
            time_us=start_us + (k + 1) * 1_000_000 // rate_hz,
            north_m=float(north),
            east_m=float(east),
            height_m=HEIGHT_M,
            total_nt=float(value),
        )
        for k, ((north, east), value) in enumerate(zip(places, values, strict=True))
    ]
