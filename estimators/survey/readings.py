"""The readings of a survey flight with place and attitude, as columns."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.received import not_in_gaps
from estimators.survey_magnetometer import STRONGEST_NT, STUCK_READINGS
from flightsim.foundation.geodesy import LocalFrame

__all__ = ["SurveyReadings", "joined", "placed_readings"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurveyReadings:
    """Readings in the order of time; all arrays (n,).

    Attributes:
        time_s: vehicle time.
        north_m, east_m, height_m: place, from the origin of the survey's frame.
        roll_rad, pitch_rad, yaw_rad: attitude; NaN if none was given.
        total_nt: total field.
        unplaced: readings that were left out, because no position, or no attitude, is near them in time.
        implausible: readings that were left out, because the magnetometer was stuck or saturated.
    """

    time_s: Array
    north_m: Array
    east_m: Array
    height_m: Array
    roll_rad: Array
    pitch_rad: Array
    yaw_rad: Array
    total_nt: Array
    unplaced: int = 0
    implausible: int = 0

    def __len__(self) -> int:
        return len(self.time_s)


_COLUMNS: Final = ("time_s", "north_m", "east_m", "height_m", "roll_rad", "pitch_rad", "yaw_rad", "total_nt")


def joined(parts: Sequence[SurveyReadings]) -> SurveyReadings:
    """The readings of parts of a flight, which follow each other in time."""
    return SurveyReadings(
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in _COLUMNS},
        unplaced=sum(part.unplaced for part in parts),
        implausible=sum(part.implausible for part in parts),
    )


def placed_readings(
    time_s: Array, total_nt: Array, *, positions: Array, attitudes: Array | None, frame: LocalFrame
) -> SurveyReadings:
    """Give readings the place and the attitude at their times, linearly between two messages.

    Args:
        time_s, total_nt: (n,) readings, in any order of time.
        positions: (m, 4) time s, latitude deg, longitude deg, altitude m above mean sea level.
        attitudes: (k, 4) time s, roll, pitch, yaw, rad; None: the attitude is not needed.
        frame: local frame of the survey.
    """
    order = _increasing(time_s)
    times, values = time_s[order], total_nt[order]
    sound = plausible(values)
    implausible = len(values) - int(sound.sum())
    times, values = times[sound], values[sound]
    positions = positions[_increasing(positions[:, 0])]
    kept = not_in_gaps(times, positions[:, 0])
    if attitudes is not None:
        attitudes = attitudes[_increasing(attitudes[:, 0])]
        kept &= not_in_gaps(times, attitudes[:, 0])
    unplaced = len(times) - int(kept.sum())
    times, values = times[kept], values[kept]
    if not len(times):
        nothing = np.zeros(0)
        return SurveyReadings(**dict.fromkeys(_COLUMNS, nothing), unplaced=unplaced, implausible=implausible)
    north_m, east_m, down_m = frame.ned_from_geodetic(*positions[:, 1:4].T)
    roll, pitch, yaw = (
        np.full(len(times), np.nan)
        if attitudes is None
        else np.interp(times, attitudes[:, 0], np.unwrap(attitudes[:, column]))
        for column in (1, 2, 3)
    )
    return SurveyReadings(
        time_s=times,
        north_m=np.interp(times, positions[:, 0], north_m),
        east_m=np.interp(times, positions[:, 0], east_m),
        height_m=-np.interp(times, positions[:, 0], down_m),
        roll_rad=roll,
        pitch_rad=pitch,
        yaw_rad=yaw,
        total_nt=values,
        unplaced=unplaced,
        implausible=implausible,
    )


def plausible(total_nt: Array) -> NDArray[np.bool_]:
    """Whether readings (n,) may be the Earth's field: finite, not saturated, and the sensor not stuck."""
    sound: NDArray[np.bool_] = np.isfinite(total_nt) & (total_nt > 0.0) & (total_nt < STRONGEST_NT)
    if len(total_nt) > 1:
        ends = np.concatenate((np.nonzero(np.diff(total_nt) != 0.0)[0] + 1, [len(total_nt)]))
        starts = np.concatenate(([0], ends[:-1]))
        for start, end in zip(starts, ends, strict=True):
            if end - start > STUCK_READINGS:
                sound[start + STUCK_READINGS : end] = False
    return sound


def _increasing(times: Array) -> NDArray[np.int64]:
    """Order of strictly increasing times; of equal ones the first."""
    if not len(times):
        return np.zeros(0, dtype=np.int64)
    order = np.argsort(times, kind="stable")
    newer = np.concatenate(([True], np.diff(times[order]) > 0.0))
    found: NDArray[np.int64] = order[newer]
    return found
