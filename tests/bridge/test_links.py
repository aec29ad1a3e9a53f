"""Links: one set of tests for every kind, then what is special to each."""

import os
import pty
import random
import select
import socket
import struct
import tty
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge import links
from autopilot_bridge.errors import AddressError, LinkError
from autopilot_bridge.links import (
    ReplayLog,
    SerialLink,
    SerialPort,
    TcpClient,
    TcpClientLink,
    TcpServer,
    TcpServerLink,
    UdpClient,
    UdpLink,
    UdpPeer,
    UdpServer,
    memory_pair,
)
from autopilot_bridge.mavlink import FrameEncoder, FrameParser
from autopilot_bridge.tlog import TlogWriter

DEADLINE_MS = 5000
open_link: Any = links.open_link  # each test knows the class of its link


class WallClock:
    """A wall clock that stands still until set otherwise."""

    def __init__(self):
        self.now_s = 100.0

    def __call__(self):
        return self.now_s


def wait_readable(link):
    """Until the operating system has something for the link (a new peer counts)."""
    if not link.filenos():
        return
    poll = select.poll()
    for fileno in link.filenos():
        poll.register(fileno, select.POLLIN)
    assert poll.poll(DEADLINE_MS), f"nothing arrived at {link.description}"


def receive(link, size):
    """At least `size` bytes, by peer."""
    by_peer = {}
    while sum(map(len, by_peer.values())) < size:
        wait_readable(link)
        for peer, data in link.receive():
            by_peer[peer] = by_peer.get(peer, b"") + data
    return by_peer


def accept(server, clients=1):
    while len(server.peers) < clients:
        wait_readable(server)
        server.receive()


class SerialCable:
    """A pseudo terminal: one side as a serial device, the other as a raw file."""

    def __init__(self):
        self.far, self._near = pty.openpty()
        tty.setraw(self._near)
        os.set_blocking(self.far, False)
        self.device = os.ttyname(self._near)

    def unplug(self):
        os.close(self.far)
        os.close(self._near)


@pytest.fixture(params=["memory", "udp", "udppeer", "tcp"])
def link_pair(request):
    """(a, b): what a sends, b receives; b has received of a."""
    if request.param == "memory":
        a, b = memory_pair()
    elif request.param == "udp":
        b = open_link("udpin:0")
        a = open_link(UdpClient("127.0.0.1", b.port))
        a.send(b"hello")
        receive(b, 5)
    elif request.param == "udppeer":
        a = open_link("udpin:0")
        b = open_link(UdpPeer("127.0.0.1", 0, "127.0.0.1", a.port))
        b.send(b"hello")
        receive(a, 5)
    else:
        b = open_link("tcpin:0")
        a = open_link(TcpClient("127.0.0.1", b.port))
        accept(b)
    yield a, b
    a.close()
    b.close()


def test_bytes_go_both_ways_in_order(link_pair):
    a, b = link_pair
    frames = [bytes([index]) * 30 for index in range(50)]
    for frame in frames:
        a.send(frame)
    assert receive(b, 1500) == {b.peers[0]: b"".join(frames)}
    for frame in frames:
        b.send(frame, to=b.peers[0])
    assert receive(a, 1500) == {a.peers[0]: b"".join(frames)}
    assert a.counters.bytes_out >= 1500 and b.counters.bytes_in >= 1500
    assert not a.congested and a.description and b.description


def test_receiving_nothing(link_pair):
    a, b = link_pair
    assert a.receive() == [] and b.receive() == []


def test_a_closed_link_is_quiet(link_pair):
    a, b = link_pair
    a.close()
    a.close()
    a.send(b"x")
    assert a.receive() == [] and a.filenos() == ()
    for _ in range(3):
        b.send(b"y" * 100)
        b.receive()


def test_garbage_on_every_link_is_accounted_for(link_pair):
    a, b = link_pair
    chance = random.Random(5)
    good = FrameEncoder(1, 1).encode(dialect.MAVLink_statustext_message(6, b"good"))
    parser = FrameParser()
    fed = 0
    for _ in range(100):
        piece = chance.randbytes(500) + good
        a.send(piece)
        fed += len(piece)
        for data in receive(b, len(piece)).values():
            parser.feed(data)
    counters = parser.counters
    assert counters.bytes_in == fed == counters.bytes_framed + counters.bytes_dropped + parser.pending_bytes
    assert counters.frames > 50


# UDP


def test_udp_server_sends_to_all_who_spoke():
    server = open_link("udpin:0")
    clients = [open_link(UdpClient("127.0.0.1", server.port)) for _ in range(3)]
    server.send(b"not received")
    assert server.counters.writes == 0
    for index, client in enumerate(clients):
        client.send(bytes([index]))
    received = receive(server, 3)
    assert sorted(received.values()) == [b"\0", b"\1", b"\2"]
    server.send(b"all")
    for client in clients:
        assert list(receive(client, 3).values()) == [b"all"]
    one = next(peer for peer, data in received.items() if data == b"\1")
    server.send(b"one", to=one)
    assert list(receive(clients[1], 3).values()) == [b"one"]
    assert clients[0].receive() == [] and clients[2].receive() == []


def test_udp_server_forgets_silent_peers():
    clock = WallClock()
    server = UdpLink(UdpServer("127.0.0.1", 0), monotonic=clock)
    old, new = (open_link(UdpClient("127.0.0.1", server.port)) for _ in range(2))
    old.send(b"old")
    receive(server, 3)
    clock.now_s += 20.0
    new.send(b"new")
    receive(server, 3)
    assert len(server.peers) == 2
    clock.now_s += 15.0
    server.send(b"still there?")
    assert len(server.peers) == 1 and server.counters.disconnects == 1
    assert list(receive(new, 12).values()) == [b"still there?"]


def test_udp_server_keeps_those_who_were_there_before_a_crowd():
    clock = WallClock()
    server = UdpLink(UdpServer("127.0.0.1", 0), monotonic=clock)
    clients = [open_link(UdpClient("127.0.0.1", server.port)) for _ in range(40)]
    for client in clients:
        clock.now_s += 0.01
        client.send(b"x")
        receive(server, 1)
    assert len(server.peers) == 32 and server.counters.connects == 32  # the others are received all the same
    first, clients[:1] = server.peers[0], []
    clock.now_s += 5.0
    for client in clients[:31]:
        client.send(b"x")
        receive(server, 1)
    clients[-1].send(b"x")
    receive(server, 1)
    assert first not in server.peers and len(server.peers) == 32  # whoever is silent makes room


def test_udp_links_forget_the_peers_that_they_are_commanded_to():
    server = open_link("udpin:0")
    stranger = open_link(UdpClient("127.0.0.1", server.port))
    stranger.send(b"?")
    ((peer, _),) = receive(server, 1).items()
    server.forget(peer)
    server.forget(peer)
    assert server.peers == () and server.counters.disconnects == 1
    expected = open_link("udpin:0")
    vehicle = open_link(UdpPeer("127.0.0.1", 0, "127.0.0.1", expected.port))
    stranger = open_link(UdpClient("127.0.0.1", vehicle.port))
    stranger.send(b"?")
    ((peer, _),) = receive(vehicle, 1).items()
    assert vehicle.peers == (peer,)
    vehicle.forget(peer)
    assert vehicle.peers == (("127.0.0.1", expected.port),)


def test_tcp_clients_are_bounded_and_those_who_talk_stay():
    clock = WallClock()
    server = TcpServerLink(TcpServer("127.0.0.1", 0), monotonic=clock)
    talker = socket.create_connection(("127.0.0.1", server.port))
    accept(server)
    crowd = []
    while len(server.peers) < 32:
        crowd.append(socket.create_connection(("127.0.0.1", server.port)))
        accept(server, len(server.peers) + 1)
    crowd.append(socket.create_connection(("127.0.0.1", server.port)))
    wait_readable(server)
    server.receive()
    assert crowd[-1].recv(1) == b"" and len(server.peers) == 32
    clock.now_s += 5.0
    talker.send(b"x")
    receive(server, 1)
    crowd.append(socket.create_connection(("127.0.0.1", server.port)))
    before = set(server.peers)
    while set(server.peers) == before:
        wait_readable(server)
        server.receive()
    assert talker.getsockname()[:2] in server.peers and len(server.peers) == 32
    for client in (talker, *crowd):
        client.close()


def test_tcp_client_that_never_reads_delays_no_other_and_is_parted_from():
    clock = WallClock()
    server = TcpServerLink(TcpServer("127.0.0.1", 0), monotonic=clock)
    deaf = socket.create_connection(("127.0.0.1", server.port))
    accept(server)
    while not server.congested:
        server.send(bytes(60_000))
    clock.now_s += 2.5
    assert not server.congested
    server.receive()
    assert len(server.peers) == 1
    clock.now_s += 60.0
    server.receive()
    assert server.peers == () and server.counters.disconnects == 1
    deaf.close()


def test_udp_peer_sends_first_and_takes_the_first_sender_for_its_partner():
    expected, other, third = (open_link("udpin:0") for _ in range(3))
    vehicle = open_link(UdpPeer("127.0.0.1", 0, "127.0.0.1", expected.port))
    vehicle.send(b"unasked")
    assert list(receive(expected, 7).values()) == [b"unasked"]
    speaker = open_link(UdpClient("127.0.0.1", vehicle.port))
    speaker.send(b"hi")
    receive(vehicle, 2)
    vehicle.send(b"answer")
    assert list(receive(speaker, 6).values()) == [b"answer"]
    late = open_link(UdpClient("127.0.0.1", vehicle.port))
    late.send(b"me too")
    assert list(receive(vehicle, 6).values()) == [b"me too"]  # received, but the partner stays
    vehicle.send(b"again")
    assert list(receive(speaker, 5).values()) == [b"again"]
    assert late.receive() == [] and other.receive() == [] and third.receive() == []


def test_udp_refusal_is_counted_and_the_link_lives_on():
    server = open_link("udpin:0")
    port = server.port
    client = open_link(UdpClient("127.0.0.1", port))
    server.close()
    for _ in range(20):
        client.send(b"any?")
        client.receive()
    assert client.counters.errors > 0
    server = open_link(UdpServer("127.0.0.1", port))
    while not server.peers:
        client.send(b"now")
        server.receive()
    server.send(b"here")
    assert list(receive(client, 4).values()) == [b"here"]


# TCP


def test_tcp_server_keeps_clients_apart():
    server = open_link("tcpin:0")
    clients = [open_link(TcpClient("127.0.0.1", server.port)) for _ in range(3)]
    frame = FrameEncoder(1, 1).encode(dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3))
    for client in clients:
        client.send(frame[:7])
    received = receive(server, 21)
    for client in clients:
        client.send(frame[7:])
    for peer, data in receive(server, 3 * len(frame) - 21).items():
        received[peer] += data
    assert list(received.values()) == [frame] * 3 and set(received) == set(server.peers)
    server.send(b"all")
    for client in clients:
        assert list(receive(client, 3).values()) == [b"all"]
    clients[0].close()
    while len(server.peers) == 3:
        wait_readable(server)
        server.receive()
    server.send(b"left")
    assert list(receive(clients[2], 4).values()) == [b"left"]
    gone = next(iter(set(received) - set(server.peers)))
    server.send(b"to no peer", to=gone)
    assert server.counters.dropped == 1


def test_tcp_slow_reader_loses_whole_frames_only():
    server = open_link("tcpin:0")
    slow = socket.create_connection(("127.0.0.1", server.port))
    accept(server)
    encoder = FrameEncoder(1, 1)
    sent = 0
    while server.counters.dropped < 100:
        server.send(encoder.encode(dialect.MAVLink_statustext_message(6, b"x" * 50)))
        sent += 1
    assert server.congested
    slow.setblocking(False)
    parser = FrameParser()
    frames = []
    while len(frames) < sent - server.counters.dropped:
        server.receive()  # moves the backlog along
        select.select([slow], [], [], DEADLINE_MS / 1000)
        frames += parser.feed(slow.recv(1 << 20))
    assert parser.counters.bytes_dropped == 0 and parser.pending_bytes == 0
    assert not server.congested
    slow.close()


def test_tcp_client_reconnects():
    clock = WallClock()
    server = open_link("tcpin:0")
    port = server.port
    client = TcpClientLink(TcpClient("127.0.0.1", port), monotonic=clock)
    accept(server)
    server.close()
    while client.connected:
        wait_readable(client)
        client.receive()
    client.send(b"lost")
    assert client.counters.dropped == 1 and client.peers == ()
    clock.now_s += 2.0
    client.receive()  # refused: no listener
    clock.now_s += 2.0
    client.receive()
    assert not client.connected and client.counters.errors >= 1
    server = TcpServerLink(TcpServer("127.0.0.1", port))
    while not client.connected:
        clock.now_s += 2.0
        client.receive()
    accept(server)
    client.send(b"back")
    assert list(receive(server, 4).values()) == [b"back"]
    assert client.counters.connects == 2


def test_a_server_that_hangs_up_at_once_is_reported_as_one_that_can_not_be_opened(monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        opened = socket.create_connection(("127.0.0.1", port))
        accepted, _ = listener.accept()
        accepted.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        accepted.close()  # a reset
        assert select.select((opened,), (), (), DEADLINE_MS * 1e-3)[0]
        monkeypatch.setattr(socket, "create_connection", lambda *_: opened)
        with pytest.raises(LinkError, match=rf"tcp:127\.0\.0\.1:{port}.*hung up at once"):
            TcpClientLink(TcpClient("127.0.0.1", port))
    assert opened.fileno() == -1


# Serial


def test_serial_line_both_ways_and_unplugged():
    cable = SerialCable()
    clock = WallClock()
    link = SerialLink(SerialPort(cable.device, 57600), monotonic=clock)
    os.write(cable.far, b"from the vehicle")
    assert receive(link, 16) == {(cable.device, 0): b"from the vehicle"}
    link.send(b"to the vehicle")
    select.select([cable.far], [], [], DEADLINE_MS / 1000)
    assert os.read(cable.far, 100) == b"to the vehicle"
    cable.unplug()
    wait_readable(link)
    link.receive()
    assert not link.connected and link.counters.disconnects == 1 and link.peers == ()
    link.send(b"lost")
    clock.now_s += 2.0
    assert link.receive() == []  # looked for it: still gone
    assert link.counters.dropped == 1 and link.filenos() == ()
    link.close()


def test_serial_slow_line_drops_whole_frames():
    cable = SerialCable()
    link = SerialLink(SerialPort(cable.device))
    encoder = FrameEncoder(1, 1)
    sent = 0
    while link.counters.dropped < 10:
        link.send(encoder.encode(dialect.MAVLink_statustext_message(6, b"y" * 50)))
        sent += 1
    assert link.congested
    parser = FrameParser()
    frames = []
    while len(frames) < sent - link.counters.dropped:
        link.receive()
        select.select([cable.far], [], [], DEADLINE_MS / 1000)
        frames += parser.feed(os.read(cable.far, 65536))
    assert parser.counters.bytes_dropped == 0
    link.close()
    cable.unplug()


# Replay


def test_replay_is_paced_by_the_clock_and_hears_nothing(tmp_path):
    path = tmp_path / "flight.tlog"
    encoder = FrameEncoder(1, 1)
    frames = [encoder.encode(dialect.MAVLink_system_time_message(1, index)) for index in range(5)]
    with TlogWriter(path) as log:
        for index, raw in enumerate(frames):
            log.write(1_700_000_000_000_000 + index * 100_000, raw)
    now_us = [5_000_000]
    link = open_link(str(path), time_us=lambda: now_us[0])
    assert link.description == str(ReplayLog(path))
    assert [data for _, data in link.receive()] == frames[:1]
    now_us[0] += 250_000
    assert [data for _, data in link.receive()] == frames[1:3]
    link.send(b"hello?")
    assert link.counters.dropped == 1 and not link.finished
    now_us[0] += 10_000_000
    assert [data for _, data in link.receive()] == frames[3:]
    assert link.finished and link.receive() == []


# What can't be opened


@pytest.mark.parametrize("kind", [UdpServer, TcpServer])
def test_a_busy_port_says_what_to_do(kind):
    first = open_link(kind("127.0.0.1", 0))
    with pytest.raises(LinkError) as caught:
        open_link(kind("127.0.0.1", first.port))
    message = str(caught.value)
    assert str(kind("127.0.0.1", first.port)) in message and "in use" in message and "port" in message


def test_nothing_listens():
    server = open_link("tcpin:0")
    port = server.port
    server.close()
    with pytest.raises(LinkError, match=rf"tcp:127\.0\.0\.1:{port}.*nothing listens there"):
        open_link(f"tcp:127.0.0.1:{port}")


@pytest.mark.parametrize(
    ("address", "complaint"),
    [
        ("serial:/dev/no-such-device:57600", "there is no such device"),
        ("udpout:no such host:1", "no such host"),
        ("udpin:192.0.2.7:14550", "no interface of this machine"),
        ("tcpin:192.0.2.7:5760", "no interface of this machine"),
    ],
)
def test_other_reasons(address, complaint):
    with pytest.raises((LinkError, AddressError), match=complaint):
        open_link(address)


def test_a_serial_port_in_use_says_so():
    cable = SerialCable()
    first = SerialLink(SerialPort(cable.device))
    with pytest.raises(LinkError, match="another program has it open"):
        SerialLink(SerialPort(cable.device))
    first.close()
    cable.unplug()


def test_servers_listen_on_loopback_by_default():
    assert open_link("udpin:0").host == "127.0.0.1"
    assert open_link("tcpin:0").host == "127.0.0.1"
