"""Connections: streams, laziness, recording, and real links with the vehicle's own time."""

import asyncio
import socket
import threading

import pytest

from autopilot_bridge.clock import LoopClock, TelemetryClock, VirtualTimeLoop, run
from autopilot_bridge.links import memory_pair, open_link
from autopilot_bridge.mavlink import FrameEncoder, Intake, dialect
from autopilot_bridge.mavlink.intake import MAX_PEERS
from missions.base.options import FlightOptions, Via
from missions.errors import LinkClosed
from missions.library import find_mission
from missions.runs.session import RunRequest, fly
from missions.vehicle import Vehicle
from missions.vehicle.connection import ONBOARD_COMPUTER, Connection
from missions.vehicle.peers import MAX_COMPONENTS
from tests.clients.sitl_process import free_port
from tests.slow import slow


class Recording:
    acts = False

    def __init__(self):
        self.frames = []

    def record(self, packet, time_us):
        self.frames += [(time_us, frame.raw) for frame in packet]


def on_memory(script, **arguments):
    """Run `script(connection, send)` on virtual time; `send` sends a packet as an autopilot."""
    now = [0]

    def advance():
        now[0] += 1000

    async def main():
        ours, theirs = memory_pair()
        encoder = FrameEncoder(1, 1)
        async with Connection(ours, LoopClock(), **arguments) as connection:
            return await script(connection, lambda *m: theirs.send(b"".join(map(encoder.encode, m))))

    return run(main(), VirtualTimeLoop(advance, lambda: now[0], max_time_us=100_000_000))


def attitude(k):
    return dialect.MAVLink_attitude_message(k, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_stream_gives_every_message_in_order():
    async def script(connection, send):
        with connection.messages(dialect.MAVLink_attitude_message) as stream:
            for k in range(100):
                send(attitude(k))
                send(dialect.MAVLink_system_time_message(0, k))
            assert [(await anext(stream)).time_boot_ms for _ in range(100)] == list(range(100))
            assert stream.take() is None
        send(attitude(7))
        assert stream.take() is None  # closed

    on_memory(script)


def test_a_slow_reader_loses_the_oldest_and_counts_them():
    async def script(connection, send):
        with connection.messages(dialect.MAVLink_attitude_message) as stream:
            for k in range(5000):
                send(attitude(k))
            assert stream.dropped == 5000 - 4096
            assert (await anext(stream)).time_boot_ms == 5000 - 4096

    on_memory(script)


def test_latest_is_decoded_once_and_only_when_read():
    async def script(connection, send):
        assert connection.latest("ATTITUDE", 1) is None
        send(attitude(1))
        send(attitude(2))
        newest = connection.latest("ATTITUDE", 1)
        assert newest.time_boot_ms == 2
        assert connection.latest("ATTITUDE", 1) is newest
        assert connection.latest("ATTITUDE", 2) is None
        assert connection.latest("ATTITUDE", 1, component_id=2) is None

    on_memory(script)


def test_a_listener_does_not_know_what_follows_in_the_same_packet():
    async def script(connection, send):
        known = []
        connection.listen(
            "ATTITUDE", lambda frame: known.append(connection.latest("ATTITUDE", 1).time_boot_ms)
        )
        send(attitude(1), attitude(2), attitude(3))
        assert known == [1, 2, 3]
        assert connection.latest("ATTITUDE", 1).time_boot_ms == 3

    on_memory(script)


def test_both_directions_are_recorded_with_vehicle_time():
    recording = Recording()

    async def script(connection, send):
        await asyncio.sleep(2.5)
        send(attitude(1))
        own = [t for t, frame in recording.frames if frame[5:7] == bytes((255, 190))]
        assert own == pytest.approx([0, 1_000_000, 2_000_000], abs=2000)
        assert recording.frames[-1][0] == pytest.approx(2_500_000, abs=2000)

    on_memory(script, recorder=recording)


def test_identity_of_an_onboard_computer():
    recording = Recording()

    async def script(connection, send):
        await asyncio.sleep(0.1)
        assert recording.frames[0][1][5:7] == bytes((1, 191))

    on_memory(script, recorder=recording, identity=ONBOARD_COMPUTER)


def test_garbage_is_counted_and_does_no_harm():
    async def script(connection, send):
        connection._link.on_receive(b"\xfd\x09garbage" * 50)
        send(attitude(3))
        assert connection.latest("ATTITUDE", 1).time_boot_ms == 3
        assert len(connection.parsers) == 1
        assert connection.parsers.counters.bytes_dropped > 400

    on_memory(script)


def test_peers_that_come_and_go_are_forgotten_and_their_bytes_are_not():
    parsers = Intake()
    whole = FrameEncoder(1, 1).encode(attitude(1))
    fed = 0
    for peer in range(500):
        data = b"junk" + whole + whole[: peer % len(whole)]
        assert len(parsers.parse(peer, data)) == 1
        fed += len(data)
    assert len(parsers) == MAX_PEERS
    counters = parsers.counters
    assert counters.frames == 500
    assert counters.bytes_in == fed
    assert fed == counters.bytes_framed + counters.bytes_dropped + parsers.pending_bytes


def test_a_crowd_of_components_is_forgotten_and_the_vehicle_is_not():
    async def script(connection, send):
        vehicle = Vehicle(connection)
        send(dialect.MAVLink_heartbeat_message(2, 12, 129, 0, 4, 3))
        send(attitude(7))
        assert vehicle.armed
        crowd = dialect.MAVLink_attitude_message(9, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        for k in range(600):
            connection._link.on_receive(FrameEncoder(2 + k % 200, 1 + k // 200).encode(crowd))
            connection.latest("ATTITUDE", 2 + k % 200, 1 + k // 200)
        assert len(connection._newest) == MAX_COMPONENTS
        assert len(connection._newest._decoded) <= MAX_COMPONENTS
        assert vehicle.link.message("ATTITUDE").time_boot_ms == 7
        assert connection.latest("ATTITUDE", 2) is None
        assert connection.latest("ATTITUDE", 201, 3).time_boot_ms == 9

    on_memory(script)


def test_sending_after_the_end_says_so():
    async def script(connection, send):
        await connection.close()
        with pytest.raises(LinkClosed):
            connection.send(attitude(1))

    on_memory(script)


class Elsewhere(threading.Thread):
    """A scripted autopilot on a real link, some tens of times faster than real time.

    A mission that has no time to keep up is waited for: it would see only parts of the flight.
    """

    BEHIND_US = 3_000_000

    def __init__(self, autopilot):
        super().__init__(daemon=True)
        self.autopilot, self.end = autopilot, threading.Event()

    def run(self):
        time_us = received_us = 0
        while not self.end.wait(0.05 if time_us - received_us > self.BEHIND_US else 0.0004):
            for _peer, data in self.autopilot.link.receive():
                self.autopilot.receive(data)
                received_us = time_us
            time_us += 20_000
            self.autopilot.step(time_us)
        self.autopilot.link.close()


@pytest.mark.parametrize(
    ("kind", "flavour"), [("udp", "px4"), ("tcp", "ardupilot"), slow("udp", "ardupilot"), slow("tcp", "px4")]
)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_the_same_mission_flies_a_vehicle_elsewhere(make_sitl, tmp_path, kind, flavour):
    port = free_port(socket.SOCK_DGRAM if kind == "udp" else socket.SOCK_STREAM)
    theirs, ours = {
        "udp": (f"udpout:127.0.0.1:{port}", f"udpin:127.0.0.1:{port}"),
        "tcp": (f"tcpin:127.0.0.1:{port}", f"tcp:127.0.0.1:{port}"),
    }[kind]
    autopilot = make_sitl(flavour, truth=False).autopilots[0]
    autopilot.link = open_link(theirs)
    elsewhere = Elsewhere(autopilot)
    elsewhere.start()
    try:
        options = FlightOptions(pattern="L1", width_m=30.0, height_m=30.0, via=Via.WAYPOINTS)
        out = tmp_path / "run"
        request = RunRequest(options=options, connect=[ours], out=out, parameters={"MPC_ACC_HOR": 2.5})
        result = fly(find_mission("lissajous"), request)
    finally:
        elsewhere.end.set()
        elsewhere.join()
    assert result.outcome == "completed", result.reason
    assert result.summary["autopilot"] == flavour
    assert result.summary["vehicles"][0]["error_reference"] == "estimate"
    assert result.summary["path_rms_error_m"] < 1.0
    assert autopilot.parameters["MPC_ACC_HOR"][0] == 2.5


def test_a_stranger_on_the_port_is_not_spoken_to():
    async def script():
        link = open_link("udpin:127.0.0.1:0")
        vehicle, stranger = (open_link(f"udpout:127.0.0.1:{link.port}") for _ in range(2))  # type: ignore[attr-defined]
        stranger.send(b"\xfd\x09 who is there? " * 4)
        vehicle.send(FrameEncoder(1, 1).encode(attitude(1)))
        async with Connection(link, TelemetryClock()) as connection:
            while connection.latest("ATTITUDE", 1) is None or not vehicle.receive():
                await asyncio.sleep(0.01)
            assert len(link.peers) == 1
            assert stranger.receive() == []
        vehicle.close()
        stranger.close()

    asyncio.run(asyncio.wait_for(script(), 20.0))


def packet_order(*, acts):
    """What a recorder, and a listener of the first of two messages in a packet, see in turn."""
    seen = []

    class Recorder:
        def record(self, packet, time_us):
            seen.extend(frame.message_id for frame in packet)

    Recorder.acts = acts  # type: ignore[attr-defined]

    async def script(connection, send):
        connection.listen("ATTITUDE", lambda _: seen.append("listener"), in_order=False)
        send(attitude(1), dialect.MAVLink_system_time_message(0, 1))

    on_memory(script, recorder=Recorder())
    return [known for known in seen if known != 0]  # without our heartbeat


def test_a_packet_is_split_for_a_recorder_that_acts_on_frames():
    assert packet_order(acts=False) == [30, 2, "listener"]
    assert packet_order(acts=True) == [30, "listener", 2]
