"""Signing on the command line: the option for a key, and the warning when there is none."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from missions.cli.options import report

if TYPE_CHECKING:
    from autopilot_bridge.links import Address
    from autopilot_bridge.mavlink import SigningKey
    from autopilot_bridge.sitl import SigningParameters


def key_option(**attributes: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorator for the option of a signing key."""
    return click.option(
        "--signing-key",
        type=click.Path(path_type=Path, dir_okay=False),
        metavar="FILE",
        help="Sign with the key in it (32 bytes, 64 hex digits, or a passphrase), and accept only frames "
        "that are signed with it.",
        **attributes,
    )


def key_from(path: Path | None) -> "SigningKey | None":
    """The key in the file that the option names; None without the option.

    Raises:
        SigningKeyError: the file can't be read, or contains no key; the message names the file.
    """
    if path is None:
        return None
    from missions.vehicle.signing import read_key, readable_by_others

    key = read_key(path)
    if readable_by_others(path):
        report(f"warning: other users can read the signing key in {path}; chmod 600 {path} keeps it secret")
    return key


def warn_if_open(connections: Iterable[str], key: "SigningKey | None") -> None:
    """Print a line for each link that is open to a network and accepts unsigned messages of any sender."""
    from autopilot_bridge.links import listens_to_network, open_unsigned, parse_address

    for address in map(parse_address, connections) if key is None else ():
        if listens_to_network(address):
            report(f"warning: {open_unsigned(address)}")


def vehicle_signing(
    key: Path | None, unsigned: str, store: Path | None, *, on_failure: Callable[[str], None]
) -> "SigningParameters":
    """Signing of simulated vehicles, for clients that run in real time.

    Args:
        key: file with the key that all vehicles use.
        unsigned: senders from which unsigned frames are accepted: "none", "serial", "local" or "all".
        store: file in which keys and times are kept.
        on_failure: called with the reason when that file can no longer be written.

    Raises:
        SigningKeyError: a file can't be read or written, or holds something else; the message names it.
    """
    from autopilot_bridge.sitl import SigningParameters, SigningStore, UnsignedFrom
    from missions.vehicle.signing import now

    return SigningParameters(
        key=key_from(key),
        unsigned_from=UnsignedFrom(unsigned),
        clock=now,
        store=None if store is None else SigningStore(store, on_failure),  # its file is always its owner's
    )


def signed_how(signing: "SigningParameters", address: "Address") -> str:
    """Text about the frames that a link accepts, for the line that names it; "" when signing is not used."""
    from autopilot_bridge.links import reach_of
    from autopilot_bridge.sitl.signing import POLICIES

    if signing.key is None:
        return ""
    policy = POLICIES[signing.unsigned_from][reach_of(address)]
    return ", signed; takes unsigned frames too" if policy.accept_unsigned else ", signatures required"


def warn_if_unsigned(address: "Address", signing: "SigningParameters") -> None:
    """Print one line when any sender on the network can command the vehicle."""
    from autopilot_bridge.links import Reach, open_unsigned, reach_of
    from autopilot_bridge.sitl.signing import POLICIES

    reach = reach_of(address)
    required = signing.key is not None and not POLICIES[signing.unsigned_from][reach].accept_unsigned
    if reach is Reach.NETWORK and not required:
        report(f"warning: {open_unsigned(address)}")
