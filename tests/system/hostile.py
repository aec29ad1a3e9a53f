"""Bytes and frames that are malformed or out of range, from a seed."""

import random
import struct
from collections.abc import Sequence
from typing import Final

from autopilot_bridge.mavlink import DEFINITIONS, FrameEncoder, MessageDefinition, dialect

_INTEGERS: Final = (0, 1, 2, 3, 4, 5, 6, 16, 21, 22, 255)
_FLOATS: Final = (0.0, 1.0, -1.0, 0.5, 10.0, -100.0, 1e9, 3e38, float("nan"), float("inf"), -float("inf"))
_RANGES: Final = {code: struct.calcsize(f"<{code}") * 8 for code in "bBhHiIqQ"}


def random_bytes(seed: int, size: int) -> bytes:
    return random.Random(seed).randbytes(size)


def valid_frames(
    seed: int,
    count: int,
    *,
    target: int,
    sender: int = 255,
    without: Sequence[int] = (),
    components: Sequence[int] = (0, 1, 190),
) -> list[bytes]:
    """Frames of all messages of the dialect in turn, with fields from plausible to absurd.

    Args:
        target: system id in every message that has a target.
        sender: system id they come from.
        without: message ids that are left out.
        components: component ids in messages that have a target.
    """
    rng = random.Random(seed)
    encoder = FrameEncoder(sender, 190)
    known = [item for item in DEFINITIONS.values() if item.message_id not in without]
    return [
        encoder.encode_payload(item.message_id, _payload(rng, item, target, components))
        for item in (known[k % len(known)] for k in range(count))
    ]


def _payload(rng: random.Random, item: MessageDefinition, target: int, components: Sequence[int]) -> bytes:
    payload = bytearray(rng.randbytes(item.size))
    if rng.random() < 0.7:
        for field in item.wire_fields:
            for index in range(max(1, field.length) if field.code != "s" else 0):
                offset = field.offset + index * struct.calcsize(f"<{field.code}")
                struct.pack_into(f"<{field.code}", payload, offset, _value(rng, field.code))
    for field in item.wire_fields:
        if field.name in ("target_system", "target") and field.code == "B":
            payload[field.offset] = target
        elif field.name == "target_component":
            payload[field.offset] = rng.choice(components)
    return bytes(payload)


def _value(rng: random.Random, code: str) -> float:
    if code in "fd":
        return rng.choice(_FLOATS) if rng.random() < 0.5 else rng.uniform(-50.0, 50.0)
    bits = _RANGES[code]
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if code.islower() else (0, (1 << bits) - 1)
    kind = rng.random()
    if kind < 0.6:
        return min(high, rng.choice(_INTEGERS))
    return rng.choice((low, high)) if kind < 0.8 else rng.randint(low, high)


def commands(
    seed: int, count: int, *, target: int, without: Sequence[int], components: Sequence[int] = (0, 1)
) -> list[bytes]:
    """COMMAND_LONG and COMMAND_INT with every MAV_CMD there is but some."""
    rng = random.Random(seed)
    encoder = FrameEncoder(255, 190)
    ids = [number for number in dialect.enums["MAV_CMD"] if number not in without]
    frames = []
    for _ in range(count):
        command = rng.choice(ids)
        p = [_value(rng, "f") for _ in range(7)]
        if rng.random() < 0.5:
            message = dialect.MAVLink_command_long_message(target, rng.choice(components), command, 0, *p)
        else:
            message = dialect.MAVLink_command_int_message(  # type: ignore[call-arg]
                target, components[-1], rng.choice((0, 2, 3, 6, 11, 21, 255)), command, 0, 0, *p[:4],
                int(_value(rng, "i")), int(_value(rng, "i")), p[6],
            )  # fmt: skip
        frames.append(encoder.encode(message))
    return frames


def parameter_sets(seed: int, count: int, names: Sequence[str], *, target: int) -> list[bytes]:
    """PARAM_SET of parameters the vehicle has, with values it should not have."""
    rng = random.Random(seed)
    encoder = FrameEncoder(255, 190)
    frames = []
    for _ in range(count):
        name, kind = rng.choice(names).encode(), rng.choice((1, 2, 6, 9, 9, 9, 255))
        value = rng.choice((*_FLOATS, rng.uniform(-1e4, 1e4)))
        frames.append(encoder.encode(dialect.MAVLink_param_set_message(target, 1, name, value, kind)))
    return frames


def damaged(seed: int, frames: Sequence[bytes]) -> list[bytes]:
    """The frames after their checksum was made, each with one kind of damage that a checksum finds."""
    rng = random.Random(seed)
    return [_damage(rng, frame) for frame in frames]


def _damage(rng: random.Random, frame: bytes) -> bytes:
    data = bytearray(frame)
    kind = rng.randrange(5)
    # what is missing at the end could by chance stand at the beginning of what follows
    at = rng.randrange(1, len(data) if kind < 2 else len(data) - 2)
    match kind:
        case 0:  # one bit
            data[at] ^= 1 << rng.randrange(8)
        case 1:  # one byte
            data[at] ^= rng.randrange(1, 256)
        case 2:  # cut off
            del data[at:]
        case 3:  # a byte lost
            del data[at]
        case _:  # a byte gained
            gained = rng.randrange(256)
            # a second start mark before a whole frame is no damage to it
            data.insert(at, 0 if at == 1 and gained == data[0] else gained)
    return bytes(data)
