"""A firmware's own MAVLink links as the autopilot's side of the SITL's links.

The firmware sends and receives datagrams on ports of this machine that only the SITL uses. Each role of the
SITL's channels has a port. The SITL routes between its channels, so of a firmware's port only the frames of
the autopilot itself are passed on.
"""

import socket
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from autopilot_bridge.autopilot.channels import AutopilotChannel
from autopilot_bridge.mavlink import Frame, FrameParser
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.sitl.channel import LinkChannel

LOOPBACK: Final = "127.0.0.1"
_BUFFER_BYTES: Final = 4 << 20  # a firmware far faster than real time sends as long as a step lasts
_DATAGRAM_BYTES: Final = 65536


class FirmwarePort:
    """The SITL's end of one link of a firmware.

    Args:
        remote: port of the firmware; 0: where the first datagram comes from.

    Attributes:
        number: UDP port of this end.
        remote: as given.
    """

    def __init__(self, remote: int = 0) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
        self._socket.bind((LOOPBACK, 0))
        self._socket.setblocking(False)
        self.number: int = self._socket.getsockname()[1]
        self.remote = remote
        self._remote: tuple[str, int] | None = (LOOPBACK, remote) if remote else None
        self._parser = FrameParser()

    def send(self, raw: bytes) -> None:
        """Send a frame; before the firmware's port is known it is lost, as on a line without a reader."""
        if self._remote is None:
            return
        try:
            self._socket.sendto(raw, self._remote)
        except (BlockingIOError, ConnectionError):  # not open yet, or closed already
            return

    def receive(self) -> list[Frame]:
        """The frames that have arrived."""
        frames: list[Frame] = []
        while True:
            try:
                data, remote = self._socket.recvfrom(_DATAGRAM_BYTES)
            except BlockingIOError:
                return frames
            except ConnectionError:  # the answer to a datagram that nothing has received
                continue
            if self._remote is None:
                self._remote = remote
            frames += self._parser.feed(data)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def ports_to(count: int) -> list[FirmwarePort]:
    """Ports to as many links of a firmware that opens the ports it is given (`FirmwarePort.remote`)."""
    probes = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(count)]
    try:
        for probe in probes:
            probe.bind((LOOPBACK, 0))
        return [FirmwarePort(probe.getsockname()[1]) for probe in probes]
    finally:
        for probe in probes:  # held until here, so that no number is given twice
            probe.close()


class FirmwareLinks:
    """The links of one firmware; see `BackendLinks`.

    Args:
        system_id: the vehicle's.
        ports: the firmware's links by role; a role that is not listed uses the first of them.
        on_frame: called with each frame of the autopilot that the first port receives.
    """

    def __init__(
        self,
        system_id: int,
        ports: Mapping[str, FirmwarePort],
        on_frame: Callable[[Frame], None] = lambda _frame: None,
    ) -> None:
        self._system_id = system_id
        self._ports: Sequence[FirmwarePort] = tuple(ports.values())
        self._roles = {role: index for index, role in enumerate(ports)}
        self._channels: list[tuple[LinkChannel, int]] = []
        self._on_frame = on_frame

    def add_channel(self, channel: AutopilotChannel, *, role: str) -> None:
        """Send the frames of a role on one more channel."""
        assert isinstance(channel, LinkChannel)
        self._channels.append((channel, self._roles.get(role, 0)))

    def remove_channel(self, channel: AutopilotChannel) -> None:
        """Send nothing more on a channel."""
        self._channels = [each for each in self._channels if each[0] is not channel]

    def receive(self, frame: Frame, channel: AutopilotChannel) -> None:
        """Pass one frame of a channel to the firmware."""
        for each, index in self._channels:
            if each is channel:
                self._ports[index].send(frame.raw)

    def send(self, raw: bytes) -> None:
        """Send a frame of the simulator to the firmware."""
        self._ports[0].send(raw)

    def exchange(self) -> None:
        """Send what the firmware has sent on the channels."""
        for index, port in enumerate(self._ports):
            for frame in port.receive():
                if frame.system_id != self._system_id or frame.component_id != AUTOPILOT_COMPONENT:
                    continue  # of a client or a payload, which the SITL's own links carry already
                if index == 0:
                    self._on_frame(frame)
                for channel, own in self._channels:
                    if own == index:
                        channel.send_own_frame(frame.raw)

    def close(self) -> None:
        """Close the ports."""
        for port in self._ports:
            port.close()
