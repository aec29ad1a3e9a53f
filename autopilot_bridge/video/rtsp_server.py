"""RTSP server: hands the packets of camera streams to players, over UDP or within their connection."""

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
_FULL_BYTES: Final = 512 * 1024  # of a connection's queue: from here on packets are left out
_METHODS: Final = "OPTIONS, DESCRIBE, SETUP, PLAY, PAUSE, TEARDOWN, GET_PARAMETER, SET_PARAMETER"
_TIMEOUT_S: Final = 60  # as players are told, who ask for something or send RTCP twice in it
_LOOK_S: Final = 10.0
_SILENT_LOOKS: Final = 9  # in a row: a player that is heard on no way is gone


class RtspServer:
    """Serves each stream at its name.

    Args:
        streams: what there is to watch.
    """

    def __init__(self, streams: list[CameraStream]) -> None:
        self._streams: Mapping[str, CameraStream] = {stream.name: stream for stream in streams}
        self._players = 0

    async def accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """One connection, from its beginning to its end."""
        full = self._players >= MAX_PLAYERS
        player = RtspPlayer(self._streams, writer)
        self._players += not full
        requests = RequestReader()
        try:
            while True:
                data = await _said(reader, player)
                if not data:
                    break
                for request in requests.feed(data):
                    writer.write(response(503, request) if full else await player.answer(request))
                if full:
                    break
        except (RtspError, OSError, TimeoutError, asyncio.CancelledError):
            pass  # cancelled: the process ends, and the connection with it
        finally:
            self._players -= not full
            player.close()
            writer.close()
            with suppress(OSError):
                await writer.wait_closed()


async def _said(reader: asyncio.StreamReader, player: "RtspPlayer") -> bytes:
    """What a player says next on its connection; nothing: it has ended it.

    Looks are counted, not seconds: when this process was stopped for a while, what was said meanwhile counts.

    Raises:
        TimeoutError: it is gone.
    """
    silent = 0
    while player.held_by_connection or silent < _SILENT_LOOKS:
        player.heard = False
        try:
            async with asyncio.timeout(_LOOK_S) as look:
                return await reader.read(65536)
        except TimeoutError:
            if not look.expired():  # the operating system has given it up
                raise
        silent = 0 if player.heard else silent + 1
    raise TimeoutError


class _Ear(asyncio.DatagramProtocol):
    """Hears a player's RTCP; the reports' contents are not used."""

    def __init__(self, player: "RtspPlayer") -> None:
        self._player = player

    def datagram_received(self, data: bytes, addr: object) -> None:
        self._player.heard = True


class RtspPlayer:
    """One connection's session.

    Attributes:
        playing: it is sent packets.
        lost: see `studio.Player`.
        heard: set when something comes from it by UDP.
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
        self.heard = False

    @property
    def held_by_connection(self) -> bool:
        """Its packets go into the connection, which breaks when nobody takes them."""
        return self.playing and self._transport is not None and self._transport.interleaved

    async def answer(self, request: Request) -> bytes:
        """Do what is asked, and say so."""
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
        """Hand a packet to the network; too slow a player misses some, until the next key picture."""
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
        """Stop watching."""
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
        """Of the player's end of the connection, or of ours."""
        name: Any = self._writer.get_extra_info("sockname" if own else "peername")
        return str(name[0])
