"""Signing of the vehicles of a SITL: the keys, what each link accepts, and how a client sets another key.

The rules are the firmware's (ArduPilot `GCS_Signing.cpp`; PX4 has some since 1.17): no key is changed while
armed, and a key is accepted on a link that only the owner can reach, or in a frame signed with the present
key.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import Final

from autopilot_bridge.errors import SigningKeyError
from autopilot_bridge.links import Reach
from autopilot_bridge.mavlink import (
    Frame,
    LinkSigning,
    LinkSigningPolicy,
    SigningKey,
    SigningState,
    decode_as,
    dialect,
)
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.signing import DAY, INTERNAL, MINUTE, RADIO, REQUIRED, TRUSTED, UNSIGNED_TOO

_KEY_REMOVED: Final = "Signing key removed"
_KEY_TAKEN: Final = "Signing key set"
_NOT_STORED: Final = ", but can't be stored"  # a restart loses the key
_WHILE_ARMED: Final = "ERROR: Won't setup signing when armed"  # ArduPilot's text
_NOT_TRUSTED: Final = "Signing key refused: link not trusted"
_NOT_REMOVABLE: Final = "Signing key can't be removed"


class UnsignedFrom(StrEnum):
    """The links on which unsigned frames are accepted while there is a key."""

    NONE = "none"
    SERIAL = "serial"
    LOCAL = "local"
    ALL = "all"


POLICIES: Final[Mapping[UnsignedFrom, Mapping[Reach, LinkSigningPolicy]]] = MappingProxyType(
    {
        UnsignedFrom.NONE: {Reach.CABLE: RADIO, Reach.MACHINE: REQUIRED, Reach.NETWORK: REQUIRED},
        UnsignedFrom.SERIAL: {Reach.CABLE: TRUSTED, Reach.MACHINE: REQUIRED, Reach.NETWORK: REQUIRED},
        UnsignedFrom.LOCAL: {Reach.CABLE: TRUSTED, Reach.MACHINE: TRUSTED, Reach.NETWORK: REQUIRED},
        UnsignedFrom.ALL: {Reach.CABLE: TRUSTED, Reach.MACHINE: TRUSTED, Reach.NETWORK: UNSIGNED_TOO},
    }
)
"""What a link accepts, by the processes that can reach it; links within the process are never signed."""


class SigningStore:
    """Stores keys and times of vehicles in a file, so that time does not go back over a restart.

    One line for each vehicle: system id, timestamp, key in hexadecimal digits. Only its owner can read it.

    Args:
        path: the file; it need not exist.
        on_failure: called with the reason when the file can't be written any more. The vehicles keep flying,
            and the next change tries to write the whole content again.

    Attributes:
        failure: why the file is not up to date; empty: it is.

    Raises:
        SigningKeyError: the file has another content, can't be read, or can't be written.
    """

    def __init__(self, path: Path, on_failure: Callable[[str], None] | None = None) -> None:
        self.failure = ""
        self._path = path
        self._on_failure = on_failure
        self._vehicles: dict[int, tuple[int, SigningKey | None]] = {}
        try:
            for line in path.read_text(encoding="ascii").splitlines():
                number, timestamp, *key = line.split()
                self._vehicles[int(number)] = (
                    int(timestamp),
                    SigningKey(bytes.fromhex(key[0])) if key else None,
                )
        except FileNotFoundError:
            pass
        except OSError as error:
            raise SigningKeyError(f"can't read {path}: {error.strerror}") from error
        except (ValueError, IndexError) as error:
            raise SigningKeyError(
                f"{path} is not a store of signing keys; choose another path, which is made anew"
            ) from error
        try:
            self._write(replace=False)
        except OSError as error:
            raise SigningKeyError(
                f"can't write {path}: {error.strerror}; choose a file in a folder that can be written"
            ) from error

    def load(self, system_id: int) -> tuple[int, SigningKey | None] | None:
        """Timestamp to start from, a minute later than any that was used, and the key; None: never stored."""
        found = self._vehicles.get(system_id)
        return None if found is None else (found[0] + MINUTE, found[1])

    def save(self, system_id: int, state: SigningState) -> None:
        """Store a vehicle's key and time; the file is replaced completely, or kept as it is (`failure`)."""
        self._vehicles[system_id] = (state.timestamp, state.key)
        before, self.failure = self.failure, ""
        try:
            self._write(replace=True)
        except OSError as error:
            self.failure = f"can't write {self._path}: {error.strerror}"
            if not before and self._on_failure is not None:
                self._on_failure(self.failure)

    def _write(self, *, replace: bool) -> None:
        """Write everything to a temporary file; then move it to the file's place, or in a trial delete it."""
        lines = [
            f"{number} {timestamp}{'' if key is None else ' ' + key.secret.hex()}\n"
            for number, (timestamp, key) in sorted(self._vehicles.items())
        ]
        beside = self._path.with_name(self._path.name + ".new")
        try:
            descriptor = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
            with os.fdopen(descriptor, "w", encoding="ascii") as file:
                file.writelines(lines)
            if replace:
                beside.replace(self._path)
        finally:
            beside.unlink(missing_ok=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class SigningParameters:
    """How the vehicles sign.

    Attributes:
        key: of all vehicles; None: no key until a client sets one, or the stored key.
        unsigned_from: links on which unsigned frames are accepted while there is a key.
        removable: a client that may set a key may also switch signing off.
        clock: time as a timestamp, for clients in real time; None: the vehicles' own clock.
        store: where keys and times are stored; None: nowhere.
    """

    key: SigningKey | None = None
    unsigned_from: UnsignedFrom = UnsignedFrom.SERIAL
    removable: bool = True
    clock: Callable[[], int] | None = None
    store: SigningStore | None = field(default=None, compare=False)


class VehicleSigning:
    """Signing of one vehicle.

    Args:
        parameters: as given to the SITL.
        system_id: the vehicle's.
        clock: the vehicle's time as a timestamp.
        armed: returns whether the vehicle is armed, when a client sends a key.

    Attributes:
        state: key, time and streams.
    """

    def __init__(
        self,
        parameters: SigningParameters,
        *,
        system_id: int,
        clock: Callable[[], int],
        armed: Callable[[], bool],
    ) -> None:
        self._parameters = parameters
        self._system_id = system_id
        self._armed = armed
        self._links = 0
        store = parameters.store
        stored = None if store is None else store.load(system_id)
        timestamp, key = (0, None) if stored is None else stored
        self.state = SigningState(
            key if parameters.key is None else parameters.key,
            clock=parameters.clock or clock,
            timestamp=timestamp,
            lead=None if parameters.clock is None else DAY,  # the vehicles' own clock may be behind
            on_save=None if store is None else lambda state: store.save(system_id, state),
        )

    def link(self, reach: Reach) -> LinkSigning:
        """The signing of one additional link."""
        if reach is Reach.PROCESS:
            return LinkSigning(self.state, link_id=0, policy=INTERNAL)
        number, self._links = self._links, self._links + 1
        return LinkSigning(
            self.state, link_id=number & 0xFF, policy=POLICIES[self._parameters.unsigned_from][reach]
        )

    def take_setup(self, frame: Frame, link: LinkSigning, reach: Reach) -> str | None:
        """SETUP_SIGNING: accept the key, or return the reason of the refusal.

        Args:
            frame: as passed by `LinkSigning.admit`.
            link: the link on which it came.
            reach: of that link.

        Returns:
            A text for the sender; None when the message was addressed to another system or component.
        """
        message = decode_as(frame, dialect.MAVLink_setup_signing_message)
        if message.target_system != self._system_id or message.target_component not in (
            0,
            AUTOPILOT_COMPONENT,
        ):
            return None
        if self._armed():
            return _WHILE_ARMED
        if self.state.active:
            trusted = frame.signed or link.policy.accept_bad_signature
        else:
            trusted = reach is not Reach.NETWORK
        if not trusted:
            return _NOT_TRUSTED
        secret = bytes(message.secret_key)
        if any(secret):
            self.state.set_key(SigningKey(secret), message.initial_timestamp)
            return _KEY_TAKEN + self._not_stored
        if not self._parameters.removable:
            return _NOT_REMOVABLE
        self.state.set_key(None)
        return _KEY_REMOVED + self._not_stored

    @property
    def _not_stored(self) -> str:
        store = self._parameters.store
        return _NOT_STORED if store is not None and store.failure else ""


def answer_to_key(text: str) -> dialect.MAVLink_statustext_message:
    """The STATUSTEXT for the client that sent a key."""
    good = text in (_KEY_TAKEN, _KEY_REMOVED)
    severity = dialect.MAV_SEVERITY_INFO if good else dialect.MAV_SEVERITY_ERROR
    return dialect.MAVLink_statustext_message(severity, text.encode())
