"""From placed readings of any number of vehicles to identified anomalies, without I/O and without messages.

Readings are averaged over a second. A measurement beyond the threshold starts an anomaly, unless the vehicle
is within reach of a known one, whose particles then take it as one more. A pass ends when the measurements
are small again or the vehicle has left; the particles are kept for the next one.

A pass near a known anomaly may be over another source, or the known one may have been an error of the map. A
rival anomaly therefore begins with each such pass and takes its measurements too; likewise where a pass goes
on after some track on which nothing was. At the end of the pass, the one that predicted them better keeps
them (Bayes factor); if that is the rival, the known one is as it was.
"""

import copy
import math
from collections import deque
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.magnetic_identification.anomaly import Anomaly
from estimators.magnetic_identification.noise_level import NoiseLevel
from estimators.magnetic_identification.parameters import IdentificationParameters
from estimators.magnetic_identification.samples import Sample
from estimators.occupancy.detection import AnomalyDetector, MapError
from estimators.occupancy.placed_readings import PlacedReading
from flightsim.foundation.random_streams import RandomStreams

__all__ = ["Identifier", "Progress"]

Array = NDArray[np.float64]

_ENDS_AFTER_M: Final = 100.0  # of track with small measurements: the end of a pass
_SMALL: Final = 0.5  # of the threshold
_SIGMAS: Final = 3.0
_APART_M: Final = 50.0  # of track with small measurements within a pass: what follows may be another source
_LEAST_STEP_M: Final = 1.0  # shorter displacements give no course
_APPROACH: Final = 8  # measurements before an anomaly: a source shows long before the threshold
_LONGEST_STEP_M: Final = 50.0  # between them
_ADJOINING: Final = 0.4  # of the reach: two sources so near to each other are rather parts of one
_ANOTHER_NATS: Final = 6.0  # by which a rival must be better: other sources within reach are seldom


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """What a measurement has changed.

    Attributes:
        sample: the measurement.
        anomaly: the anomaly it belongs to; None: to none.
        pass_ended: an anomaly whose pass has ended with it.
        loudest: the largest measurement of that pass, or of the one in progress.
        doubted: at present, another source explains the pass in progress better, or the level is doubtful.
    """

    sample: Sample
    anomaly: Anomaly | None
    pass_ended: Anomaly | None = None
    loudest: Sample | None = None
    doubted: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rival:
    """The alternative while a known anomaly is passed: the measurements are about another source.

    Attributes:
        anomaly: of that source, begun with the pass.
        kept: copy of the known one before the pass.
    """

    anomaly: Anomaly
    kept: Anomaly

    def wins(self, known: Anomaly) -> bool:
        """Whether it predicted the measurements of the pass better than the known anomaly."""
        predicted = known.log_density - self.kept.log_density
        return self.anomaly.log_density > predicted + _ANOTHER_NATS


@dataclass(slots=True, kw_only=True)
class _Vehicle:
    """One vehicle's readings.

    Attributes:
        detector: level of the differences.
        noise: noise of the measurements.
        threshold_nt: beyond which the newest measurement is an anomaly.
        began_us: begin of the interval that is averaged.
        sums: of north, east, height, residual; and the number of readings.
        last: newest measurement.
        anomaly: the anomaly of the pass in progress.
        rival: alternative to it, if it was known before the pass.
        loudest: largest measurement of the pass in progress.
        small_m: length of track since the last measurement that was not small.
        approach: the newest measurements, as far as they are on quiet track.
        doubtful: anomalies that began while the level was doubtful.
    """

    detector: AnomalyDetector
    noise: NoiseLevel
    threshold_nt: float
    began_us: int = -1
    sums: list[float] = field(default_factory=lambda: [0.0] * 5)
    last: Sample | None = None
    anomaly: Anomaly | None = None
    rival: _Rival | None = None
    loudest: Sample | None = None
    small_m: float = 0.0
    approach: deque[Sample] = field(default_factory=lambda: deque(maxlen=_APPROACH))
    doubtful: list[Anomaly] = field(default_factory=list)

    def note(self, sample: Sample, last: Sample | None, *, small_nt: float) -> Sample:
        """Follow the pass in progress; returns its largest measurement."""
        size_nt = abs(sample.residual_nt)
        if size_nt > small_nt:
            self.small_m = 0.0
        elif last is not None:
            self.small_m += _apart_m(last, sample)
        if self.loudest is None or size_nt > abs(self.loudest.residual_nt):
            self.loudest = sample
        return self.loudest

    def end_pass(self) -> None:
        """Forget the pass in progress."""
        self.anomaly = self.rival = self.loudest = None
        self.small_m = 0.0


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
        self._reach_m = parameters.reach_m
        self._map_error = map_error
        self._field_ned = field_ned
        self._streams = RandomStreams(parameters.seed)
        self._rivals = 0
        self._vehicles: dict[int, _Vehicle] = {}

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
            vehicle = self._vehicles[number] = _Vehicle(
                detector=detector, noise=NoiseLevel(self._map_error), threshold_nt=self._threshold_nt(0.0)
            )
        dropped, restarts = vehicle.detector.dropped, vehicle.detector.restarts
        vehicle.detector.update(reading.time_us, reading.total_nt, map_nt, reading.north_m, reading.east_m)
        if vehicle.detector.dropped > dropped:
            return None
        if vehicle.detector.restarts > restarts:
            self._discard_doubtful(vehicle)
        elif not vehicle.detector.level_doubtful:
            vehicle.doubtful.clear()
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

    def _threshold_nt(self, excess_nt2: float) -> float:
        """Beyond which a measurement is an anomaly: three standard deviations of map and noise, or more."""
        variance_nt2 = self._parameters.noise_nt**2 + self._map_error.sigma_nt**2 + excess_nt2
        return max(self._parameters.threshold_nt, _SIGMAS * math.sqrt(variance_nt2))

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
        turn_rad = 0.0 if last is None else math.remainder(course_rad - last.course_rad, math.tau)
        return Sample(
            time_us=vehicle.began_us,
            vehicle=number,
            north_m=north_m,
            east_m=east_m,
            height_m=height_m,
            course_rad=course_rad,
            residual_nt=residual_nt,
            readings=int(count),
            excess_nt2=vehicle.noise.excess_nt2(turn_rad),
        )

    def _advance(self, vehicle: _Vehicle, sample: Sample) -> Progress:
        last, vehicle.last = vehicle.last, sample
        vehicle.threshold_nt = self._threshold_nt(sample.excess_nt2)
        loud = abs(sample.residual_nt) > vehicle.threshold_nt
        if last is not None and _apart_m(last, sample) > _LONGEST_STEP_M:
            vehicle.approach.clear()
        present, passed = self._within_reach(sample), vehicle.anomaly
        ended: Anomaly | None = None
        loudest, doubted = vehicle.loudest, vehicle.detector.level_doubtful
        if passed is not None and present is not passed:
            ended = self._end_pass(vehicle)
            # a quiet measurement beside the anomaly of the pass is about neither
            present = self._within_reach(sample) if loud else None
            if loud and vehicle.detector.level_doubtful:
                ended = None  # it may be an offset of all measurements
        if present is not None:
            self._take(vehicle, present, sample, last if loud else None)
        elif loud and last is not None:
            present = vehicle.anomaly = self._start(sample, vehicle)
            if vehicle.detector.level_doubtful:
                vehicle.doubtful.append(present)
        elif last is not None:
            vehicle.noise.take(
                sample.residual_nt,
                self._parameters.noise_nt**2 / sample.readings,
                _apart_m(last, sample),
                math.remainder(sample.course_rad - last.course_rad, math.tau),
            )
        goes_on = loud and last is not None and abs(last.residual_nt) > vehicle.threshold_nt
        if goes_on and passed is not None and present is not None and present is not passed:
            passed.adjoin()
            present.adjoin()
        if vehicle.anomaly is not None:
            largest = vehicle.note(sample, last, small_nt=_SMALL * vehicle.threshold_nt)
            doubted = doubted or (vehicle.rival is not None and vehicle.rival.wins(vehicle.anomaly))
            loudest = loudest if ended is not None else largest
            if vehicle.small_m >= _ENDS_AFTER_M:
                ended = self._end_pass(vehicle)
        if loud:
            vehicle.approach.clear()
        else:
            vehicle.approach.append(sample)
        return Progress(sample=sample, anomaly=present, pass_ended=ended, loudest=loudest, doubted=doubted)

    def _take(self, vehicle: _Vehicle, known: Anomaly, sample: Sample, last: Sample | None) -> None:
        """One more measurement of a known anomaly.

        Args:
            vehicle: its vehicle.
            known: the anomaly.
            sample: the measurement.
            last: the one before, if this one is beyond the threshold: a pass begins unless one is in
                progress.
        """
        if vehicle.rival is not None:
            vehicle.rival.anomaly.take(sample)
        if vehicle.anomaly is None and last is not None:
            vehicle.anomaly = known
            if not known.under_way:
                self._begin_rival(vehicle, known, sample)
                known.passes += 1
            known.under_way = True
        elif vehicle.rival is None and last is not None and vehicle.small_m >= _APART_M:
            self._begin_rival(vehicle, known, sample)
        for other in self._vehicles.values():
            if other is not vehicle and other.anomaly is known:
                other.rival = None  # without the other measurements its known anomaly can't be judged
        known.take(sample)

    def _begin_rival(self, vehicle: _Vehicle, known: Anomaly, sample: Sample) -> None:
        """Begin the alternative to a known anomaly with a measurement beyond the threshold."""
        rival = self._new(sample, vehicle, "rival", self._rivals)
        vehicle.rival = _Rival(anomaly=rival, kept=copy.deepcopy(known))
        self._rivals += 1

    def _discard_doubtful(self, vehicle: _Vehicle) -> None:
        """The level was wrong from its start: the anomalies since then are none."""
        if vehicle.anomaly is not None and vehicle.anomaly in vehicle.doubtful:
            vehicle.end_pass()
        self.anomalies = [anomaly for anomaly in self.anomalies if anomaly not in vehicle.doubtful]
        vehicle.doubtful.clear()
        vehicle.began_us, vehicle.last = -1, None  # measurements with that level
        vehicle.approach.clear()

    def _end_pass(self, vehicle: _Vehicle) -> Anomaly:
        """The anomaly whose pass of a vehicle ends: the known one, or its rival."""
        passed, rival = vehicle.anomaly, vehicle.rival
        assert passed is not None
        vehicle.end_pass()
        passed.under_way = any(other.anomaly is passed for other in self._vehicles.values())
        if rival is None or passed.under_way or not rival.wins(passed):
            return passed
        passed.restore(rival.kept)
        another = rival.anomaly
        another.number, another.under_way = self.started, False
        if math.dist(another.place_ne_m, passed.place_ne_m) < _ADJOINING * self._reach_m:
            passed.adjoin()
            another.adjoin()
        self._add(another)
        return another

    def _within_reach(self, sample: Sample) -> Anomaly | None:
        """The nearest anomaly within reach."""
        here = (sample.north_m, sample.east_m)
        found = [(math.dist(here, anomaly.place_ne_m), anomaly.number, anomaly) for anomaly in self.anomalies]
        near = [entry for entry in found if entry[0] <= self._reach_m]
        return min(near)[2] if near else None

    def _start(self, sample: Sample, vehicle: _Vehicle) -> Anomaly:
        anomaly = self._new(sample, vehicle, "anomaly", self.started)
        self._add(anomaly)
        return anomaly

    def _add(self, anomaly: Anomaly) -> None:
        """Keep an anomaly, instead of the least probable target if there are too many."""
        if len(self.anomalies) >= self._parameters.most_anomalies:
            idle = [anomaly for anomaly in self.anomalies if not anomaly.under_way] or self.anomalies
            self.anomalies.remove(min(idle, key=lambda anomaly: anomaly.probability))
        self.started += 1
        self.anomalies.append(anomaly)

    def _new(self, sample: Sample, vehicle: _Vehicle, stream: str, index: int) -> Anomaly:
        return Anomaly(
            self.started,
            sample,
            self._parameters,
            self._classes,
            self._map_error,
            threshold_nt=vehicle.threshold_nt,
            field_ned=self._field_ned,
            # as fast as PCG64 is, and faster for normal numbers
            rng=np.random.Generator(np.random.SFC64(self._streams.child(stream, index))),
            approach=tuple(vehicle.approach),
        )


def _apart_m(one: Sample, other: Sample) -> float:
    """Distance between two measurements."""
    return math.hypot(other.north_m - one.north_m, other.east_m - one.east_m)
