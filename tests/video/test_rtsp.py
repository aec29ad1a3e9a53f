"""RTSP on the wire, and the server against FFmpeg's client and hostile ones."""

import asyncio
import re
import socket

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.video import rtsp_server
from autopilot_bridge.video.messages import CameraSetup, StudioSetup
from autopilot_bridge.video.rtsp import RequestReader, RtspError, Transport, parse_transport, response
from autopilot_bridge.video.rtsp_server import MAX_PLAYERS, RtspPlayer, RtspServer
from autopilot_bridge.video.studio import CameraStream
from flightsim.payload import CameraView, PinholeModel

# RFC 2326, appendix of examples: requests as players send them
DESCRIBE = b"DESCRIBE rtsp://127.0.0.1:8554/camera1 RTSP/1.0\r\nCSeq: 2\r\nAccept: application/sdp\r\n\r\n"
RECEIVER_REPORT = b"$\x01\x00\x08" + b"\x80\xc9\x00\x01abcd"
VIEW = CameraView(time_us=0, eye_ned_m=(0.0, 0.0, -30.0), q_ned_from_mount=(0.9, 0.0, -0.43589, 0.0))


def test_requests_come_whole_from_any_pieces_and_reports_are_passed_over():
    stream = (
        DESCRIBE + RECEIVER_REPORT + b"GET_PARAMETER * RTSP/1.0\r\nContent-Length: 4\r\n\r\nping" + DESCRIBE
    )
    for size in (1, 3, 7, 1000):
        reader = RequestReader()
        found = [
            request
            for start in range(0, len(stream), size)
            for request in reader.feed(stream[start : start + size])
        ]
        assert [request.method for request in found] == ["DESCRIBE", "GET_PARAMETER", "DESCRIBE"]
        assert found[0].path == "camera1"
        assert found[0].headers["cseq"] == "2"


@given(st.binary(max_size=400))
def test_anything_else_is_refused_or_waited_for(data):
    reader = RequestReader()
    try:
        found = reader.feed(data)
    except RtspError:
        return
    assert all(request.method for request in found)


@pytest.mark.parametrize(
    "data",
    [
        b"GET / HTTP/1.1\r\n\r\n",
        b"x" * 9000,
        b"PLAY * RTSP/1.0\r\nContent-Length: -1\r\n\r\n",
        b"PLAY * RTSP/1.0\r\nContent-Length: 99999\r\n\r\n",
    ],
)
def test_what_is_no_rtsp_ends_the_connection(data):
    with pytest.raises(RtspError):
        RequestReader().feed(data)


@pytest.mark.parametrize(
    ("header", "transport"),
    [
        ("RTP/AVP/TCP;unicast;interleaved=0-1", Transport(True, 0, 1)),
        ("RTP/AVP;unicast;client_port=5000-5001", Transport(False, 5000, 5001)),
        ("RTP/AVP/UDP;unicast;client_port=5000", Transport(False, 5000, 5001)),
        ("RTP/AVP;multicast,RTP/AVP/TCP;interleaved=4-5", Transport(True, 4, 5)),
        ("RTP/AVP;multicast", None),
        ("RTP/AVP;unicast;client_port=22-23", None),
        ("RTP/AVP;unicast;client_port=65535", None),
        ("RTP/AVP/TCP;interleaved=300-301", None),
        ("", None),
    ],
)
def test_transports(header, transport):
    assert parse_transport(header) == transport


def test_an_answer_carries_the_number_of_its_request():
    (request,) = RequestReader().feed(DESCRIBE)
    assert response(200, request, {"Public": "PLAY"}, "v=0\r\n") == (
        b"RTSP/1.0 200 OK\r\nCSeq: 2\r\nPublic: PLAY\r\nContent-Length: 5\r\n\r\nv=0\r\n"
    )


class Talk:
    """A server with one camera, and connections to it."""

    def __init__(self) -> None:
        async def ask():
            self.asked += 1
            return VIEW

        self.asked = 0
        model = PinholeModel(width_px=64, height_px=48)
        setup = StudioSetup(cameras=(CameraSetup(name="camera1", model=model, blur_px_m=0.0),), width_px=64)
        self.stream = CameraStream(setup.cameras[0], setup, ask)
        self.rtsp = RtspServer([self.stream])

    async def __aenter__(self):
        self.server = await asyncio.start_server(self.rtsp.accept, "127.0.0.1", 0)
        self.port = self.server.sockets[0].getsockname()[1]
        return self

    async def __aexit__(self, *_):
        self.server.close()

    async def connect(self):
        return await asyncio.open_connection("127.0.0.1", self.port)

    async def ask_for(
        self, connection, method: str, path: str = "camera1", **headers: str
    ) -> tuple[int, str]:
        reader, writer = connection
        lines = [f"{method} rtsp://127.0.0.1/{path} RTSP/1.0", "CSeq: 1"]
        lines += [f"{name.title()}: {value}" for name, value in headers.items()]
        writer.write(("\r\n".join(lines) + "\r\n\r\n").encode())
        while True:  # media may come between
            first = await asyncio.wait_for(reader.readexactly(1), 20.0)
            if first != b"$":
                break
            head = await reader.readexactly(3)
            await reader.readexactly(int.from_bytes(head[1:], "big"))
        head = (first + await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), 20.0)).decode()
        body = re.search(r"Content-Length: (\d+)", head)
        text = (await reader.readexactly(int(body[1]))).decode() if body else ""
        return int(head.split()[1]), head + text

    async def play(self, connection, transport: str = "RTP/AVP/TCP;unicast;interleaved=0-1") -> str:
        """What was answered about the transport."""
        status, answer = await self.ask_for(connection, "SETUP", "camera1/trackID=0", transport=transport)
        assert status == 200
        session = re.search(r"Session: (\w+)", answer)[1]  # type: ignore[index]
        assert (await self.ask_for(connection, "PLAY", session=session))[0] == 200
        return answer


async def packet(reader: asyncio.StreamReader) -> tuple[int, bytes]:
    mark, channel, *size = await asyncio.wait_for(reader.readexactly(4), 20.0)
    assert mark == ord("$")
    return channel, await reader.readexactly(int.from_bytes(bytes(size), "big"))


def test_a_player_gets_h264_from_a_key_picture_on():
    async def watch() -> None:
        async with Talk() as talk:
            reader, writer = connection = await talk.connect()
            assert (await talk.ask_for(connection, "OPTIONS"))[0] == 200
            status, answer = await talk.ask_for(connection, "DESCRIBE")
            assert status == 200 and "a=rtpmap:96 H264/90000" in answer
            assert talk.asked == 0  # no client watches yet
            await talk.play(connection)
            channel, first = await packet(reader)
            while channel != 0:
                channel, first = await packet(reader)
            assert (first[0] >> 6, first[1] & 0x7F) == (2, 96)
            assert first[12] & 0x1F in (7, 24)  # parameter sets first: SPS, or SPS and PPS together
            writer.close()
            async with asyncio.timeout(20.0):
                while talk.stream._players:
                    await asyncio.sleep(0.01)
            assert talk.stream._task is None  # no client watches any more, and nothing is rendered

    asyncio.run(watch())


def test_what_can_not_be_is_refused():
    async def ask() -> None:
        async with Talk() as talk:
            connection = await talk.connect()
            assert (await talk.ask_for(connection, "DESCRIBE", "elsewhere"))[0] == 404
            assert (await talk.ask_for(connection, "SETUP", transport="RTP/AVP;multicast"))[0] == 461
            assert (await talk.ask_for(connection, "PLAY", session="1"))[0] == 455
            assert (await talk.ask_for(connection, "RECORD"))[0] == 405
            await talk.play(connection)
            assert (await talk.ask_for(connection, "TEARDOWN", session="other"))[0] == 454
            reader, writer = await talk.connect()
            writer.write(b"\x00\xff garbage \r\n\r\n")
            assert await asyncio.wait_for(reader.read(), 20.0) == b""  # closed

    asyncio.run(ask())


def test_too_many_players_are_turned_away():
    async def crowd() -> None:
        async with Talk() as talk:
            connections = [await talk.connect() for _ in range(MAX_PLAYERS)]
            for connection in connections:
                assert (await talk.ask_for(connection, "OPTIONS"))[0] == 200
            late = await talk.connect()
            assert (await talk.ask_for(late, "OPTIONS"))[0] == 503
            connections[0][1].close()
            async with asyncio.timeout(20.0):
                while True:
                    again = await talk.connect()
                    status, _ = await talk.ask_for(again, "OPTIONS")
                    again[1].close()
                    if status == 200:
                        break
                    await asyncio.sleep(0.01)

    asyncio.run(crowd())


UDP = "RTP/AVP;unicast;client_port={port}-{port}"


@pytest.fixture
def short_looks(monkeypatch):
    monkeypatch.setattr(rtsp_server, "_LOOK_S", 0.02)


def test_a_udp_player_that_vanished_is_not_rendered_for(short_looks):
    async def vanish() -> None:
        async with Talk() as talk:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as media:
                media.bind(("127.0.0.1", 0))
                reader, _ = connection = await talk.connect()
                await talk.play(connection, UDP.format(port=media.getsockname()[1]))
                assert await asyncio.wait_for(reader.read(), 20.0) == b""  # parted from, after some silence
                assert talk.stream._task is None

    asyncio.run(vanish())


@pytest.mark.parametrize("how", ["RTCP", "GET_PARAMETER"])
def test_a_udp_player_that_is_received_goes_on(how, short_looks):
    async def watch() -> None:
        async with Talk() as talk:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as media:
                media.bind(("127.0.0.1", 0))
                reader, _ = connection = await talk.connect()
                answer = await talk.play(connection, UDP.format(port=media.getsockname()[1]))
                control = int(re.search(r"server_port=\d+-(\d+)", answer)[1])  # type: ignore[index]
                loop = asyncio.get_running_loop()
                long_after_s = loop.time() + 3 * 9 * 0.02
                while loop.time() < long_after_s:
                    if how == "RTCP":
                        media.sendto(RECEIVER_REPORT[4:], ("127.0.0.1", control))
                    else:
                        assert (await talk.ask_for(connection, "GET_PARAMETER"))[0] == 200
                    await asyncio.sleep(0.005)
                assert talk.stream._players and not reader.at_eof()

    asyncio.run(watch())


def test_a_player_within_its_connection_need_say_nothing(short_looks):
    async def watch() -> None:
        async with Talk() as talk:
            reader, _ = connection = await talk.connect()
            await talk.play(connection)
            begun_s = asyncio.get_running_loop().time()
            while asyncio.get_running_loop().time() < begun_s + 2 * 9 * 0.02:
                await packet(reader)
            assert talk.stream._players

    asyncio.run(watch())


class SlowWriter:
    """A connection whose queue the test fills."""

    def __init__(self) -> None:
        self.written: list[bytes] = []
        self.queued = 0
        self.transport = self

    def get_write_buffer_size(self) -> int:
        return self.queued

    def write(self, data: bytes) -> None:
        self.written.append(data)


def test_a_slow_player_misses_packets_until_the_next_key_picture():
    writer = SlowWriter()
    player = RtspPlayer({}, writer)
    player._transport, player.playing = Transport(True, 0, 1), True
    player.send(b"before the first key", control=False, key=False)
    assert writer.written == [] and player.lost
    player.send(b"key", control=False, key=True)
    assert writer.written == [b"$\x00\x00\x03key"] and not player.lost
    writer.queued = 1 << 20
    player.send(b"too much", control=False, key=False)
    writer.queued = 0
    player.send(b"rest of it", control=False, key=False)
    assert player.lost and len(writer.written) == 1
    player.send(b"report", control=True, key=False)
    player.send(b"again", control=False, key=True)
    assert writer.written[1:] == [b"$\x01\x00\x06report", b"$\x00\x00\x05again"]
