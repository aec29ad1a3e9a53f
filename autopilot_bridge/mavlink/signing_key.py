"""The secret key of message signing, and its forms in files."""

import re
from dataclasses import dataclass, field
from hashlib import sha256
from typing import Final

from autopilot_bridge.errors import SigningKeyError

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
