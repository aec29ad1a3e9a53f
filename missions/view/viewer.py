"""What all viewers have in common."""

from collections.abc import Sequence
from typing import Protocol

from estimators.logs import Log
from estimators.scene_items import Entry
from missions.errors import MissionError

__all__ = ["ViewError", "Viewer"]


class ViewError(MissionError):
    """A viewer can't be opened, or a scene can't be viewed."""


class Viewer(Protocol):
    """Draws a scene.

    Attributes:
        live: it shows a flight while it is flown; else the flight is drawn when it is over.
        where: what the user does to see it, or where the file is: "http://127.0.0.1:9090/...".
    """

    @property
    def live(self) -> bool: ...

    @property
    def where(self) -> str: ...

    def begin(self, title: str, log: Log | None = None) -> None:
        """Begin a recording, to which what is drawn from now on belongs.

        Args:
            title: of the recording.
            log: whose scene is drawn; None: a flight is in progress.
        """
        ...

    def draw(self, entries: Sequence[Entry]) -> None:
        """Draw entries, in the order of time."""
        ...

    def lay_out(self) -> None:
        """Arrange the views for what was drawn so far."""
        ...

    def finish(self) -> None:
        """All was drawn: deliver it. What the viewer has remains to be seen."""
        ...

    def close(self) -> None:
        """End it: the server, or the file."""
        ...
