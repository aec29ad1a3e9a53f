"""Message signing against pymavlink's implementation, and against those who have no key."""

import hashlib
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge.errors import SigningKeyError
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, LinkSigning, SigningKey, SigningState
from autopilot_bridge.mavlink.signing import (
    DAY,
    INTERNAL,
    MAX_STREAMS,
    MAX_TIMESTAMP,
    MINUTE,
    RADIO,
    REQUIRED,
    TRUSTED,
    UNSIGNED_TOO,
    Refusal,
    signing_time,
)

KEY = SigningKey.from_passphrase("a secret")
OTHER_KEY = SigningKey.from_passphrase("another")
NOW = signing_time(1_735_689_600_000_000)


def heartbeat(custom_mode=0):
    return dialect.MAVLink_heartbeat_message(2, 12, 81, custom_mode, 3, 3)


def command(value=0.0):
    return dialect.MAVLink_command_long_message(1, 1, 400, 0, value, 0, 0, 0, 0, 0, 0)


def state(key=KEY, now=NOW, **more):
    return SigningState(key, clock=lambda: now, **more)


def link(policy=REQUIRED, link_id=0, **more):
    return LinkSigning(state(**more), link_id=link_id, policy=policy)


def frames_of(data):
    return FrameParser().feed(data)


def pymavlink_with(key=KEY, timestamp=NOW, link_id=0, source=(255, 190)):
    made = dialect.MAVLink(None, *source)
    made.signing.secret_key = key.secret
    made.signing.timestamp = timestamp
    made.signing.link_id = link_id
    made.signing.sign_outgoing = True
    return made


def signed(sender, message=None):
    """A frame of pymavlink's."""
    return bytes((message or command()).pack(sender))


# against pymavlink


def test_golden_bytes():
    """A frame written out by hand from the guide's description."""
    frame = FrameEncoder(1, 1).encode(heartbeat())
    signature_of = LinkSigning(state(now=0x010203040506), link_id=7).sign(frame)
    head = bytearray(frame[:-2])
    head[2] = 1
    crc = dialect.x25crc(bytes(head[1:]) + bytes([dialect.MAVLink_heartbeat_message.crc_extra])).crc
    body = bytes(head) + crc.to_bytes(2, "little") + bytes([7]) + bytes.fromhex("060504030201")
    assert signature_of == body + hashlib.sha256(KEY.secret + body).digest()[:6]


@given(st.integers(0, 2**32 - 1), st.integers(0, 255), st.integers(1, MAX_TIMESTAMP))
def test_frames_are_those_of_pymavlink(custom_mode, link_id, timestamp):
    ours = LinkSigning(state(now=timestamp), link_id=link_id).sign(
        FrameEncoder(255, 190).encode(heartbeat(custom_mode))
    )
    theirs = signed(pymavlink_with(timestamp=timestamp, link_id=link_id), heartbeat(custom_mode))
    assert ours == theirs


def test_pymavlink_takes_what_we_sign():
    ours, encoder, theirs = link(), FrameEncoder(1, 1), pymavlink_with()
    packet = ours.sign(b"".join(encoder.encode(heartbeat(n)) for n in range(20)))
    assert ours.counters.sent == 20
    frames = frames_of(packet)
    assert len(frames) == 20
    for frame in frames:
        assert theirs.decode(bytearray(frame.raw)).get_signed()


def test_we_take_what_pymavlink_signs():
    ours, theirs = link(), pymavlink_with()
    for n in range(10):
        (frame,) = ours.admit(frames_of(signed(theirs, heartbeat(n))))
        assert frame.signed
    assert ours.counters.verified == 10
    assert ours.counters.refused_frames == 0


# time


def test_timestamps_rise_though_the_clock_stands():
    ours, encoder = link(), FrameEncoder(1, 1)
    stamps = [int.from_bytes(ours.sign(encoder.encode(heartbeat()))[-12:-6], "little") for _ in range(5)]
    assert stamps == list(range(NOW, NOW + 5))


def test_timestamps_rise_whenever_the_clock_ticks():
    rng = random.Random(3)
    clock = [NOW]

    def now():  # may tick between any two looks at it
        clock[0] += rng.randrange(3)
        return clock[0]

    ours, encoder = SigningState(KEY, clock=now), FrameEncoder(1, 1)
    stamps = []
    for _ in range(500):
        stamps.append(int.from_bytes(ours.sign(encoder.encode(heartbeat()), 0)[-12:-6], "little"))
        clock[0] -= rng.randrange(2)
    assert stamps == sorted(set(stamps))


def test_time_never_goes_back():
    clock = [NOW]
    ours = SigningState(KEY, clock=lambda: clock[0])
    first = ours.timestamp
    clock[0] -= 10 * MINUTE
    assert ours.timestamp >= ours.timestamp  # asking changes nothing
    encoder = FrameEncoder(1, 1)
    stamps = [int.from_bytes(ours.sign(encoder.encode(heartbeat()), 0)[-12:-6], "little") for _ in range(3)]
    clock[0] = NOW
    stamps.append(int.from_bytes(ours.sign(encoder.encode(heartbeat()), 0)[-12:-6], "little"))
    assert stamps == sorted(set(stamps))
    ours.set_key(OTHER_KEY, 5)
    assert ours.timestamp >= max(first - 10 * MINUTE, stamps[-1])


def test_time_follows_a_verified_frame_and_no_other():
    ours = link()
    late = NOW + 1000 * MINUTE
    ours.admit(frames_of(signed(pymavlink_with(OTHER_KEY, late))))
    assert ours.state.timestamp == NOW
    ours.admit(frames_of(signed(pymavlink_with(timestamp=late))))
    assert ours.state.timestamp == late


def test_time_is_given_for_storage_and_taken_from_it():
    saved, clock = [], [NOW]
    ours = SigningState(KEY, clock=lambda: clock[0], on_save=lambda s: saved.append((s.key, s.timestamp)))
    assert saved == []
    encoder = FrameEncoder(1, 1)
    for _ in range(200):
        clock[0] += MINUTE // 60
        ours.sign(encoder.encode(heartbeat()), 0)
    assert 6 <= len(saved) <= 7  # twice a minute
    again = SigningState(saved[-1][0], clock=lambda: 0, timestamp=saved[-1][1] + MINUTE)
    assert again.timestamp > clock[0]
    ours.set_key(OTHER_KEY)
    assert saved[-1][0] == OTHER_KEY


def test_the_last_timestamp_is_not_the_first_again():
    ours, encoder = link(now=MAX_TIMESTAMP), FrameEncoder(1, 1)
    for _ in range(3):
        assert ours.sign(encoder.encode(heartbeat()))[-12:-6] == b"\xff" * 6


@pytest.mark.parametrize(("unix_us", "timestamp"), [(0, 0), (1_420_070_400_000_010, 1), (1 << 62, 2**48 - 1)])
def test_epoch(unix_us, timestamp):
    assert signing_time(unix_us) == timestamp


# who is refused


def refused(ours, frame_bytes):
    """Why a frame was refused; None when it was taken."""
    before = dict(ours.counters.refused)
    if ours.admit(frames_of(frame_bytes)):
        return None
    (reason,) = [reason for reason in Refusal if ours.counters.refused[reason] != before[reason]]
    return reason


def test_unsigned_frames_are_refused():
    ours = link()
    assert refused(ours, FrameEncoder(255, 190).encode(command())) is Refusal.UNSIGNED


def test_mavlink_1_is_refused():
    message = heartbeat()
    made = dialect.MAVLink(None, 255, 190)
    assert refused(link(), bytes(message.pack(made, force_mavlink1=True))) is Refusal.UNSIGNED


@pytest.mark.parametrize("message_id", ["radio_status", "radio"])
def test_a_radio_has_no_key(message_id):
    message = getattr(dialect, f"MAVLink_{message_id}_message")(100, 100, 50, 10, 10, 0, 0)
    ours = link(RADIO)
    assert refused(link(), FrameEncoder(51, 68).encode(message)) is Refusal.UNSIGNED
    assert refused(ours, FrameEncoder(51, 68).encode(message)) is None
    assert ours.counters.tolerated == 1


def test_another_key_is_refused():
    assert refused(link(), signed(pymavlink_with(OTHER_KEY))) is Refusal.BAD_SIGNATURE


@given(st.integers(0, 44), st.integers(0, 7))
def test_a_changed_bit_is_refused(position, bit):
    frame = bytearray(signed(pymavlink_with()))
    frame[position % len(frame)] ^= 1 << bit
    assert link().admit(frames_of(bytes(frame))) == []


def test_a_replayed_frame_is_refused_on_every_link():
    shared = state()
    first, second = (LinkSigning(shared, link_id=number) for number in (0, 1))
    recorded = signed(pymavlink_with())
    assert refused(first, recorded) is None
    assert refused(first, recorded) is Refusal.REPLAYED
    assert refused(second, recorded) is Refusal.REPLAYED


def test_an_older_frame_of_a_stream_is_refused():
    ours = link()
    assert refused(ours, signed(pymavlink_with(timestamp=NOW + 10))) is None
    assert refused(ours, signed(pymavlink_with(timestamp=NOW + 9))) is Refusal.REPLAYED
    assert refused(ours, signed(pymavlink_with(timestamp=NOW + 9, source=(254, 190)))) is None
    assert refused(ours, signed(pymavlink_with(timestamp=NOW + 9, link_id=3))) is None


def test_a_new_stream_may_be_a_minute_behind():
    assert refused(link(), signed(pymavlink_with(timestamp=NOW - MINUTE))) is None
    assert refused(link(), signed(pymavlink_with(timestamp=NOW - MINUTE - 1))) is Refusal.OLD


def test_a_forged_late_timestamp_shuts_no_client_out():
    ours = link()
    assert refused(ours, signed(pymavlink_with(OTHER_KEY, NOW + 1000 * MINUTE))) is Refusal.BAD_SIGNATURE
    assert refused(ours, signed(pymavlink_with())) is None


def test_streams_are_bounded():
    ours = link()
    for number in range(MAX_STREAMS):
        assert refused(ours, signed(pymavlink_with(source=(1 + number // 200, 1 + number % 200)))) is None
    assert refused(ours, signed(pymavlink_with(source=(200, 1)))) is Refusal.TOO_MANY_STREAMS


def test_a_new_key_begins_anew():
    ours = link()
    ours.admit(frames_of(signed(pymavlink_with(timestamp=NOW + 100))))
    ours.state.set_key(OTHER_KEY)
    assert refused(ours, signed(pymavlink_with(timestamp=NOW + 200))) is Refusal.BAD_SIGNATURE
    assert refused(ours, signed(pymavlink_with(OTHER_KEY, NOW + 100))) is None


# policies


@pytest.mark.parametrize(
    ("policy", "unsigned", "wrong"),
    [(REQUIRED, 0, 0), (RADIO, 0, 0), (UNSIGNED_TOO, 1, 0), (TRUSTED, 1, 1), (INTERNAL, 1, 1)],
)
def test_policies(policy, unsigned, wrong):
    assert len(link(policy).admit(frames_of(FrameEncoder(255, 190).encode(command())))) == unsigned
    admitted = link(policy).admit(frames_of(signed(pymavlink_with(OTHER_KEY))))
    assert len(admitted) == wrong
    if policy is TRUSTED:
        assert not admitted[0].signed  # the signature is not accepted


def test_without_a_key_all_is_taken_and_nothing_signed():
    ours = link(key=None)
    assert not ours.signs
    frames = frames_of(signed(pymavlink_with()) + FrameEncoder(1, 1).encode(heartbeat()))
    assert ours.admit(frames) == frames
    assert not link(INTERNAL).signs


# keys


@pytest.mark.parametrize(
    ("content", "key"),
    [
        (bytes(range(32)), bytes(range(32))),
        (bytes(range(32)).hex().encode() + b"\n", bytes(range(32))),
        (b"correct horse\r\n", hashlib.sha256(b"correct horse").digest()),
        ("Zündschlüssel".encode(), hashlib.sha256("Zündschlüssel".encode()).digest()),
        (b"x" * 32, hashlib.sha256(b"x" * 32).digest()),
    ],
)
def test_key_files(content, key):
    assert SigningKey.parse(content).secret == key


@pytest.mark.parametrize(
    "content", [b"", b"\n", bytes(32), b"two\nlines", b"\xff\xfe\x00" * 5, b"a" * 5000, b"0" * 64]
)
def test_no_key_is_reported_without_what_was_read(content):
    with pytest.raises(SigningKeyError) as error:
        SigningKey.parse(content)
    assert "accepted" in str(error.value) or "zeros" in str(error.value)


def test_a_key_does_not_show():
    assert KEY.secret.hex()[:8] not in repr(KEY) and repr(KEY.secret)[2:10] not in repr(KEY)


def test_a_timestamp_of_the_far_future_shuts_nobody_out():
    ours = LinkSigning(SigningState(KEY, clock=lambda: NOW, lead=DAY), link_id=0)
    assert refused(ours, signed(pymavlink_with(timestamp=MAX_TIMESTAMP - 1))) is Refusal.AHEAD
    ours.state.set_key(OTHER_KEY, MAX_TIMESTAMP)
    ours.state.set_key(KEY, NOW + DAY + 1)
    assert ours.state.timestamp == NOW
    assert refused(ours, signed(pymavlink_with(timestamp=NOW))) is None
    assert ours.counters.reasons == "1 ahead of the clock"


def test_a_stored_timestamp_of_the_far_future_is_not_used():
    assert SigningState(KEY, clock=lambda: NOW, timestamp=MAX_TIMESTAMP, lead=DAY).timestamp == NOW


def test_a_clock_that_is_a_little_ahead_is_accepted():
    ours = LinkSigning(SigningState(KEY, clock=lambda: NOW, lead=DAY), link_id=0)
    assert refused(ours, signed(pymavlink_with(timestamp=NOW + DAY))) is None
    assert ours.state.timestamp == NOW + DAY
