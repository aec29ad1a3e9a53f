"""RTSP server: sends the packets of camera streams to players, over UDP or within their connection."""

import asyncio
import secrets
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Final

from autopilot_bridge.video.encoder import PAYLOAD_TYPE, RTP_CLOCK_HZ
from autopilot_bridge.video.rtsp import (
    Request,
    RequestReader,
    RtspError,
    Transport,
    parse_transport,
    response,
    session_description,
)
from autopilot_bridge.video.studio import CameraStream

MAX_PLAYERS: Final = 32
_FULL_BYTES: Final = 512 * 1024  # of a connection's queue: above this size packets are dropped
_METHODS: Final = "OPTIONS, DESCRIBE, SETUP, PLAY, PAUSE, TEARDOWN, GET_PARAMETER, SET_PARAMETER"
_TIMEOUT_S: Final = 60  # sent to players, which send a request or RTCP twice within this time
_LOOK_S: Final = 10.0
_SILENT_LOOKS: Final = 9  # in a row: a player that sends nothing on any channel is gone


class RtspServer:
    """Serves each stream under its name.

    Args:
        streams: all streams.
    """

    def __init__(self, streams: list[CameraStream]) -> None:
        self._streams: Mapping[str, CameraStream] = {stream.name: stream for stream in streams}
        self._players = 0

    async def accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve one connection, from its beginning to its end."""
        full = self._players >= MAX_PLAYERS
        player = RtspPlayer(self._streams, writer)
        self._players += not full
        requests = RequestReader()
        try:
            while True:
                data = await _read_request(reader, player)
                if not data:
                    break
                for request in requests.feed(data):
                    writer.write(response(503, request) if full else await player.answer(request))
                if full:
                    break
        except (RtspError, OSError, TimeoutError, asyncio.CancelledError):
            pass  # cancelled: the process ends, and the connection ends with it
        finally:
            self._players -= not full
            player.close()
            writer.close()
            with suppress(OSError):
                await writer.wait_closed()


async def _read_request(reader: asyncio.StreamReader, player: "RtspPlayer") -> bytes:
    """The next data of a player on its connection; empty when the player has closed it.

    Timeouts are counted, not measured as a total time: after a pause of this process, data received meanwhile
    count.

    Raises:
        TimeoutError: the player is gone.
    """
    silent = 0
    while player.held_by_connection or silent < _SILENT_LOOKS:
        player.received = False
        try:
            async with asyncio.timeout(_LOOK_S) as look:
                return await reader.read(65536)
        except TimeoutError:
            if not look.expired():  # a timeout of the operating system
                raise
        silent = 0 if player.received else silent + 1
    raise TimeoutError


class _Ear(asyncio.DatagramProtocol):
    """Receives a player's RTCP; the contents of the reports are not used."""

    def __init__(self, player: "RtspPlayer") -> None:
        self._player = player

    def datagram_received(self, data: bytes, addr: object) -> None:
        self._player.received = True


class RtspPlayer:
    """One connection's session.

    Attributes:
        playing: packets are sent to it.
        lost: see `studio.Player`.
        received: an event that is set when UDP data of the player are received.
    """

    def __init__(self, streams: Mapping[str, CameraStream], writer: asyncio.StreamWriter) -> None:
        self._streams = streams
        self._writer = writer
        self._stream: CameraStream | None = None
        self._transport: Transport | None = None
        self._udp: list[asyncio.DatagramTransport] = []
        self._session = ""
        self.playing = False
        self.lost = True
        self.received = False

    @property
    def held_by_connection(self) -> bool:
        """Its packets are sent within the connection, which breaks when the player does not read them."""
        return self.playing and self._transport is not None and self._transport.interleaved

    async def answer(self, request: Request) -> bytes:
        """Execute a request; returns the response."""
        match request.method:
            case "OPTIONS":
                return response(200, request, {"Public": _METHODS})
            case "DESCRIBE":
                return self._describe(request)
            case "SETUP":
                return await self._set_up(request)
            case "GET_PARAMETER" | "SET_PARAMETER":
                return response(200, request, self._named())
            case "PLAY" | "PAUSE" | "TEARDOWN":
                return self._control(request)
        return response(405, request, {"Allow": _METHODS})

    def send(self, packet: bytes, *, control: bool, key: bool) -> None:
        """Send a packet; a player that reads too slowly misses packets until the next key picture."""
        transport = self._transport
        if transport is None or not self.playing:
            return
        if self.lost and not control:
            if not key:
                return
            self.lost = False
        if not transport.interleaved:
            if self._udp:
                port = transport.second if control else transport.first
                self._udp[control].sendto(packet, (self._address(0), port))
            return
        if self._writer.transport.get_write_buffer_size() > _FULL_BYTES:
            self.lost = True
            return
        channel = transport.second if control else transport.first
        self._writer.write(b"$" + bytes((channel,)) + len(packet).to_bytes(2, "big") + packet)

    def close(self) -> None:
        """End the session."""
        self.playing = False
        if self._stream is not None:
            self._stream.remove(self)
        for endpoint in self._udp:
            endpoint.close()
        self._udp = []
        self._transport = None

    def _describe(self, request: Request) -> bytes:
        stream = self._streams.get(request.path)
        if stream is None:
            return response(404, request)
        body = session_description(stream.name, self._address(1), PAYLOAD_TYPE, RTP_CLOCK_HZ)
        headers = {"Content-Type": "application/sdp", "Content-Base": request.uri.rstrip("/") + "/"}
        return response(200, request, headers, body)

    async def _set_up(self, request: Request) -> bytes:
        stream = self._streams.get(request.path.removesuffix("trackID=0").rstrip("/"))
        if stream is None:
            return response(404, request)
        transport = parse_transport(request.headers.get("transport", ""))
        if transport is None:
            return response(461, request)
        self.close()
        header = transport.header
        if not transport.interleaved:
            loop = asyncio.get_running_loop()
            for _ in range(2):
                endpoint, _ = await loop.create_datagram_endpoint(
                    lambda: _Ear(self), local_addr=(self._address(1), 0)
                )
                self._udp.append(endpoint)
            ports = [endpoint.get_extra_info("sockname")[1] for endpoint in self._udp]
            header += f";server_port={ports[0]}-{ports[1]}"
        self._stream, self._transport = stream, transport
        self._session = self._session or secrets.token_hex(8)
        return response(
            200, request, {"Transport": header, "Session": f"{self._session};timeout={_TIMEOUT_S}"}
        )

    def _control(self, request: Request) -> bytes:
        if self._stream is None or self._transport is None:
            return response(455, request)
        if request.headers.get("session", "").partition(";")[0].strip() != self._session:
            return response(454, request)
        match request.method:
            case "PLAY":
                self.playing = self.lost = True
                self._stream.add(self)
            case "PAUSE":
                self.playing = False
                self._stream.remove(self)
            case _:
                self.close()
        return response(200, request, self._named())

    def _named(self) -> dict[str, str]:
        return {"Session": self._session} if self._session else {}

    def _address(self, own: int) -> str:
        """Address of the player's end of the connection, or of ours."""
        name: Any = self._writer.get_extra_info("sockname" if own else "peername")
        return str(name[0])
