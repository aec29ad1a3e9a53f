"""TIMESYNC, PING and time stamps: the autopilot's side of time synchronisation and round-trip measurements.

Sources: MAVLink time synchronisation protocol (tc1 = 0 is a request; the answer carries the own clock in tc1
and the requester's ts1, both in nanoseconds) and ping protocol (target 0/0 is a request; the answer is
addressed to its sender).
"""

from typing import Final

from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.microservice import Microservice

_NS_PER_US: Final = 1000
_INT64_MAX: Final = 2**63 - 1

_OLDEST_US: Final = 500_000
_NEWEST_US: Final = 20_000


def in_vehicle_time(stamp_us: int, time_us: int) -> int:
    """The time of a measurement, microseconds of vehicle time.

    Args:
        stamp_us: time stamp in the message.
        time_us: time of arrival, returned for a stamp of another clock (TIMESYNC provides the vehicle's
            clock).
    """
    return stamp_us if -_NEWEST_US <= time_us - stamp_us <= _OLDEST_US else time_us


class TimeSyncService(Microservice):
    """Answers TIMESYNC and PING requests. The autopilot's own TIMESYNC requests are a stream.

    Args:
        answers_ping: PX4 answers PING, ArduPilot does not.
    """

    def __init__(self, *, answers_ping: bool) -> None:
        self._answers_ping = answers_ping

    @receives(dialect.MAVLink_timesync_message)
    def _on_timesync(self, message: dialect.MAVLink_timesync_message, source: Source, time_us: int) -> None:
        if message.tc1 == 0:
            now_ns = min(time_us * _NS_PER_US, _INT64_MAX)
            source.channel.send(dialect.MAVLink_timesync_message(now_ns, message.ts1))

    @receives(dialect.MAVLink_ping_message)
    def _on_ping(self, message: dialect.MAVLink_ping_message, source: Source, time_us: int) -> None:
        if self._answers_ping and message.target_system == 0 and message.target_component == 0:
            source.channel.send(
                dialect.MAVLink_ping_message(
                    message.time_usec, message.seq, source.system_id, source.component_id
                )
            )
