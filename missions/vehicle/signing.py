"""Signing for a client: the key from a file, the time from the calendar."""

import stat
from pathlib import Path

from autopilot_bridge.clock.pacing import unix_time_us
from autopilot_bridge.errors import SigningKeyError
from autopilot_bridge.mavlink import LinkSigning, SigningKey, SigningState, definition, dialect
from autopilot_bridge.mavlink.signing import RADIO, signing_time
from missions.errors import VehicleTimeout
from missions.vehicle.vehicle import Vehicle


def now() -> int:
    """The present calendar time as a timestamp of signatures."""
    return signing_time(unix_time_us())


def read_key(path: Path) -> SigningKey:
    """Read the key from a file.

    Raises:
        SigningKeyError: the file can't be read, or contains no key; the message names the file.
    """
    try:
        return SigningKey.parse(path.read_bytes())
    except OSError as error:
        raise SigningKeyError(f"`signing_key` {path}: {error.strerror}") from error
    except SigningKeyError as error:
        raise SigningKeyError(f"`signing_key` {path}: {error}") from error


def readable_by_others(path: Path) -> bool:
    """Whether other users of this machine can read a file, or replace its content."""
    return bool(path.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO))


def client_signing(key: SigningKey | None, *, link_id: int = 0) -> LinkSigning | None:
    """Signing of one link of a client, which then accepts only signed frames; None without a key.

    Args:
        key: key shared with the vehicle.
        link_id: different for the links of one client.
    """
    return None if key is None else LinkSigning(SigningState(key, clock=now), link_id=link_id, policy=RADIO)


async def require_key(key: SigningKey | None, vehicle: Vehicle) -> None:
    """Check that a vehicle that signs its messages answers, before anything is set or uploaded.

    A vehicle that signs may still accept unsigned frames (PX4 and ArduPilot do on USB).

    Raises:
        VehicleTimeout: it does not answer, and no key was specified.
    """
    if key is not None or not vehicle.link.signs:
        return
    version = float(definition("AUTOPILOT_VERSION").message_id)
    try:
        await vehicle.try_command(dialect.MAV_CMD_REQUEST_MESSAGE, version)
    except VehicleTimeout:
        raise VehicleTimeout(
            f"vehicle {vehicle.system_id} signs its messages and does not answer unsigned ones; give its "
            "key with `signing_key` FILE. Nothing was sent to it but a request for its version"
        ) from None
