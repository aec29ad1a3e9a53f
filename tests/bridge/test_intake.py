"""Bounded work for each peer of a link: floods cost their sender."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge.mavlink import FrameEncoder, Intake, LinkSigning, SigningKey, SigningState
from autopilot_bridge.mavlink.intake import INBOX_BYTES, MAX_PEERS, SHARE, TOTAL

FRAME_WORK = 20


def command(sender=255):
    return FrameEncoder(sender, 190).encode(
        dialect.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
    )


def taken_until(intake, peer, limit=50):
    """How many calls it takes until a frame of the peer is there."""
    for number in range(1, limit):
        if any(who == peer for who, _ in intake.take([])):
            return number
    raise AssertionError(f"nothing of {peer} in {limit} calls")


def frames_in(served):
    return sum(len(frames) for _, frames in served)


def test_one_peer_has_its_share_of_a_call():
    intake = Intake()
    assert SHARE // FRAME_WORK - 2 <= frames_in(intake.take([("a", command() * 1000)])) <= 80
    assert intake.waiting
    total = 0
    while intake.waiting:
        total += frames_in(intake.take([]))
    assert total > 900 and intake.counters.bytes_dropped == 0


def test_all_peers_together_have_theirs():
    intake = Intake()
    served = intake.take([(peer, command() * 100) for peer in range(30)])
    assert len(served) < 30 and frames_in(served) <= TOTAL / FRAME_WORK + 50
    received = {peer for peer, _ in served}
    for _ in range(15):  # those who waited come first
        received |= {peer for peer, _ in intake.take([])}
    assert received == set(range(30))


@pytest.mark.parametrize(
    "flood",
    [b"\xfe" * 60_000, b"\xfd" * 60_000, random.Random(1).randbytes(60_000), command() * 1400],
    ids=["v1 marks", "v2 marks", "noise", "frames"],
)
def test_a_flood_from_sixty_peers_does_not_hold_up_another(flood):
    intake = Intake()
    intake.take([("true", command())])
    for number in range(60):
        intake.take([(number, flood)])
    intake.take([*((number, flood) for number in range(60)), ("true", command())])
    assert taken_until(intake, "true") <= 30  # an eighth of a second of polls
    assert intake.overrun_bytes == 0 or flood == command() * 1400


def test_an_inbox_is_bounded():
    intake = Intake()
    fed = 0
    for _ in range(100):
        intake.take([("a", command() * 500)])
        fed += len(command()) * 500
    rest = intake.counters.bytes_in + intake.overrun_bytes
    assert 0 <= fed - rest <= INBOX_BYTES


def test_a_crowd_of_strangers_displaces_no_peer():
    intake = Intake()
    whole = command()
    intake.take([("true", whole + whole[:20])])
    for number in range(5000):
        intake.take([(number, b"\xfd\x00nonsense")])
    assert intake.understood("true") and len(intake) == MAX_PEERS
    assert frames_in(intake.take([("true", whole[20:])])) == 1  # what it had begun to say was not forgotten


def test_nor_does_a_crowd_that_speaks_well():
    intake = Intake()
    whole = command()
    intake.take([("true", whole + whole[:20])])
    for number in range(2000):
        intake.take([(number, whole)])
    assert intake.understood("true")
    assert frames_in(intake.take([("true", whole[20:])])) == 1


def test_who_is_silent_for_long_makes_room():
    intake = Intake()
    for number in range(MAX_PEERS):
        intake.take([(number, command())])
    for _ in range(6000):
        intake.take([(1, command())])
    intake.take([("new", command())])
    assert not intake.understood(0) and intake.understood("new") and intake.understood(1)


def test_bad_signatures_are_work_too():
    key, other = (SigningKey.from_passphrase(text) for text in ("a", "b"))
    ours = LinkSigning(SigningState(key, clock=lambda: 10), link_id=0)
    theirs = LinkSigning(SigningState(other, clock=lambda: 10), link_id=0)
    intake = Intake(ours.admit)
    flood = b"".join(theirs.sign(command()) for _ in range(2000))
    intake.take([("attacker", flood)])
    assert ours.counters.refused_frames <= SHARE
    assert not intake.understood("attacker")


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 80), st.binary(max_size=2000)), max_size=60), st.randoms())
def test_every_byte_is_accounted_for(pieces, rng):
    intake, fed = Intake(), 0
    for peer, data in pieces:
        data = data + command() * rng.randrange(3)
        intake.take([(peer, data)])
        fed += len(data)
    while intake.waiting:
        intake.take([])
    counters = intake.counters
    assert counters.bytes_in + intake.overrun_bytes == fed
    assert counters.bytes_in == counters.bytes_framed + counters.bytes_dropped + intake.pending_bytes
