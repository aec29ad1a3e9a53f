"""The texts of an autopilot: STATUSTEXT, and the reasons that PX4 gives in events without a text."""

from collections import deque
from dataclasses import replace
from typing import Final

from autopilot_bridge.mavlink import dialect
from estimators.status_texts import StatusText, StatusTextAssembler
from missions.vehicle import px4_events

_KEPT: Final = 50
_SHOWN_LEAST: Final = 3
_SHOWN_MOST: Final = 10
_TOGETHER_US: Final = 10_000_000


class ReceivedTexts:
    """The newest texts of one autopilot.

    Attributes:
        newest: oldest first, with the vehicle time at which each was complete.
    """

    def __init__(self) -> None:
        self.newest: deque[StatusText] = deque(maxlen=_KEPT)
        self._assembler = StatusTextAssembler()

    def add(self, message: dialect.MAVLink_statustext_message, time_us: int) -> StatusText | None:
        """Add a text; returns it, or None while chunks of it are missing."""
        text = self._assembler.add(message)
        if text is not None:
            self.newest.append(replace(text, received_us=time_us))
        return text

    def add_event(self, event: dialect.MAVLink_event_message, time_us: int) -> None:
        """Add the reason that PX4 gives in an event without a text; other events are ignored."""
        found = px4_events.reason(event.id, event.log_levels)
        if found is not None:
            severity, words = found
            self.newest.append(StatusText(severity=severity, text=words, received_us=time_us))

    def recent(self) -> list[str]:
        """The texts that were received shortly before the newest, without repetitions, oldest first; at least
        the last three. A refusal's own reason is among them, also where the autopilot goes on to send others.
        """
        if not self.newest:
            return []
        since_us = self.newest[-1].received_us - _TOGETHER_US
        recent = [text.text for text in self.newest if text.received_us >= since_us]
        last = [text.text for text in list(self.newest)[-_SHOWN_LEAST:]]
        shown = list(dict.fromkeys(reversed(recent if len(recent) > len(last) else last)))
        return shown[_SHOWN_MOST - 1 :: -1]
