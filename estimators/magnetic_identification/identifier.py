"""From placed readings of any number of vehicles to identified anomalies, without I/O and without messages.

Readings are averaged over a second. A measurement beyond the threshold starts an anomaly, unless the vehicle
is within reach of a known one, whose particles then take it as one more. A pass ends when the measurements
are small again or the vehicle has left; the particles are kept for the next one.
"""

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.anomaly import Anomaly, Sample
from estimators.magnetic_identification.parameters import IdentificationParameters
from estimators.occupancy.detection import AnomalyDetector, MapError
from estimators.occupancy.placed_readings import PlacedReading
from flightsim.foundation.random_streams import RandomStreams

__all__ = ["Identifier", "Progress"]

Array = NDArray[np.float64]

_ENDS_AFTER_M: Final = 100.0  # of track with small measurements: the end of a pass
_SMALL: Final = 0.5  # of the threshold
_LEAST_STEP_M: Final = 1.0  # shorter displacements give no course


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """What a measurement has changed.

    Attributes:
        sample: the measurement.
        anomaly: the anomaly it belongs to; None: to none.
        pass_ended: an anomaly whose pass has ended with it.
    """

    sample: Sample
    anomaly: Anomaly | None
    pass_ended: Anomaly | None


@dataclass(slots=True, kw_only=True)
class _Vehicle:
    """One vehicle's readings.

    Attributes:
        detector: level of the differences.
        began_us: begin of the interval that is averaged.
        sums: of north, east, height, residual; and the number of readings.
        last: newest measurement.
        anomaly: the anomaly of the pass in progress.
        small_m: length of track since the last measurement that was not small.
    """

    detector: AnomalyDetector
    began_us: int = -1
    sums: list[float] = field(default_factory=lambda: [0.0] * 5)
    last: Sample | None = None
    anomaly: Anomaly | None = None
    small_m: float = 0.0


class Identifier:
    """Identifies anomalies; the same for a mission, an estimator process and a log.

    Attributes:
        anomalies: that are kept, in the order of time.
        started: number of all anomalies so far.
        dropped: number of readings without a place, a number or a map value.
    """

    def __init__(
        self, parameters: IdentificationParameters, *, map_error: MapError, field_ned: Array
    ) -> None:
        """Initialise it.

        Args:
            parameters: classes, noise and filter.
            map_error: error of the published map.
            field_ned: (3,) direction of the Earth's field, for dipoles.
        """
        self.anomalies: list[Anomaly] = []
        self.started = 0
        self._parameters = parameters
        self._classes = parameters.classes
        self._map_error = map_error
        self._field_ned = field_ned
        self._streams = RandomStreams(parameters.seed)
        self._vehicles: dict[int, _Vehicle] = {}
        self._threshold_nt = max(
            parameters.threshold_nt, 3.0 * math.hypot(parameters.noise_nt, map_error.sigma_nt)
        )

    @property
    def dropped(self) -> int:
        return sum(vehicle.detector.dropped for vehicle in self._vehicles.values())

    def in_pass(self, number: int) -> bool:
        """Whether a vehicle is at an anomaly."""
        vehicle = self._vehicles.get(number)
        return vehicle is not None and vehicle.anomaly is not None

    def take(self, number: int, reading: PlacedReading, map_nt: float) -> Progress | None:
        """Process one reading of a vehicle.

        Args:
            number: of the vehicle.
            reading: the reading and its place.
            map_nt: the map's value there; NaN: the map has no data.

        Returns:
            What has changed, when the reading completes a measurement.
        """
        vehicle = self._vehicles.get(number)
        if vehicle is None:
            detector = AnomalyDetector(
                threshold_nt=self._parameters.threshold_nt,
                noise_nt=self._parameters.noise_nt,
                map_error=self._map_error,
            )
            vehicle = self._vehicles[number] = _Vehicle(detector=detector)
        dropped = vehicle.detector.dropped
        vehicle.detector.update(reading.time_us, reading.total_nt, map_nt, reading.north_m, reading.east_m)
        if vehicle.detector.dropped > dropped:
            return None
        interval_us = round(1e6 * self._parameters.interval_s)
        complete = None
        if vehicle.began_us >= 0 and reading.time_us >= vehicle.began_us + interval_us:
            complete = self._complete(number, vehicle)
            vehicle.began_us = -1
        if vehicle.began_us < 0:
            vehicle.began_us = reading.time_us
            vehicle.sums = [0.0] * 5
        values = (reading.north_m, reading.east_m, reading.height_m, vehicle.detector.residual_nt, 1.0)
        for k, value in enumerate(values):
            vehicle.sums[k] += value
        return None if complete is None else self._advance(vehicle, complete)

    def _complete(self, number: int, vehicle: _Vehicle) -> Sample:
        """The mean of the readings of an interval."""
        count = vehicle.sums[4]
        north_m, east_m, height_m, residual_nt = (total / count for total in vehicle.sums[:4])
        last = vehicle.last
        course_rad = 0.0
        if last is not None:
            off_n, off_e = north_m - last.north_m, east_m - last.east_m
            moved = math.hypot(off_n, off_e) >= _LEAST_STEP_M
            course_rad = math.atan2(off_e, off_n) if moved else last.course_rad
        return Sample(
            time_us=vehicle.began_us,
            vehicle=number,
            north_m=north_m,
            east_m=east_m,
            height_m=height_m,
            course_rad=course_rad,
            residual_nt=residual_nt,
            readings=int(count),
        )

    def _advance(self, vehicle: _Vehicle, sample: Sample) -> Progress:
        last, vehicle.last = vehicle.last, sample
        loud = abs(sample.residual_nt) > self._threshold_nt
        near = self._within_reach(sample)
        before = vehicle.anomaly
        if before is not None and near is not before and not loud:
            near = None
        anomaly = near
        if near is not None:
            if vehicle.anomaly is not near and loud:
                if not near.under_way:
                    near.passes += 1
                near.under_way = True
                vehicle.anomaly, vehicle.small_m = near, 0.0
            near.take(sample)
        elif loud and last is not None:
            anomaly = vehicle.anomaly = self._start(sample, last)
            vehicle.small_m = 0.0
        ended = self._ended(vehicle, sample, last, near if near is not None else anomaly)
        return Progress(sample=sample, anomaly=anomaly, pass_ended=ended)

    def _ended(
        self, vehicle: _Vehicle, sample: Sample, last: Sample | None, present: Anomaly | None
    ) -> Anomaly | None:
        """The anomaly whose pass ends with this measurement."""
        passed = vehicle.anomaly
        if passed is None:
            return None
        if abs(sample.residual_nt) > _SMALL * self._threshold_nt:
            vehicle.small_m = 0.0
        elif last is not None:
            vehicle.small_m += math.hypot(sample.north_m - last.north_m, sample.east_m - last.east_m)
        if passed is present and vehicle.small_m < _ENDS_AFTER_M:
            return None
        vehicle.anomaly = None
        passed.under_way = any(other.anomaly is passed for other in self._vehicles.values())
        return passed

    def _within_reach(self, sample: Sample) -> Anomaly | None:
        """The nearest anomaly within reach."""
        reach_m = self._parameters.reach_m
        here = (sample.north_m, sample.east_m)
        found = [(math.dist(here, anomaly.place_ne_m), anomaly.number, anomaly) for anomaly in self.anomalies]
        near = [entry for entry in found if entry[0] <= reach_m]
        return min(near)[2] if near else None

    def _start(self, sample: Sample, last: Sample) -> Anomaly:
        if len(self.anomalies) >= self._parameters.most_anomalies:
            idle = [anomaly for anomaly in self.anomalies if not anomaly.under_way] or self.anomalies
            self.anomalies.remove(min(idle, key=lambda anomaly: anomaly.probability))
        seed = self._streams.child("anomaly", self.started)
        anomaly = Anomaly(
            self.started,
            sample,
            self._parameters,
            self._classes,
            self._map_error,
            threshold_nt=self._threshold_nt,
            field_ned=self._field_ned,
            # as fast as PCG64 is, and faster for normal numbers, most of the cost of a step
            rng=np.random.Generator(np.random.SFC64(seed)),
            last=last,
        )
        self.started += 1
        self.anomalies.append(anomaly)
        return anomaly
