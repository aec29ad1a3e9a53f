"""The texts of an autopilot, joined from the chunks in which STATUSTEXT carries them."""

from dataclasses import dataclass
from typing import Final, Protocol

from flightsim.foundation.plain_text import plain_text

__all__ = ["StatusText", "StatusTextAssembler"]

_CHUNK: Final = 50
_UNFINISHED_TEXTS: Final = 8


class _Chunk(Protocol):
    """STATUSTEXT, of pymavlink or of `estimators.wire`."""

    @property
    def severity(self) -> int: ...

    @property
    def text(self) -> str: ...

    @property
    def id(self) -> int: ...

    @property
    def chunk_seq(self) -> int: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class StatusText:
    """A text for the pilot.

    Attributes:
        severity: as MAV_SEVERITY (3 error, 4 warning, 6 information).
        text: the text, or the words of an event that has none.
        received_us: vehicle time at which it was complete.
    """

    severity: int
    text: str
    received_us: int = 0


class StatusTextAssembler:
    """Joins STATUSTEXTs that were sent in chunks of 50 characters (id, chunk_seq).

    A text whose end is lost is dropped when its id is used again, or when 8 other texts are unfinished.
    """

    def __init__(self) -> None:
        self._parts: dict[int, dict[int, str]] = {}

    def add(self, m: _Chunk) -> StatusText | None:
        """Add one message; returns the text when it is complete."""
        text = str(m.text)
        if not m.id:
            return _status_text(m.severity, text)
        parts = self._parts.pop(m.id, {})
        newest = max(parts, default=-1)
        if m.chunk_seq < newest or parts.get(m.chunk_seq, text) != text:
            parts = {}  # chunks come in order, so the id is now used for another text
        parts[m.chunk_seq] = text
        if len(text) >= _CHUNK:
            self._parts[m.id] = parts  # stored as the newest
            if len(self._parts) > _UNFINISHED_TEXTS:
                del self._parts[next(iter(self._parts))]
            return None
        return _status_text(m.severity, "".join(parts[k] for k in sorted(parts)))


def _status_text(severity: int, text: str) -> StatusText:
    """A whole text, as it may be shown; PX4 ends texts that it also sends as events with a tab."""
    return StatusText(severity=severity, text=plain_text(text.rstrip("\t")))
