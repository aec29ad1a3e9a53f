"""The common clock of all times of a log: the time since boot of its first vehicle.

Messages of other systems get the vehicle's newest time at their place in the file, so that equal times mean
the same moment. In a log without a vehicle that reports its time, the record times are used.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators.logs.source import LogSource

_FIRST_GROUND_SYSTEM = 200


@dataclass(frozen=True, slots=True, eq=False)
class LogClock:
    """Times of all messages of a log.

    Attributes:
        system_id: the system whose time since boot is used; None: time since the first record.
        time_us: (count,) time of each message, by its position.
        boot: (count,) number of that system's boot, from 0.
    """

    system_id: int | None
    time_us: NDArray[np.int64]
    boot: NDArray[np.int64]

    @property
    def text(self) -> str:
        """The origin of the clock, as text."""
        if self.system_id is None:
            return "seconds since the first record"
        return f"seconds since boot of vehicle {self.system_id}"


def make_clock(source: LogSource) -> LogClock:
    """The clock of a log, from the lowest system id whose autopilot reports its time."""
    times = source.time_us
    system_id = min(
        (
            stream.system_id
            for stream in source.streams
            if stream.component_id == AUTOPILOT_COMPONENT
            and stream.system_id < _FIRST_GROUND_SYSTEM
            and times[stream.order[-1]] > times[stream.order[0]]
        ),
        default=None,
    )
    if system_id is None:
        recorded = source.log_time_us(np.arange(source.count))
        clock = recorded - recorded[0] if recorded[0] != recorded[-1] else np.maximum.accumulate(times)
        return LogClock(None, clock, np.zeros(source.count, dtype=np.int64))
    own = np.zeros(source.count, dtype=np.int64)
    is_own = np.zeros(source.count, dtype=np.bool_)
    for stream in source.streams:
        if stream.system_id == system_id:
            own[stream.order] = times[stream.order]
            is_own[stream.order] = True
    starts = source.boot_starts.get(system_id, np.empty(0, dtype=np.int64))
    boot = np.searchsorted(starts, np.arange(source.count), side="right").astype(np.int64)
    newest = np.empty_like(own)
    edges = [0, *starts.tolist(), source.count]
    for begin, end in pairwise(edges):
        newest[begin:end] = np.maximum.accumulate(own[begin:end])
    return LogClock(system_id, np.where(is_own, own, newest), boot)
