"""The vehicle's onboard log of a flight: the messages that it sends, on a separate channel.

The firmware's parameters define when the log begins and ends. Only whole records are written to the card, at
50 Hz, so the log can be read to its end even when the process was killed.
"""

import contextlib
from collections.abc import Callable, Sequence
from typing import Final

from autopilot_bridge.commander.events import Armed, Disarmed, Event
from autopilot_bridge.mavlink import FrameEncoder, MAVLinkMessage, dialect
from autopilot_bridge.packet_records import packet_records
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Announce
from autopilot_bridge.services.files.card_layout import CardLayout, LogTimes
from autopilot_bridge.services.files.log_book import LogBook
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.vehicle_memory import LOG_ROLE
from autopilot_bridge.storage import OpenFile, VehiclePath
from autopilot_bridge.telemetry.motion import MotionMessages

_STOP_AFTER_US: Final = 2_000_000
"""A log continues for this time after disarming, so that it contains the end of the flight."""


class LogChannel:
    """A channel of the autopilot that writes to a log.

    Args:
        system_id: the vehicle's.
        unix_us: returns the current time, microseconds of the Unix epoch.

    Attributes:
        motion: set by the autopilot that the channel is added to.
        receives_all: it gets all texts, even before a client has sent a heartbeat.
        line: its capacity: unlimited.
    """

    name = "onboard log"
    receives_all = True
    line = None

    def __init__(self, system_id: int, unix_us: Callable[[], int]) -> None:
        self.motion: MotionMessages | None = None
        self._times_us: list[int] = []
        self._packets: list[bytes] = []
        self._encoder = FrameEncoder(system_id, 1)
        self._unix_us = unix_us

    def send(self, message: MAVLinkMessage) -> None:
        """Log a message."""
        self._keep(self._encoder.encode(message))

    def send_payload(self, message_id: int, payload: bytes) -> None:
        """Log a packed payload."""
        self._keep(self._encoder.encode_payload(message_id, payload))

    def send_streams(self, motion: int, payloads: Sequence[tuple[int, bytes]]) -> None:
        """Log the payloads that are due together."""
        packet = b""
        if motion and self.motion is not None:
            packet, _ = self.motion.packet(motion, self._encoder)
        packet += b"".join(self._encoder.encode_payloads(payloads))
        if packet:
            self._keep(packet)

    def take(self) -> bytes:
        """The records since the last call."""
        if not self._packets:
            return b""
        data, _, _ = packet_records(self._times_us, self._packets)
        self._times_us.clear()
        self._packets.clear()
        return data

    def _keep(self, packet: bytes) -> None:
        self._times_us.append(self._unix_us())
        self._packets.append(packet)


class OnboardLog(Microservice):
    """Writes the vehicle's log.

    Args:
        book: the logs on the card.
        layout: when to log.
        parameters: contain the logging mode.
        announce: sends a STATUSTEXT.
        system_id: the vehicle's.
        unix_us: returns the current time, microseconds of the Unix epoch.
        add_channel, remove_channel: of the autopilot.

    Attributes:
        path: path of the log that is being written; None: none.
    """

    def __init__(
        self,
        book: LogBook,
        layout: CardLayout,
        parameters: ParameterStore,
        announce: Announce,
        *,
        system_id: int,
        unix_us: Callable[[], int],
        add_channel: Callable[[LogChannel, str], None],
        remove_channel: Callable[[LogChannel], None],
    ) -> None:
        self._book = book
        self._layout = layout
        self._parameters = parameters
        self._announce = announce
        self._channel = LogChannel(system_id, unix_us)
        self._unix_us = unix_us
        self._add_channel = add_channel
        self._remove_channel = remove_channel
        self._file: OpenFile | None = None
        self._size = 0
        self._stop_us: int | None = None
        self._booted = False
        self.path: VehiclePath | None = None

    @property
    def _times(self) -> LogTimes | None:
        return self._layout.log_times(self._parameters)

    def tick(self, time_us: int) -> None:
        """Write the collected records to the card."""
        if not self._booted:
            self._booted = True
            times = self._times
            if times is not None and times.from_boot:
                self._start()
        self._flush()
        if self._stop_us is not None and time_us >= self._stop_us:
            self.close()
            times = self._times
            if times is not None and times.after_disarming and times.new_at_disarming:
                self._start()

    def follow(self, event: Event) -> None:
        """Begin at arming and end after disarming, if the parameters require it."""
        times = self._times
        if isinstance(event, Armed):
            self._stop_us = None
            if self._file is None and times is not None:
                self._start()
        elif isinstance(event, Disarmed) and (
            times is None or not times.after_disarming or times.new_at_disarming
        ):
            self._stop_us = event.time_us + _STOP_AFTER_US

    def close(self) -> None:
        """End the log; does nothing when no log is open."""
        self._stop_us = None
        file, self._file = self._file, None
        if file is None:
            return
        self._remove_channel(self._channel)
        with contextlib.suppress(OSError):
            file.write(self._size, self._channel.take())
        file.close()
        self.path = None

    def _start(self) -> None:
        try:
            self.path, self._file = self._book.create(self._unix_us())
        except OSError as failure:
            self._announce(dialect.MAV_SEVERITY_ERROR, f"Logging failed: {failure.strerror}")
            return
        self._size = 0
        self._add_channel(self._channel, LOG_ROLE)

    def _flush(self) -> None:
        data = self._channel.take()
        if self._file is None or not data:
            return
        try:
            self._file.write(self._size, data)
        except OSError as failure:
            self.close()
            self._announce(dialect.MAV_SEVERITY_ERROR, f"Logging stopped: {failure.strerror}")
            return
        self._size += len(data)
