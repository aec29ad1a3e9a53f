"""Signing on a client's side: the key from a file, time from the calendar."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from autopilot_bridge.clock.pacing import unix_time_us
from autopilot_bridge.errors import SigningKeyError
from autopilot_bridge.mavlink import LinkSigning, SigningKey, SigningState
from autopilot_bridge.mavlink.signing import RADIO, signing_time

if TYPE_CHECKING:
    from missions.request import RunRequest
    from missions.vehicle.vehicle import Vehicle


def now() -> int:
    """The calendar, as a timestamp of signatures."""
    return signing_time(unix_time_us())


def read_key(path: Path) -> SigningKey:
    """The key in a file.

    Raises:
        SigningKeyError: the file can't be read, or holds no key; the message names the file.
    """
    try:
        return SigningKey.parse(path.read_bytes())
    except OSError as error:
        raise SigningKeyError(f"--signing-key {path}: {error.strerror}") from error
    except SigningKeyError as error:
        raise SigningKeyError(f"--signing-key {path}: {error}") from error


def client_signing(key: SigningKey | None, *, link_id: int = 0) -> LinkSigning | None:
    """Signing of one link of a client, which then takes signed frames only; None without a key.

    Args:
        key: shared with the vehicle.
        link_id: different for the links of one client.
    """
    return None if key is None else LinkSigning(SigningState(key, clock=now), link_id=link_id, policy=RADIO)


def key_missing(request: "RunRequest", vehicles: Iterable["Vehicle"]) -> list[str]:
    """What keeps a vehicle that signs from answering anybody without its key, when that is what happened."""
    if not request.connect or request.signing_key is not None:
        return []
    return [
        f"vehicle {vehicle.system_id} signs what it says, and has answered nothing: is its key missing "
        "(--signing-key FILE)?"
        for vehicle in vehicles
        if vehicle.signs and not vehicle.answered
    ]
