"""Assigns places to the readings of a survey magnetometer.

Positions and readings come in messages of different components at different times. Both carry vehicle time,
and the place of a reading is interpolated between the two positions around it. A reading may arrive after
later positions: on a vehicle it comes from another computer, and positions may come 50 times a second.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

from estimators.received import GAP_US
from estimators.survey_magnetometer import STRONGEST_NT, STUCK_READINGS
from flightsim.foundation.geodesy import LocalFrame

_WAITING: Final = 100  # largest number of waiting readings: ten seconds of an ordinary magnetometer
_KEPT_US: Final = 2_000_000  # positions are kept so long, for readings that arrive late

_Position = tuple[int, float, float, float]  # vehicle time in us; north, east, height in m


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
        if 0.0 < total_nt < STRONGEST_NT and self._repeats < STUCK_READINGS:
            return True
        self.implausible += 1
        return False


class ReadingPlacer:
    """Assigns places to readings; no I/O.

    Attributes:
        dropped: number of readings without a position before and after them, or that arrived more than 2 s
            late.
    """

    def __init__(self, frame: LocalFrame) -> None:
        """Initialise the placer.

        Args:
            frame: local frame of the map.
        """
        self.dropped = 0
        self._frame = frame
        self._waiting: deque[tuple[int, float]] = deque()
        self._positions: deque[_Position] = deque()

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
        positions = self._positions
        if positions and time_us <= positions[-1][0]:
            return []
        north_m, east_m, down_m = self._frame.ned_from_geodetic(lat_deg, lon_deg, alt_m)
        positions.append((time_us, north_m, east_m, -down_m))
        while len(positions) > 2 and positions[1][0] <= time_us - _KEPT_US:
            positions.popleft()
        placed = []
        while self._waiting and self._waiting[0][0] <= time_us:
            taken_us, total_nt = self._waiting.popleft()
            around = self._around(taken_us)
            if around is None:
                self.dropped += 1
                continue
            last, new = around
            share = (taken_us - last[0]) / (new[0] - last[0])
            north, east, height = (a + share * (b - a) for a, b in zip(last[1:], new[1:], strict=True))
            placed.append(
                PlacedReading(
                    time_us=taken_us, north_m=north, east_m=east, height_m=height, total_nt=total_nt
                )
            )
        return placed

    def _around(self, taken_us: int) -> tuple[_Position, _Position] | None:
        """The positions before and after a time, which is not later than the newest one; None: there are
        none, or they are too far apart.
        """
        new = None
        for position in reversed(self._positions):
            if new is not None and position[0] <= taken_us:
                return None if new[0] - position[0] > GAP_US else (position, new)
            new = position
        return None
