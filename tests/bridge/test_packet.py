"""Packets: taken apart into the frames that they were made of."""

import pytest

from autopilot_bridge.mavlink import Frame, FrameEncoder, FrameParser, Packet, dialect


def frames(system_id, count, first=0):
    encoder = FrameEncoder(system_id, 1)
    messages = [dialect.MAVLink_system_time_message(0, first + k) for k in range(count)]
    return [Frame.of(encoder.encode(message)) for message in messages]


def test_bytes_are_taken_apart_into_what_a_parser_finds():
    made = [*frames(7, 3), *frames(7, 1, first=1 << 20)]
    data = b"".join(frame.raw for frame in made)
    packet = Packet(data, [frame.message_id for frame in made])
    assert packet.frames == FrameParser().feed(data) == made
    assert all(packet.frame(k) is frame for k, frame in enumerate(packet.frames))
    assert packet.sender == (7, 1) and len(packet) == 4


def test_one_frame_of_a_packet_is_the_same_object_before_and_after_the_others():
    made = frames(7, 3)
    packet = Packet(b"".join(frame.raw for frame in made), tuple(frame.message_id for frame in made))
    newest = packet.newest(made[0].message_id)
    assert newest == made[2] and packet.frames[2] is newest is packet.frame(2)
    assert packet.part(1, 3).frames == made[1:]


def test_the_newest_of_several_frames_of_one_message():
    made = frames(7, 3)
    packet = Packet.of(made)
    assert packet.newest(made[0].message_id) is made[2]


def test_a_part_has_the_bytes_of_its_frames():
    made = frames(7, 3)
    part = Packet.of(made).part(1, 3)
    assert part.frames == made[1:] and part.data == made[1].raw + made[2].raw
    whole = Packet.of(made)
    assert whole.part(0, 3) is whole


def test_frames_of_several_senders_keep_their_order():
    made = [*frames(1, 2), *frames(2, 1), *frames(1, 1)]
    packets = list(Packet.by_sender(made))
    assert [packet.sender for packet in packets] == [(1, 1), (2, 1), (1, 1)]
    assert [frame for packet in packets for frame in packet] == made
    assert list(Packet.by_sender([])) == []


@pytest.mark.parametrize("version", [1, 2])
def test_any_version(version):
    raw = frames(9, 1)[0].raw
    if version == 1:
        message = dialect.MAVLink_system_time_message(1, 2)
        link = dialect.MAVLink(None, srcSystem=9, srcComponent=1)
        raw = bytes(message.pack(link, force_mavlink1=True))
    packet = Packet.of_one(raw)
    assert packet.sender == (9, 1) and packet.data == raw and packet.frames[0].version == version
