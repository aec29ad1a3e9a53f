"""TIMESYNC and PING: the autopilot's side of time synchronisation and of round-trip measurements.

Sources: MAVLink time synchronisation protocol (tc1 = 0 asks; the answer carries the own clock in tc1 and the
asker's ts1, both in nanoseconds) and ping protocol (target 0/0 asks; the answer is addressed to the asker).
"""

from typing import Final

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.services.channel import Broadcast, MavlinkMessage, Source, send_to_all

_NS_PER_US: Final = 1000
_INT64_MAX: Final = 2**63 - 1


class TimeSyncService:
    """Answers TIMESYNC and PING requests.

    Args:
        broadcast: all channels of the autopilot.
        answers_ping: PX4 does, ArduPilot does not.
        request_interval_us: broadcast an own TIMESYNC request this often (ArduPilot: 10 s); None: never (PX4
            sends its own through the streams, see `request_message`).
    """

    def __init__(
        self, broadcast: Broadcast, *, answers_ping: bool, request_interval_us: int | None = None
    ) -> None:
        if request_interval_us is not None and request_interval_us <= 0:
            raise ValueError(f"request_interval_us {request_interval_us} is not positive")
        self._broadcast = broadcast
        self._answers_ping = answers_ping
        self._interval_us = request_interval_us
        self._next_request_us = request_interval_us or 0

    @staticmethod
    def request_message(time_us: int) -> MavlinkMessage:
        """An own TIMESYNC request: tc1 0, ts1 the time since boot in ns."""
        return mavlink.MAVLink_timesync_message(0, time_us * _NS_PER_US)

    def handle(self, message: MavlinkMessage, source: Source, time_us: int) -> bool:
        match message.get_msgId():
            case mavlink.MAVLINK_MSG_ID_TIMESYNC:
                if message.tc1 == 0:
                    now_ns = min(time_us * _NS_PER_US, _INT64_MAX)
                    source.channel.send(mavlink.MAVLink_timesync_message(now_ns, message.ts1))
            case mavlink.MAVLINK_MSG_ID_PING:
                if self._answers_ping and message.target_system == 0 and message.target_component == 0:
                    source.channel.send(
                        mavlink.MAVLink_ping_message(
                            message.time_usec, message.seq, source.system_id, source.component_id
                        )
                    )
            case _:
                return False
        return True

    def tick(self, time_us: int) -> None:
        if self._interval_us is None or time_us < self._next_request_us:
            return
        send_to_all(self._broadcast, self.request_message(time_us))
        self._next_request_us += self._interval_us
        if self._next_request_us <= time_us:  # the clock jumped: one request is enough
            self._next_request_us = time_us + self._interval_us


def px4_time_sync(broadcast: Broadcast) -> TimeSyncService:
    """PX4: answers PING; its own TIMESYNC requests are a stream."""
    return TimeSyncService(broadcast, answers_ping=True)


def ardupilot_time_sync(broadcast: Broadcast) -> TimeSyncService:
    """ArduPilot: asks for the time every 10 s, gives no answer to PING."""
    return TimeSyncService(broadcast, answers_ping=False, request_interval_us=10_000_000)
