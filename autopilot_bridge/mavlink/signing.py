"""MAVLink 2 message signing, without I/O (https://mavlink.io/en/guide/message_signing.html).

A signed frame has the incompatibility flag 0x01 and 13 additional bytes: link id, 48 bits of time in units of
10 us since 2015-01-01, and the first 48 bits of SHA-256 over the key and all preceding bytes.

One `SigningState` belongs to a device: key, newest timestamp and the received streams are the same on all of
its links, so that frames recorded on one link can't be replayed on another. A `LinkSigning` belongs to one
link.

The secret key of message signing, and its forms in files.
"""

import hmac
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from hashlib import sha256
from typing import Final

from fastcrc.crc16 import mcrf4xx

from autopilot_bridge.errors import SigningKeyError
from autopilot_bridge.mavlink.definitions import DEFINITIONS
from autopilot_bridge.mavlink.frame import (
    CHECKSUM_SIZE,
    INCOMPAT_SIGNED,
    MAGIC_V2,
    OVERHEAD_V2,
    SIGNATURE_SIZE,
    Frame,
)

KEY_SIZE: Final = 32
_MAX_FILE_SIZE: Final = 4096
_HEX: Final = re.compile(rb"[0-9a-fA-F]{64}")
_ACCEPTED: Final = "32 raw bytes, 64 hexadecimal digits, or a passphrase in one line"


@dataclass(frozen=True, slots=True)
class SigningKey:
    """32 secret bytes, not all zero (which means: no key). They are not shown in reprs and messages.

    Raises:
        SigningKeyError: the wrong number of bytes, or all bytes are zero.
    """

    secret: bytes = field(repr=False)

    def __post_init__(self) -> None:
        if len(self.secret) != KEY_SIZE:
            raise SigningKeyError(f"signing key of {len(self.secret)} bytes; accepted: {KEY_SIZE}")
        if not any(self.secret):
            raise SigningKeyError("signing key of zeros; it means that there is none")

    @classmethod
    def from_passphrase(cls, passphrase: str) -> "SigningKey":
        """SHA-256 of the passphrase, as MAVProxy, Mission Planner and QGroundControl make it.

        Raises:
            SigningKeyError: the passphrase is empty.
        """
        if not passphrase:
            raise SigningKeyError("an empty passphrase makes no signing key")
        return cls(sha256(passphrase.encode()).digest())

    @classmethod
    def parse(cls, content: bytes) -> "SigningKey":
        """The key in the content of a file.

        32 bytes that are not all printable are the key itself; 64 hexadecimal digits are the key in that
        form; one line of any other text is a passphrase.

        Raises:
            SigningKeyError: none of these; the content is not repeated in the message.
        """
        if len(content) == KEY_SIZE and not _printable(content):
            return cls(content)
        stripped = content.strip()
        if _HEX.fullmatch(stripped):
            return cls(bytes.fromhex(stripped.decode("ascii")))
        if not stripped or len(content) > _MAX_FILE_SIZE or b"\n" in stripped or not _printable(stripped):
            raise SigningKeyError(f"no signing key in {len(content)} bytes; accepted: {_ACCEPTED}")
        return cls.from_passphrase(stripped.decode())


def _printable(content: bytes) -> bool:
    try:
        return content.decode().strip().isprintable()
    except UnicodeDecodeError:
        return False


SIGNING_EPOCH_UNIX_US: Final = 1_420_070_400_000_000
"""2015-01-01T00:00:00Z."""
TIMESTAMP_UNIT_US: Final = 10
MAX_TIMESTAMP: Final = (1 << 48) - 1
MINUTE: Final = 6_000_000
"""Timestamp units in a minute: the largest age of the first timestamp of a new stream."""
MAX_STREAMS: Final = 256
SETUP_SIGNING: Final = 256
"""Id of the message that sets a key: never forwarded, never logged."""
DAY: Final = 24 * 60 * MINUTE
"""Largest lead of a received timestamp over a calendar clock: more than any wrong time zone."""
_SAVE_EVERY: Final = MINUTE // 2
_TIMESTAMP_SIZE: Final = 6
_DIGEST_SIZE: Final = 6
_RADIO_MESSAGES: Final = frozenset({109, 166})  # RADIO_STATUS, RADIO: a telemetry radio has no key


def signing_time(unix_us: int) -> int:
    """The timestamp of a time of the Unix epoch (microseconds); 0 before 2015."""
    return min(max(0, (unix_us - SIGNING_EPOCH_UNIX_US) // TIMESTAMP_UNIT_US), MAX_TIMESTAMP)


class Refusal(StrEnum):
    """Why a frame is refused."""

    UNSIGNED = "unsigned"
    BAD_SIGNATURE = "bad signature"
    REPLAYED = "replayed"
    OLD = "old"
    AHEAD = "ahead of the clock"
    TOO_MANY_STREAMS = "too many streams"


class SigningState:
    """Key, time and streams of one device.

    Args:
        key: None: nothing is signed or checked.
        clock: the device's time as a timestamp (`signing_time`).
        timestamp: lowest timestamp of signed frames, as after a restart.
        lead: timestamps farther ahead of the clock are refused, and stored ones are not used: time never goes
            back, so one timestamp of the far future would refuse every later sender. None: all are accepted,
            as the clock may be far behind.
        on_save: called with the state when key or time must be stored: at a new key, and while frames are
            signed each half minute of timestamps.
    """

    def __init__(
        self,
        key: SigningKey | None = None,
        *,
        clock: Callable[[], int],
        timestamp: int = 0,
        lead: int | None = None,
        on_save: "Callable[[SigningState], None] | None" = None,
    ) -> None:
        self._clock = clock
        self._lead = MAX_TIMESTAMP if lead is None else lead
        self._newest = 0
        self._streams: dict[tuple[int, int, int], int] = {}
        self._on_save: Callable[[SigningState], None] | None = None
        self._save_at = 0
        self.set_key(key, timestamp)
        self._on_save = on_save

    @property
    def key(self) -> SigningKey | None:
        """The key; None: signing is off."""
        return self._key

    @property
    def active(self) -> bool:
        """There is a key."""
        return self._key is not None

    @property
    def timestamp(self) -> int:
        """The newest timestamp of all: sent, received, stored, or from the clock."""
        return min(max(self._newest, self._clock()), MAX_TIMESTAMP)

    def set_key(self, key: SigningKey | None, timestamp: int = 0) -> None:
        """Set another key, or none; time never goes back, whatever the value of `timestamp`.

        A timestamp that is too far ahead of the clock is not used.
        """
        self._key = key
        self._seed = sha256(b"" if key is None else key.secret)
        self._streams.clear()
        if not self._ahead(timestamp):
            self._newest = max(self._newest, min(timestamp, MAX_TIMESTAMP))
        self._save()

    def _ahead(self, timestamp: int) -> bool:
        return timestamp > self._clock() + self._lead

    def sign(self, frame: bytes, link_id: int) -> bytes:
        """Add a signature to a MAVLink 2 frame that has none."""
        self._newest = newest = min(max(self._newest + 1, self._clock()), MAX_TIMESTAMP)
        if newest >= self._save_at:
            self._save()
        head = b"%c%b\x01%b" % (frame[0], frame[1:2], frame[3:-CHECKSUM_SIZE])
        message_id = frame[7] | frame[8] << 8 | frame[9] << 16
        checksum = mcrf4xx(head[1:] + bytes((DEFINITIONS[message_id].crc_extra,)))
        signed = b"%b%b%c%b" % (
            head,
            checksum.to_bytes(CHECKSUM_SIZE, "little"),
            link_id,
            newest.to_bytes(_TIMESTAMP_SIZE, "little"),
        )
        return signed + self._digest(signed)

    def verify(self, frame: Frame) -> Refusal | None:
        """Check a signed frame against key and streams, and store its time; None: it is valid.

        Nothing is stored from a frame whose signature is wrong: otherwise one forged frame with a late
        timestamp would block the true sender.
        """
        raw = frame.raw
        if not hmac.compare_digest(self._digest(raw[:-_DIGEST_SIZE]), raw[-_DIGEST_SIZE:]):
            return Refusal.BAD_SIGNATURE
        timestamp = int.from_bytes(raw[-SIGNATURE_SIZE + 1 : -_DIGEST_SIZE], "little")
        if self._ahead(timestamp):
            return Refusal.AHEAD
        stream = (raw[-SIGNATURE_SIZE], frame.system_id, frame.component_id)
        last = self._streams.get(stream)
        if last is not None:
            if timestamp <= last:
                return Refusal.REPLAYED
        elif timestamp + MINUTE < self.timestamp:
            return Refusal.OLD
        elif len(self._streams) >= MAX_STREAMS:
            return Refusal.TOO_MANY_STREAMS
        self._streams[stream] = timestamp
        self._newest = max(self._newest, timestamp)
        return None

    def _digest(self, data: bytes) -> bytes:
        digest = self._seed.copy()
        digest.update(data)
        return digest.digest()[:_DIGEST_SIZE]

    def _save(self) -> None:
        self._save_at = self.timestamp + _SAVE_EVERY
        if self._on_save is not None:
            self._on_save(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkSigningPolicy:
    """The frames that one link accepts and sends while there is a key.

    Attributes:
        accept_unsigned: frames without signature, MAVLink 1 included.
        accept_bad_signature: frames whose signature is wrong or not new; they count as unsigned. For a link
            that only the owner can reach, so that a device whose key was lost stays reachable.
        sign: own frames are signed.
        unsigned_messages: messages accepted without a signature anyway.
    """

    accept_unsigned: bool
    accept_bad_signature: bool = False
    sign: bool = True
    unsigned_messages: frozenset[int] = frozenset()


REQUIRED: Final = LinkSigningPolicy(accept_unsigned=False)
"""Signatures are required."""
RADIO: Final = LinkSigningPolicy(accept_unsigned=False, unsigned_messages=_RADIO_MESSAGES)
"""Signatures are required, except from a telemetry radio on the line, which reports how full its buffer is.
These messages slow streams down, so on other links they need a signature.
"""
UNSIGNED_TOO: Final = LinkSigningPolicy(accept_unsigned=True)
"""Unsigned frames are accepted too, but no wrong signature."""
TRUSTED: Final = LinkSigningPolicy(accept_unsigned=True, accept_bad_signature=True)
"""A link that only its owner can reach, such as USB: all frames are accepted (MAVLink guide,
"Accepting Unsigned Packets").
"""
INTERNAL: Final = LinkSigningPolicy(accept_unsigned=True, accept_bad_signature=True, sign=False)
"""Between parts of one device: nothing is signed or checked."""


@dataclass(slots=True)
class SigningCounters:
    """Frames signed and refused while there was a key.

    Attributes:
        sent: frames signed.
        verified: frames with a valid signature.
        tolerated: frames accepted without one, by the policy.
        refused: dropped frames, by reason.
    """

    sent: int = 0
    verified: int = 0
    tolerated: int = 0
    refused: dict[Refusal, int] = field(default_factory=lambda: dict.fromkeys(Refusal, 0))

    @property
    def reasons(self) -> str:
        """The refused frames as a text: "3 unsigned, 1 replayed"; empty when there were none."""
        return ", ".join(f"{count} {reason}" for reason, count in self.refused.items() if count)

    @property
    def refused_frames(self) -> int:
        """Frames that were dropped, for any reason."""
        return sum(self.refused.values())


class LinkSigning:
    """Signs the frames sent on one link and checks the received ones.

    Args:
        state: the device's.
        link_id: number of the link, 0..255; different for the links of one device.
        policy: the link's policy.
    """

    def __init__(self, state: SigningState, *, link_id: int, policy: LinkSigningPolicy = REQUIRED) -> None:
        if not 0 <= link_id <= 255:
            raise ValueError(f"link id {link_id} is not in 0..255")
        self.state = state
        self.link_id = link_id
        self.policy = policy
        self.counters = SigningCounters()

    @property
    def signs(self) -> bool:
        """Sent frames must be signed."""
        return self.state.active and self.policy.sign

    def sign(self, packet: bytes) -> bytes:
        """The frames of a packet (whole MAVLink 2 frames without signatures) with signatures."""
        state, link_id = self.state, self.link_id
        first = OVERHEAD_V2 + packet[1]
        if first == len(packet):
            self.counters.sent += 1
            return state.sign(packet, link_id)
        signed, start, size = [], 0, len(packet)
        while start < size:
            end = start + OVERHEAD_V2 + packet[start + 1]
            signed.append(state.sign(packet[start:end], link_id))
            start = end
        self.counters.sent += len(signed)
        return b"".join(signed)

    def sign_again(self, raw: bytes) -> bytes:
        """A frame of another system with our signature, instead of its own if it has one.

        A MAVLink 1 frame, and a message outside the dialect, are returned unchanged.
        """
        message_id = raw[7] | raw[8] << 8 | raw[9] << 16 if raw[0] == MAGIC_V2 else -1
        if message_id not in DEFINITIONS:
            return raw
        self.counters.sent += 1
        bare = raw[:-SIGNATURE_SIZE] if raw[2] & INCOMPAT_SIGNED else raw
        return self.state.sign(bare, self.link_id)

    def admit(self, frames: list[Frame]) -> list[Frame]:
        """The accepted frames; in them, `Frame.signed` means verified."""
        if not self.state.active or self.policy is INTERNAL:
            return frames
        policy, counters, state = self.policy, self.counters, self.state
        admitted = []
        for frame in frames:
            if frame.signed:
                refusal = state.verify(frame)
                if refusal is None:
                    counters.verified += 1
                    admitted.append(frame)
                    continue
                tolerated = policy.accept_bad_signature
            else:
                refusal = Refusal.UNSIGNED
                tolerated = policy.accept_unsigned or frame.message_id in policy.unsigned_messages
            if tolerated:
                counters.tolerated += 1
                admitted.append(frame._replace(signed=False) if frame.signed else frame)
            else:
                counters.refused[refusal] += 1
        return admitted


def is_unsigned_v2(raw: bytes) -> bool:
    """The frame can be given a signature."""
    return raw[0] == MAGIC_V2 and not raw[2] & INCOMPAT_SIGNED
