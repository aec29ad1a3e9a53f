"""Compares the readings of a vehicle's survey magnetometer with the map, and reports anomalies."""

from collections.abc import Callable
from typing import Final

from autopilot_bridge.mavlink import Frame, field_reader
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import place
from estimators.occupancy.detection import Anomaly, AnomalyDetector
from estimators.occupancy.placed_readings import PlacedReading, ReadingCheck, ReadingPlacer
from estimators.occupancy.survey_map import SurveyMap
from missions.vehicle.vehicle import Vehicle

_read_position: Final = field_reader("GLOBAL_POSITION_INT", "time_boot_ms", "lat", "lon", "alt")

SampleListener = Callable[[PlacedReading, float, bool], None]
"""Called with each placed reading, the map's value there, and whether it belongs to an anomaly."""


class FieldWatch:
    """Passes one vehicle's magnetometer readings and positions to the detector, and reports its anomalies.

    Attributes:
        detector: threshold on the reading minus the map.
        placer: gives each reading a position.
        check: recognizes a magnetometer out of order, whose readings are not used.
        samples: number of readings compared with the map.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        survey_map: SurveyMap,
        detector: AnomalyDetector,
        *,
        on_sample: SampleListener,
        on_anomaly: Callable[[Anomaly], None],
    ) -> None:
        """Store the arguments; no message is processed before `start`."""
        self.detector = detector
        self.placer = ReadingPlacer(survey_map.frame())
        self.check = ReadingCheck()
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
            vehicle.payload.on_total_field(self._on_reading),
            vehicle.link.connection.listen("GLOBAL_POSITION_INT", self._on_position, in_order=False),
        ]

    def stop(self) -> None:
        """Stop processing messages."""
        for stop in self._stops:
            stop()
        self._stops = []

    def _on_reading(self, time_us: int, total_nt: float) -> None:
        if self.check.accepts(total_nt):
            self.placer.add_reading(time_us, total_nt)

    def _on_position(self, frame: Frame) -> None:
        if frame.system_id != self._vehicle.system_id or frame.component_id != AUTOPILOT_COMPONENT:
            return
        time_ms, *here = _read_position(frame)
        at = place(*here)
        if at is None:
            return
        for reading in self.placer.add_position(time_ms * 1000, at.lat_deg, at.lon_deg, at.alt_m):
            map_nt = self._map.total_nt(reading.north_m, reading.east_m, reading.height_m)
            anomaly = self.detector.update(
                reading.time_us, reading.total_nt, map_nt, reading.north_m, reading.east_m
            )
            self.samples += 1
            self._on_sample(reading, map_nt, self.detector.anomalous)
            if anomaly is not None:
                self._on_anomaly(anomaly)
