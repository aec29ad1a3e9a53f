"""Assembly of scans from their messages, which may be lost, repeated or out of order."""

from collections import Counter
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.target_scan import ScanEnd, TargetDetection
from estimators.interface import Outcome

__all__ = ["Scan", "ScanAssembler"]

Array = NDArray[np.float64]

_OPEN_SCANS: Final = 4  # scans that are incomplete at the same time


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scan:
    """A complete scan.

    Attributes:
        number: as the sensor counts.
        time_us: vehicle time.
        detections: (m, 2) range and bearing from the nose, in the order of their numbers.
    """

    number: int
    time_us: int
    detections: Array


@dataclass(slots=True)
class _Open:
    number: int
    places: dict[int, tuple[float, float]] = field(default_factory=dict)
    announced: int | None = None


class ScanAssembler:
    """The scans of one sensor.

    A scan is complete when its end and all of its detections were received. One that is still incomplete when
    a later one is complete is dropped: which detections it lacks is not known, and a missing detection would
    count as a target that was not detected.

    Attributes:
        counts: scans "complete" and "incomplete"; scans "missed", by their numbers; detections "repeated";
            messages "late" (of a scan that is complete or was dropped).
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._open: dict[int, _Open] = {}  # by time
        self._last_us = -1
        self._last_number: int | None = None

    def add(self, message: TargetDetection | ScanEnd) -> tuple[Scan | None, Outcome]:
        """Add one message; returns the scan that it completes, and the outcome for the message."""
        if message.time_us <= self._last_us:
            self.counts["late"] += 1
            return None, Outcome.LATE
        scan = self._open.get(message.time_us)
        if scan is None:
            scan = self._open[message.time_us] = _Open(message.scan)
            if len(self._open) > _OPEN_SCANS:
                del self._open[min(self._open)]
                self.counts["incomplete"] += 1
        if isinstance(message, ScanEnd):
            if scan.announced is not None:
                self.counts["repeated"] += 1
                return None, Outcome.REPEATED
            scan.announced = message.detections
        elif message.number in scan.places:
            self.counts["repeated"] += 1
            return None, Outcome.REPEATED
        else:
            scan.places[message.number] = (message.range_m, message.bearing_rad)
        if scan.announced is None or len(scan.places) < scan.announced:
            return None, Outcome.USED
        return self._complete(message.time_us, scan), Outcome.UPDATED

    def _complete(self, time_us: int, scan: _Open) -> Scan:
        older = [start_us for start_us in self._open if start_us < time_us]
        self.counts["incomplete"] += len(older)
        for start_us in (*older, time_us):
            del self._open[start_us]
        if self._last_number is not None and scan.number > self._last_number:
            self.counts["missed"] += max(0, scan.number - self._last_number - 1 - len(older))
        self._last_us, self._last_number = time_us, scan.number
        self.counts["complete"] += 1
        places = [scan.places[number] for number in sorted(scan.places)]
        return Scan(
            number=scan.number, time_us=time_us, detections=np.array(places, dtype=np.float64).reshape(-1, 2)
        )
