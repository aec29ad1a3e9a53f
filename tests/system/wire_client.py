"""A client on a memory link of an embedded SITL: it sees what any client at the wire sees."""

from collections import Counter
from collections.abc import Iterator
from typing import Any, Final

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode
from autopilot_bridge.sitl import Sitl

WINDOW_S: Final = 20.0
"""Seconds over which rates are counted."""


class Client:
    """One memory link of one vehicle."""

    def __init__(self, sitl: Sitl, *, role: str = "onboard") -> None:
        self.sitl = sitl
        self.link = sitl.connect(0, role=role)
        self._parser = FrameParser()
        self._encoder = FrameEncoder(255, 190)

    def messages(self) -> Iterator[Any]:
        """What has arrived."""
        for _, data in self.link.receive():
            for frame in self._parser.feed(data):
                if frame.component_id == 1:
                    yield decode(frame)

    def run(self, seconds: float) -> list[Any]:
        """Let the vehicle run and collect what it sends."""
        received: list[Any] = []
        until_us = self.sitl.time_us + round(seconds * 1e6)
        while self.sitl.time_us < until_us:
            self.sitl.advance()
            received += self.messages()
        return received

    def rates_hz(self, seconds: float = WINDOW_S) -> dict[str, float]:
        """Rate of every message."""
        list(self.messages())  # what came before does not count
        counts = Counter(message.get_type() for message in self.run(seconds))
        counts.pop("EVENT", None)  # comes when something happens
        return {name: count / seconds for name, count in counts.items()}

    def send(self, message: Any) -> None:
        """Send a message to the vehicle."""
        self.link.send(self._encoder.encode(message))

    def command(self, command: int, *parameters: float) -> tuple[int, list[Any]]:
        """Result of a COMMAND_LONG, and everything that came in the next 0.1 s, in order."""
        values = (*parameters, *(0.0,) * (7 - len(parameters)))
        message = mavlink.MAVLink_command_long_message(1, 1, command, 0, *values)
        list(self.messages())
        self.send(message)
        received = self.run(0.1)
        (ack,) = (m for m in received if m.get_type() == "COMMAND_ACK" and m.command == command)
        return int(ack.result), received

    def request_streams(self, group: int, rate_hz: int, start: int = 1) -> None:
        """REQUEST_DATA_STREAM."""
        message = mavlink.MAVLink_request_data_stream_message(1, 1, group, rate_hz, start)
        self.send(message)
