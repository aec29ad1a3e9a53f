"""Signing on the command line: the option for a key."""

from pathlib import Path
from typing import Any, TypeVar

import click

AnyOption = TypeVar("AnyOption", bound=click.Option)


def key_option(kind: type[AnyOption] = click.Option, **attributes: Any) -> AnyOption:  # type: ignore[assignment]
    """The option of a signing key.

    Args:
        kind: class of the option.
        attributes: further arguments of the class.
    """
    return kind(
        ["--signing-key"],
        type=click.Path(path_type=Path, dir_okay=False),
        metavar="FILE",
        help="Sign with the key in it (32 bytes, 64 hex digits, or a passphrase), and accept only frames "
        "that are signed with it.",
        **attributes,
    )
