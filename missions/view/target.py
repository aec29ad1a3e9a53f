"""Where a scene is viewed: the value of `--view`."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Final

from missions.errors import PlanError

__all__ = ["SERVED", "ViewKind", "ViewTarget", "parse_view"]

_MOST_PORT: Final = 65535


class ViewKind(StrEnum):
    """Kinds of viewers."""

    WINDOW = "window"
    WEB = "web"
    FOXGLOVE = "foxglove"
    RRD = "rrd"
    MCAP = "mcap"


_FILES: Final = {".rrd": ViewKind.RRD, ".mcap": ViewKind.MCAP}
SERVED: Final = (ViewKind.WEB, ViewKind.FOXGLOVE)
"""Kinds that this program serves: they can be seen as long as it runs."""


@dataclass(frozen=True, slots=True)
class ViewTarget:
    """A viewer.

    Attributes:
        kind: of the viewer.
        path: of the file; None: it is none.
        port: of the page or server; None: its usual one, or a free one.
    """

    kind: ViewKind
    path: Path | None = None
    port: int | None = None


def parse_view(text: str) -> ViewTarget:
    """The viewer that a text names.

    Raises:
        PlanError: it names none.
    """
    name, separator, port = text.partition(":")
    if name in ViewKind.__members__.values() and name not in _FILES.values():
        kind = ViewKind(name)
        if not separator:
            return ViewTarget(kind)
        if kind in SERVED and port.isdecimal() and 0 < int(port) <= _MOST_PORT:
            return ViewTarget(kind, port=int(port))
    suffix = Path(text).suffix.lower()
    if suffix in _FILES:
        return ViewTarget(_FILES[suffix], path=Path(text))
    raise PlanError(
        f"`view` {text} is no viewer; give window, web, web:PORT, foxglove, foxglove:PORT, FILE.rrd or "
        "FILE.mcap"
    )
