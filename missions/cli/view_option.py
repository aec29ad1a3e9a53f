"""The option `--view` of the commands that run something."""

from collections.abc import Callable
from typing import Any, Final

import click

__all__ = ["VIEW_HELP", "view_option"]

VIEW_HELP: Final = (
    "Viewer: window (Rerun), web (Rerun in a browser on this machine), foxglove (a server for Foxglove), "
    "or a file FILE.rrd or FILE.mcap. web:PORT and foxglove:PORT choose the port."
)


def view_option(
    decorator: Callable[..., Any] = click.option, **attributes: Any
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """The option, with a window as its value where none follows."""
    made: Callable[[Callable[..., Any]], Callable[..., Any]] = decorator(
        "--view", is_flag=False, flag_value="window", metavar="[WHERE]", help=VIEW_HELP, **attributes
    )
    return made
