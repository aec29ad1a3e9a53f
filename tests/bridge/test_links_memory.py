"""Memory links, and links with faults."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.links import Impairment, LossyLink, memory_pair
from autopilot_bridge.mavlink import Frame, FrameEncoder, Packet, dialect


class World:
    """Simulated time."""

    def __init__(self):
        self.now_us = 0

    def __call__(self):
        return self.now_us


def lossy(impairment, seed=1):
    world = World()
    a, b = memory_pair()
    return LossyLink(a, impairment, generator=np.random.default_rng(seed), time_us=world), b, world


def pieces(count):
    return [index.to_bytes(2, "big") for index in range(count)]


def payloads(link):
    return [data for _, data in link.receive()]


def test_packets_are_handed_over_to_an_end_that_takes_them():
    encoder = FrameEncoder(1, 1)
    packet = Packet.of(
        [Frame.of(encoder.encode(dialect.MAVLink_system_time_message(7, 8))) for _ in range(2)]
    )
    received = []
    a, b = memory_pair()
    assert not a.takes_packets
    b.on_packet = received.append
    assert a.takes_packets and not b.takes_packets
    a.send_packet(packet)
    assert received == [packet] and b.receive() == []
    size = len(packet.data)
    assert (a.counters.bytes_out, b.counters.bytes_in, a.counters.writes) == (size, size, 1)
    b.close()
    assert not a.takes_packets


def test_push_delivery_happens_at_once():
    received = []
    a, b = memory_pair("vehicle", "mission", on_receive_b=received.append)
    a.send(b"now")
    assert received == [b"now"] and b.receive() == []
    b.send(b"back")
    assert a.receive() == [(("mission", 0), b"back")]
    b.close()
    a.send(b"late")
    assert received == [b"now"] and a.counters.dropped == 1 and a.peers == ()


@given(st.lists(st.binary(min_size=1), max_size=20))
def test_memory_keeps_everything_in_order(data):
    a, b = memory_pair()
    for piece in data:
        a.send(piece)
    assert payloads(b) == data
    assert a.counters.bytes_out == b.counters.bytes_in == sum(map(len, data))


def test_no_impairment_changes_nothing():
    link, far, _ = lossy(Impairment())
    for piece in pieces(100):
        link.send(piece)
        far.send(piece)
    assert payloads(far) == pieces(100) and payloads(link) == pieces(100)


def test_loss_is_of_the_right_size():
    link, far, _ = lossy(Impairment(loss=0.3))
    for piece in pieces(5000):
        link.send(piece)
    arrived = payloads(far)
    assert arrived == sorted(arrived)
    assert 0.67 < len(arrived) / 5000 < 0.73
    assert link.counters.dropped == 5000 - len(arrived)


def test_delay_and_jitter_keep_the_order():
    link, far, world = lossy(Impairment(delay_s=0.1, jitter_s=0.05))
    link.send(b"first")
    world.now_us = 99_999
    link.update()
    assert payloads(far) == []
    world.now_us = 150_000
    link.update()
    assert payloads(far) == [b"first"]
    arrived = []
    for piece in pieces(200):
        world.now_us += 1000
        link.send(piece)
        arrived += payloads(far)
    world.now_us += 150_000
    link.update()
    assert arrived + payloads(far) == pieces(200)


def test_duplicates_and_swaps():
    link, far, _ = lossy(Impairment(duplicate=0.2, reorder=0.2))
    for piece in pieces(1000):
        far.send(piece)
    arrived = payloads(link)
    assert arrived != sorted(arrived)
    assert set(pieces(1000)) - set(arrived) <= {pieces(1000)[-1]}
    assert 1100 < len(arrived) < 1300


def test_same_seed_same_faults():
    impairment = Impairment(loss=0.1, duplicate=0.1, reorder=0.1, delay_s=0.02, jitter_s=0.05)

    def run(seed):
        link, far, world = lossy(impairment, seed)
        received = []
        for piece in pieces(300):
            world.now_us += 4000
            link.send(piece)
            received.append((world.now_us, payloads(far)))
        return received

    assert run(7) == run(7) != run(8)


@pytest.mark.parametrize(
    ("values", "complaint"), [({"loss": 1.5}, "loss 1.5"), ({"delay_s": -1.0}, "delay_s -1.0")]
)
def test_impossible_impairments_are_named(values, complaint):
    with pytest.raises(ValueError, match=complaint):
        Impairment(**values)
