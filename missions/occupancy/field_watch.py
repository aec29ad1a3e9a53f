"""Assigns places to the readings of a survey magnetometer, and compares the readings with the map.

Positions and readings come in messages of different components at different times. Both carry vehicle time,
and the place of a reading is interpolated between the two positions around it.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from autopilot_bridge.mavlink import decode
from estimators.occupancy.detection import Anomaly, AnomalyDetector
from flightsim.foundation.geodesy import LocalFrame
from missions.occupancy.survey_map import SurveyMap
from missions.vehicle.connection import AUTOPILOT_COMPONENT
from missions.vehicle.telemetry import Position, position

if TYPE_CHECKING:
    from missions.vehicle.vehicle import Vehicle

_WAITING: Final = 100  # largest number of waiting readings: ten seconds of an ordinary magnetometer
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

    def add_position(self, place: Position) -> list[PlacedReading]:
        """Add a position; returns the readings up to its time, with their places."""
        north_m, east_m, down_m = self._frame.ned_from_geodetic(place.lat_deg, place.lon_deg, place.alt_m)
        last, new = self._last, (place.time_us, north_m, east_m, -down_m)
        if last is not None and place.time_us <= last[0]:
            return []
        self._last = new
        placed = []
        while self._waiting and self._waiting[0][0] <= place.time_us:
            time_us, total_nt = self._waiting.popleft()
            if last is None or time_us < last[0] or new[0] - last[0] > _GAP_US:
                self.dropped += 1
                continue
            share = (time_us - last[0]) / (new[0] - last[0])
            north, east, height = (a + share * (b - a) for a, b in zip(last[1:], new[1:], strict=True))
            placed.append(
                PlacedReading(time_us=time_us, north_m=north, east_m=east, height_m=height, total_nt=total_nt)
            )
        return placed


SampleListener = Callable[[PlacedReading, bool], None]
"""Called with each placed reading, and whether it belongs to an anomaly."""


class FieldWatch:
    """Passes one vehicle's magnetometer readings and positions to the detector, and reports its anomalies.

    Attributes:
        detector: threshold on the reading minus the map.
        placer: gives each reading a position.
        samples: number of readings compared with the map.
    """

    def __init__(
        self,
        vehicle: "Vehicle",
        survey_map: SurveyMap,
        detector: AnomalyDetector,
        *,
        on_sample: SampleListener,
        on_anomaly: Callable[[Anomaly], None],
    ) -> None:
        """Store the arguments; no message is processed before `start`."""
        self.detector = detector
        self.placer = ReadingPlacer(survey_map.frame())
        self.samples = 0
        self._vehicle = vehicle
        self._map = survey_map
        self._on_sample = on_sample
        self._on_anomaly = on_anomaly
        self._stops: list[Callable[[], None]] = []

    def start(self) -> None:
        """Start to process messages."""
        vehicle = self._vehicle
        self._stops = [
            vehicle.payload.on_total_field(self.placer.add_reading),
            vehicle.link.connection.listen("GLOBAL_POSITION_INT", self._on_position),
        ]

    def stop(self) -> None:
        """Stop processing messages."""
        for stop in self._stops:
            stop()
        self._stops = []

    def _on_position(self, frame: Any) -> None:
        if frame.system_id != self._vehicle.system_id or frame.component_id != AUTOPILOT_COMPONENT:
            return
        for reading in self.placer.add_position(position(decode(frame))):
            map_nt = self._map.total_nt(reading.north_m, reading.east_m, reading.height_m)
            anomaly = self.detector.update(
                reading.time_us, reading.total_nt, map_nt, reading.north_m, reading.east_m
            )
            self.samples += 1
            self._on_sample(reading, self.detector.anomalous)
            if anomaly is not None:
                self._on_anomaly(anomaly)
