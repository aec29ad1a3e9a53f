"""Garbage on every kind of link of a flying vehicle: it flies on, and every byte is accounted for."""

import contextlib
import os
import random
import socket
import tty
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import pytest

from autopilot_bridge.links import open_link, parse_address
from autopilot_bridge.mavlink import DEFINITIONS, definition, dialect
from autopilot_bridge.sitl.channel import LinkChannel
from tests.slow import slow_after
from tests.system.flying import Flying
from tests.system.hostile import commands, damaged, parameter_sets, random_bytes, valid_frames

RANDOM_BYTES = 10_000_000
DAMAGED_FRAMES = 100_000
STEPS = 2500  # ten seconds of flight
OTHER_SYSTEM = 77
COMMAND_LONG, COMMAND_INT = definition("COMMAND_LONG").message_id, definition("COMMAND_INT").message_id

Write = Callable[[bytes], int]
"""Hands bytes to the link as its other end would; tells how many it took."""


@contextmanager
def memory(flying: Flying) -> Iterator[tuple[LinkChannel, Write]]:
    theirs = flying.sitl.connect(0)

    def write(data: bytes) -> int:
        theirs.send(data)
        return len(data)

    yield flying.vehicle.channels[-1], write


@contextmanager
def udp(flying: Flying) -> Iterator[tuple[LinkChannel, Write]]:
    channel = flying.vehicle.open(open_link(parse_address("udpin:127.0.0.1:0")))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.connect(("127.0.0.1", channel.link.port))  # type: ignore[attr-defined]
        yield channel, client.send


@contextmanager
def tcp(flying: Flying) -> Iterator[tuple[LinkChannel, Write]]:
    channel = flying.vehicle.open(open_link(parse_address("tcpin:127.0.0.1:0")))
    with socket.create_connection(("127.0.0.1", channel.link.port)) as client:  # type: ignore[attr-defined]
        client.setblocking(False)

        def write(data: bytes) -> int:
            with contextlib.suppress(BlockingIOError):
                client.recv(1 << 16)
            try:
                return client.send(data)
            except BlockingIOError:
                return 0

        yield channel, write


@contextmanager
def serial(flying: Flying) -> Iterator[tuple[LinkChannel, Write]]:
    master, slave = os.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    channel = flying.vehicle.open(open_link(parse_address(f"serial:{os.ttyname(slave)}:921600")))

    def write(data: bytes) -> int:
        with contextlib.suppress(BlockingIOError):
            os.read(master, 1 << 16)
        try:
            return os.write(master, data)
        except BlockingIOError:
            return 0

    try:
        yield channel, write
    finally:
        os.close(master)
        os.close(slave)


LINKS = {"memory": memory, "udp": udp, "tcp": tcp, "serial": serial}


@pytest.fixture(scope="module")
def garbage() -> list[bytes]:
    """Random bytes, in pieces as a flight of `STEPS` steps gets them."""
    data = random_bytes(1, RANDOM_BYTES)
    size = RANDOM_BYTES // STEPS
    return [data[start : start + size] for start in range(0, RANDOM_BYTES, size)]


@pytest.fixture(scope="module")
def damage() -> list[bytes]:
    """Damaged commands, parameters and everything else, all meant for the vehicle."""
    third = DAMAGED_FRAMES // 3
    frames = valid_frames(2, third, target=1)
    frames += commands(3, third, target=1, without=())
    frames += parameter_sets(4, DAMAGED_FRAMES - 2 * third, ["MPC_XY_VEL_MAX", "COM_RCL_EXCEPT"], target=1)
    return damaged(5, frames)


def feed(flying: Flying, channel: LinkChannel, write: Write, pieces: Sequence[bytes]) -> int:
    """Spread the pieces over a flight of at least `STEPS` steps; gives the number of bytes sent."""
    sent = steps = start = 0
    while start < len(pieces) or steps < STEPS:
        stop = len(pieces) * (steps + 1) // STEPS
        batch = b"".join(pieces[start:stop])
        if channel.link.description.startswith(("udp", "memory")):
            for piece in pieces[start:stop]:
                sent += write(piece)
        start = max(start, stop)
        while not channel.link.description.startswith(("udp", "memory")) and batch:
            taken = write(batch)
            sent += taken
            batch = batch[taken:]
            if batch:
                flying.vehicle.poll()
        flying.sitl.advance()
        steps += 1
    for _ in range(100):  # what is still on its way
        if channel.link.counters.bytes_in >= sent:
            break
        flying.sitl.advance()
    return sent


def check_accounts(channel: LinkChannel, sent: int) -> None:
    counters = channel.counters
    assert channel.link.counters.bytes_in == sent
    assert counters.bytes_in == sent
    assert counters.bytes_in == counters.bytes_framed + counters.bytes_dropped + channel.pending_bytes
    reasons = (counters.bytes_junk, counters.bytes_bad_crc, counters.bytes_unsupported)
    assert counters.bytes_dropped == sum(reasons) + counters.bytes_unknown_message
    assert channel.pending_bytes <= 300


class Watch:
    """What must not change while garbage comes in."""

    def __init__(self, flying: Flying) -> None:
        self.flying = flying
        self.mode = flying.mode
        self.position_m = np.array(flying.true_position_m)

    def check(self) -> None:
        assert self.flying.armed
        assert self.flying.mode is self.mode
        assert np.linalg.norm(np.array(self.flying.true_position_m) - self.position_m) < 1.0
        assert np.isfinite(self.flying.vehicle.vehicle.truth).all()


def hovering(flavour: str) -> Flying:
    flying = Flying(flavour)
    flying.take_off(10.0)
    flying.sitl.poll_every(flying.sitl.step_us)
    return flying


@pytest.mark.parametrize("kind", LINKS)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_random_bytes(kind: str, garbage: list[bytes]) -> None:
    flying = hovering("px4")
    watch = Watch(flying)
    with LINKS[kind](flying) as (channel, write):
        sent = feed(flying, channel, write, garbage)
        watch.check()
        assert sent == RANDOM_BYTES
        check_accounts(channel, sent)
        assert channel.counters.frames <= 3  # by accident, one in 65536 of what looks like a frame


@pytest.mark.parametrize("kind", LINKS)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_damaged_frames(kind: str, damage: list[bytes]) -> None:
    flying = hovering("px4")
    watch = Watch(flying)
    before = flying.autopilot.parameters.as_dict()
    with LINKS[kind](flying) as (channel, write):
        sent = feed(flying, channel, write, damage)
        watch.check()
        assert sent == sum(map(len, damage))
        check_accounts(channel, sent)
        assert channel.counters.frames < 10
        assert channel.counters.bad_crc > 50_000
    assert flying.autopilot.parameters.as_dict() == before


@pytest.mark.slow
def test_damaged_frames_change_nothing_at_all(damage: list[bytes]) -> None:
    """The flight is the same to the last bit as one without them."""
    disturbed, undisturbed = hovering("px4"), hovering("px4")
    with memory(disturbed) as (channel, write):
        feed(disturbed, channel, write, damage)
        assert channel.counters.frames < 10  # by chance: some 90000 checksums of 16 bits were compared
    undisturbed.step((disturbed.sitl.time_us - undisturbed.sitl.time_us) * 1e-6)
    assert undisturbed.sitl.time_us == disturbed.sitl.time_us
    truths = [flying.vehicle.vehicle.truth for flying in (disturbed, undisturbed)]
    assert np.array_equal(*truths)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.slow
def test_frames_for_other_systems(flavour: str) -> None:
    """Every message there is, and every command, for another vehicle: forwarded perhaps, never obeyed."""
    flying = hovering(flavour)
    watch = Watch(flying)
    before = flying.autopilot.parameters.as_dict()
    addressed = [item.message_id for item in DEFINITIONS.values() if item.target_system_offset is not None]
    untargeted = [number for number in DEFINITIONS if number not in addressed]
    frames = valid_frames(6, 20_000, target=OTHER_SYSTEM, sender=OTHER_SYSTEM, without=untargeted)
    frames += commands(7, 10_000, target=OTHER_SYSTEM, without=())
    with memory(flying) as (channel, write):
        sent = feed(flying, channel, write, frames)
        watch.check()
        check_accounts(channel, sent)
        assert channel.counters.frames == len(frames)
        assert channel.counters.bytes_dropped == 0
    assert flying.autopilot.parameters.as_dict() == before


TERMINATING = (
    dialect.MAV_CMD_COMPONENT_ARM_DISARM,
    dialect.MAV_CMD_DO_FLIGHTTERMINATION,
    dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN,
    dialect.MAV_CMD_INJECT_FAILURE,
)


@pytest.mark.parametrize("seed", slow_after(1, range(8)))
@pytest.mark.parametrize("flavour", slow_after(1, ["ardupilot", "px4"]))
def test_any_message_with_any_content(flavour: str, seed: int) -> None:
    """Valid frames of every message, every command and every parameter, with absurd fields, for the vehicle
    itself: it may go anywhere and refuse anything, but nothing raises, and all motor commands are numbers.
    """
    flying = hovering(flavour)
    names = [item.name for item in flying.autopilot.parameters.definitions]
    frames = valid_frames(10 + seed, 2000, target=1, without=(COMMAND_LONG, COMMAND_INT))
    frames += commands(20 + seed, 1000, target=1, without=TERMINATING)
    frames += parameter_sets(30 + seed, 700, names, target=1)
    random.Random(seed).shuffle(frames)
    with memory(flying) as (channel, write):
        for start in range(0, len(frames), 4):
            for frame in frames[start : start + 4]:
                write(frame)
            flying.sitl.advance()
            actuators = flying.autopilot.actuators
            assert ((actuators >= 0.0) & (actuators <= 1.0)).all(), actuators
        assert np.isfinite(flying.vehicle.vehicle.truth).all()
        check_accounts(channel, sum(map(len, frames)))
        assert channel.counters.frames == len(frames)
