"""The signing key of the command line, and the warning when there is none."""

from collections.abc import Iterable
from pathlib import Path

from autopilot_bridge.links import listens_to_network, open_unsigned, parse_address
from autopilot_bridge.mavlink import SigningKey
from missions.cli.options import report
from missions.vehicle.signing import read_key, readable_by_others


def key_from(path: Path | None) -> SigningKey | None:
    """The key in the file that the option names; None without the option.

    Raises:
        SigningKeyError: the file can't be read, or contains no key; the message names the file.
    """
    if path is None:
        return None

    key = read_key(path)
    if readable_by_others(path):
        report(f"warning: other users can read the signing key in {path}; chmod 600 {path} keeps it secret")
    return key


def warn_if_open(connections: Iterable[str], key: SigningKey | None) -> None:
    """Print a line for each link that is open to a network and accepts unsigned messages of any sender."""
    for address in map(parse_address, connections) if key is None else ():
        if listens_to_network(address):
            report(f"warning: {open_unsigned(address)}")
