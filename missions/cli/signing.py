"""Signing on the command line: the option for a key."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click


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
