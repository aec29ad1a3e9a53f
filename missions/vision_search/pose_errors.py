"""The errors of the vehicles' own poses in a flight, by the truth in its log: a calibration of the
estimator.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import metres
from estimators.received import not_in_gaps, received_times
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.vectors import euler_from_quaternions, wrap_pi
from missions.flown.records import FlightRecords, positions_ned_m

__all__ = ["PoseErrorFigures", "pose_errors"]

Array = NDArray[np.float64]
PoseErrorFigures = dict[str, float]

_STEP_S: Final = 0.25
_LEAST: Final = 40  # samples


def pose_errors(
    records: FlightRecords, system_id: int, frame: LocalFrame, span_us: tuple[int, int]
) -> PoseErrorFigures | None:
    """Root mean squares of the errors of a vehicle's messages, and how long they last; None: not enough is
    known.

    Args:
        records: of the flight.
        system_id: of the vehicle.
        frame: of the area.
        span_us: vehicle time of the search.

    Returns:
        forward_m, right_m, height_m, yaw_rad, pitch_rad, roll_rad; place_time_s and attitude_time_s: the
        times after which the autocorrelation of the errors has fallen to 1/e, the mean of the axes.
    """
    truth = records.truth(system_id)
    attitude = records.table("ATTITUDE", system_id, AUTOPILOT_COMPONENT)
    attitude = attitude[received_times(attitude["time_boot_ms"].astype(np.int64) * 1000).rows]
    position = records.positions(system_id)
    times = np.arange(span_us[0], span_us[1], _STEP_S * 1e6)
    if min(len(truth), len(attitude), len(position)) < _LEAST:
        return None
    true_us = truth["time_usec"].astype(np.float64)
    for known_us in (true_us, attitude["time_boot_ms"] * 1e3, position["time_boot_ms"] * 1e3):
        times = times[not_in_gaps(times * 1e-6, known_us * 1e-6)]
    if len(times) < _LEAST:
        return None
    true_angles = [
        _at(times, true_us, angle, angle=True)
        for angle in euler_from_quaternions(truth["attitude_quaternion"])
    ]
    own_us = attitude["time_boot_ms"] * 1e3
    angles = [
        wrap_pi(_at(times, own_us, attitude[name].astype(np.float64), angle=True) - true)
        for name, true in zip(("roll", "pitch", "yaw"), true_angles, strict=True)
    ]
    own_us = position["time_boot_ms"] * 1e3
    own_ne_m, true_ne_m = (positions_ned_m(table, frame).T[:2] for table in (position, truth))
    north, east = (
        _at(times, own_us, own) - _at(times, true_us, true)
        for own, true in zip(own_ne_m, true_ne_m, strict=True)
    )
    # height above home: that of the truth from its own begin, before the take-off
    height = _at(times, own_us, metres(position["relative_alt"]))
    height = height - _at(times, true_us, metres(truth["alt"])) + metres(float(truth["alt"][0]))
    cosine, sine = np.cos(true_angles[2]), np.sin(true_angles[2])
    figures = {
        "forward_m": _rms(north * cosine + east * sine),
        "right_m": _rms(east * cosine - north * sine),
        "height_m": _rms(height),
        "yaw_rad": _rms(angles[2]),
        "pitch_rad": _rms(angles[1]),
        "roll_rad": _rms(angles[0]),
        "place_time_s": float(np.mean([_lasting_s(error) for error in (north, east)])),
        "attitude_time_s": float(np.mean([_lasting_s(error) for error in angles[:2]])),
    }
    return {name: round(value, 5) for name, value in figures.items()}


def _at(times: Array, known_us: Array, values: Array, *, angle: bool = False) -> Array:
    return np.asarray(np.interp(times, known_us, np.unwrap(values) if angle else values))


def _rms(values: Array) -> float:
    return math.sqrt(float(np.mean(values**2)))


def _lasting_s(error: Array) -> float:
    """Time in which the autocorrelation, about zero, falls to 1/e."""
    power = float(np.mean(error**2))
    for lag in range(1, len(error) // 2):
        if float(np.mean(error[lag:] * error[:-lag])) < power / math.e:
            return lag * _STEP_S
    return 0.5 * len(error) * _STEP_S
