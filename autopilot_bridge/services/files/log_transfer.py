"""Log list and download: LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_ERASE, LOG_REQUEST_END.

Every client (system and component on a channel) has its own list and download. Answers are sent at 50 Hz, a
few at a time, and none while the link is congested. A client may request several ranges one after the other,
as clients do to fill gaps.

Source: MAVLink log download (mavlink.io/en/messages/common.html, LOG_ENTRY, LOG_DATA).
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, get_args

from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.services.channel import Source, is_congested
from autopilot_bridge.services.files.log_book import LogBook, LogFile
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.storage import OpenFile, VehiclePath

DATA_BYTES: Final = 90
REPLIES_PER_TICK: Final = 40
"""On one channel: 180 kB/s of vehicle time."""
_MAX_RANGES: Final = 64
_MAX_CLIENTS: Final = 16
_IDLE_US: Final = 60_000_000
_Request = (
    dialect.MAVLink_log_request_list_message
    | dialect.MAVLink_log_request_data_message
    | dialect.MAVLink_log_erase_message
    | dialect.MAVLink_log_request_end_message
)


@dataclass(slots=True)
class _Download:
    """The data that are being sent to a client.

    Attributes:
        source: the client.
        entries: list entries still to be sent.
        ranges: (offset, end) of the log's bytes still to be sent.
        number, file: the open log; -1: none.
        used_us: time of the last request.
    """

    source: Source
    used_us: int
    entries: deque[MAVLinkMessage] = field(default_factory=deque)
    ranges: deque[tuple[int, int]] = field(default_factory=deque)
    number: int = -1
    file: OpenFile | None = None

    def close(self) -> None:
        """Discard what is still to be sent."""
        self.entries.clear()
        self.ranges.clear()
        self.number = -1
        if self.file is not None:
            self.file.close()
            self.file = None


class LogTransferService(Microservice):
    """Lists the logs on the card and sends them.

    Args:
        book: the logs.
        recording: path of the log that is being written, which is not erased; None: none.
        armed: whether the vehicle is armed.
        armed_refusal: text sent once to a client that requests logs while armed; empty: logs are sent in
            flight too.
    """

    def __init__(
        self,
        book: LogBook,
        recording: Callable[[], VehiclePath | None],
        armed: Callable[[], bool],
        armed_refusal: str,
    ) -> None:
        self._book = book
        self._recording = recording
        self._armed = armed
        self._armed_refusal = armed_refusal
        self._refused = False
        self._logs: list[LogFile] = []  # as listed, so that the numbers stay valid
        self._downloads: dict[tuple[str, int, int], _Download] = {}

    @receives(*get_args(_Request))
    def _on_request(self, message: _Request, source: Source, time_us: int) -> None:
        if self._waits:
            self._refuse(source)
            return
        match message:
            case dialect.MAVLink_log_request_list_message():
                self._list(message, self._download(source, time_us))
            case dialect.MAVLink_log_request_data_message():
                self._request(message, self._download(source, time_us))
            case dialect.MAVLink_log_erase_message():
                self._erase()
            case dialect.MAVLink_log_request_end_message():
                self._download(source, time_us).close()

    def tick(self, time_us: int) -> None:
        """Send the requested data; forget idle clients."""
        if not self._downloads or self._waits:
            return
        for key, download in tuple(self._downloads.items()):
            self._continue(download)
            if time_us - download.used_us > _IDLE_US and not download.ranges:
                download.close()
                del self._downloads[key]

    def close(self) -> None:
        """Close the open files."""
        for download in self._downloads.values():
            download.close()

    @property
    def _waits(self) -> bool:
        """Nothing is sent while the vehicle is armed; running transfers continue afterwards."""
        return bool(self._armed_refusal) and self._armed()

    def _refuse(self, source: Source) -> None:
        if not self._refused:
            text = self._armed_refusal.encode()
            source.channel.send(dialect.MAVLink_statustext_message(dialect.MAV_SEVERITY_ERROR, text))
        self._refused = True

    def _download(self, source: Source, time_us: int) -> _Download:
        key = (source.channel.name, source.system_id, source.component_id)
        self._refused = False
        download = self._downloads.get(key)
        if download is None or download.source.channel is not source.channel:
            if len(self._downloads) >= _MAX_CLIENTS:
                oldest = min(self._downloads, key=lambda each: self._downloads[each].used_us)
                self._downloads.pop(oldest).close()
            download = self._downloads[key] = _Download(source, time_us)
        download.used_us = time_us
        return download

    def _list(self, message: dialect.MAVLink_log_request_list_message, download: _Download) -> None:
        self._logs = self._book.logs()
        logs = self._logs
        last = logs[-1].number if logs else 0
        chosen = [log for log in logs if message.start <= log.number <= message.end]
        download.entries = deque(
            dialect.MAVLink_log_entry_message(
                log.number, len(logs), last, log.time_utc_s, min(log.size, 0xFFFFFFFF)
            )
            for log in chosen
        )
        if not logs:
            download.entries.append(dialect.MAVLink_log_entry_message(0, 0, 0, 0, 0))

    def _request(self, message: dialect.MAVLink_log_request_data_message, download: _Download) -> None:
        if download.number != message.id:
            download.close()
            if not self._logs:
                self._logs = self._book.logs()
            log = next((log for log in self._logs if log.number == message.id), None)
            if log is None:
                return
            try:
                download.file = self._book.open(log)
            except OSError:  # erased after it was listed
                return
            download.number = message.id
        if download.file is None:
            return
        end = min(message.ofs + message.count, download.file.size)
        if message.count > DATA_BYTES * 1000:
            download.ranges.clear()  # the rest of the log from here on, which contains the earlier requests
        if (message.ofs, end) not in download.ranges and len(download.ranges) < _MAX_RANGES:
            download.ranges.append((message.ofs, end))

    def _erase(self) -> None:
        for download in self._downloads.values():
            download.close()
        self._logs = []
        try:
            self._book.erase(but=self._recording())
        except OSError:  # the next list shows the remaining logs
            return

    def _continue(self, download: _Download) -> None:
        channel = download.source.channel
        for _ in range(REPLIES_PER_TICK):
            if is_congested(channel):
                return
            if download.entries:
                channel.send(download.entries.popleft())
            elif download.ranges and download.file is not None:
                channel.send(self._next_data(download, download.file))
            else:
                return

    def _next_data(self, download: _Download, file: OpenFile) -> MAVLinkMessage:
        offset, end = download.ranges.popleft()
        try:
            data = file.read(offset, max(0, min(DATA_BYTES, end - offset)))
        except OSError:
            data = b""
        if data and offset + len(data) < end:
            download.ranges.appendleft((offset + len(data), end))
        return dialect.MAVLink_log_data_message(
            download.number, offset, len(data), data.ljust(DATA_BYTES, b"\0")
        )
