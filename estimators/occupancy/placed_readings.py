"""Assigns places to the readings of a survey magnetometer.

Positions and readings come in messages of different components at different times. Both carry vehicle time,
and the place of a reading is interpolated between the two positions around it.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

from flightsim.foundation.geodesy import LocalFrame

_WAITING: Final = 100  # largest number of waiting readings: ten seconds of an ordinary magnetometer
_STRONGEST_NT: Final = 200_000.0  # three times the Earth's field at its poles
_STUCK_READINGS: Final = 30  # equal ones in a row: noise makes no two of ten a second equal for so long
_GAP_US: Final = 2_000_000  # longest time between two positions; longer gaps are not interpolated


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedReading:
    """A reading with its place in the map's frame.

    Attributes:
        time_us: vehicle time.
        north_m, east_m, height_m: place from the map's home.
        total_nt: total field.
    """

    time_us: int
    north_m: float
    east_m: float
    height_m: float
    total_nt: float


class ReadingCheck:
    """Recognizes a magnetometer out of order: stuck at one value, or saturated.

    Attributes:
        implausible: number of rejected readings.
    """

    def __init__(self) -> None:
        self.implausible = 0
        self._last_nt = 0.0
        self._repeats = 0

    def accepts(self, total_nt: float) -> bool:
        """Whether a reading may be the Earth's field; it is counted if not."""
        self._repeats = self._repeats + 1 if total_nt == self._last_nt else 0
        self._last_nt = total_nt
        if 0.0 < total_nt < _STRONGEST_NT and self._repeats < _STUCK_READINGS:
            return True
        self.implausible += 1
        return False


class ReadingPlacer:
    """Assigns places to readings; no I/O.

    Attributes:
        dropped: number of readings without a position.
    """

    def __init__(self, frame: LocalFrame) -> None:
        """Initialise the placer.

        Args:
            frame: local frame of the map.
        """
        self.dropped = 0
        self._frame = frame
        self._waiting: deque[tuple[int, float]] = deque()
        self._last: tuple[int, float, float, float] | None = None

    def add_reading(self, time_us: int, total_nt: float) -> None:
        """Add a reading; it waits for the next position."""
        if len(self._waiting) >= _WAITING:
            self._waiting.popleft()
            self.dropped += 1
        self._waiting.append((time_us, total_nt))

    def add_position(self, time_us: int, lat_deg: float, lon_deg: float, alt_m: float) -> list[PlacedReading]:
        """Add a position; returns the readings up to its time, with their places.

        Args:
            time_us: vehicle time of the position.
            lat_deg, lon_deg, alt_m: WGS84, above mean sea level.
        """
        north_m, east_m, down_m = self._frame.ned_from_geodetic(lat_deg, lon_deg, alt_m)
        last, new = self._last, (time_us, north_m, east_m, -down_m)
        if last is not None and time_us <= last[0]:
            return []
        self._last = new
        placed = []
        while self._waiting and self._waiting[0][0] <= time_us:
            taken_us, total_nt = self._waiting.popleft()
            if last is None or taken_us < last[0] or new[0] - last[0] > _GAP_US:
                self.dropped += 1
                continue
            share = (taken_us - last[0]) / (new[0] - last[0])
            north, east, height = (a + share * (b - a) for a, b in zip(last[1:], new[1:], strict=True))
            placed.append(
                PlacedReading(
                    time_us=taken_us, north_m=north, east_m=east, height_m=height, total_nt=total_nt
                )
            )
        return placed
