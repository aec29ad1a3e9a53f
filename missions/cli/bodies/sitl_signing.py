"""How the vehicles of `flightstack sitl` sign, and the lines that say so."""

from collections.abc import Callable
from pathlib import Path

from autopilot_bridge.links import Address, Reach, open_unsigned, reach_of
from autopilot_bridge.sitl import SigningParameters, SigningStore, UnsignedFrom
from autopilot_bridge.sitl.signing import POLICIES
from missions.cli.bodies.signing import key_from
from missions.cli.options import report
from missions.vehicle.signing import now


def vehicle_signing(
    key: Path | None, unsigned: str, store: Path | None, *, on_failure: Callable[[str], None]
) -> SigningParameters:
    """Signing of simulated vehicles, for clients that run in real time.

    Args:
        key: file with the key that all vehicles use.
        unsigned: senders from which unsigned frames are accepted: "none", "serial", "local" or "all".
        store: file in which keys and times are kept.
        on_failure: called with the reason when that file can no longer be written.

    Raises:
        SigningKeyError: a file can't be read or written, or holds something else; the message names it.
    """
    return SigningParameters(
        key=key_from(key),
        unsigned_from=UnsignedFrom(unsigned),
        clock=now,
        store=None if store is None else SigningStore(store, on_failure),  # its file is always its owner's
    )


def signed_how(signing: SigningParameters, address: Address) -> str:
    """Text about the frames that a link accepts, for the line that names it; "" when signing is not used."""
    if signing.key is None:
        return ""
    policy = POLICIES[signing.unsigned_from][reach_of(address)]
    return ", signed; takes unsigned frames too" if policy.accept_unsigned else ", signatures required"


def warn_if_unsigned(address: Address, signing: SigningParameters) -> None:
    """Print one line when any sender on the network can command the vehicle."""
    reach = reach_of(address)
    required = signing.key is not None and not POLICIES[signing.unsigned_from][reach].accept_unsigned
    if reach is Reach.NETWORK and not required:
        report(f"warning: {open_unsigned(address)}")
