"""The mode a short loss of the radio has replaced, to come back to (ArduPlane)."""

from collections.abc import Iterable

from autopilot_bridge.commander.events import Event, FailsafeAction, FailsafeCleared, FailsafeKind
from autopilot_bridge.commander.modes import FlightMode


class ModeMemory:
    """Remembers the mode from before a failsafe of the radio until something else decides.

    Args:
        active: the flavour comes back to it; else nothing is ever remembered.
    """

    __slots__ = ("_active", "_mode")

    def __init__(self, *, active: bool) -> None:
        self._active = active
        self._mode: FlightMode | None = None

    def note(self, started: Iterable[tuple[FailsafeKind, FailsafeAction]], mode: FlightMode) -> None:
        """Failsafes came up in a mode; only a first, short loss of the radio is undone."""
        for kind, action in started:
            if action > FailsafeAction.WARN:
                self._mode = mode if self._active and kind is FailsafeKind.MANUAL_LOST else None

    def forget(self) -> None:
        """Somebody chose a mode."""
        self._mode = None

    def recall(self, told: Iterable[Event]) -> FlightMode | None:
        """The mode to come back to now that the radio is heard again; None: stay."""
        for event in told:
            if isinstance(event, FailsafeCleared) and event.kind is FailsafeKind.MANUAL_LOST:
                mode, self._mode = self._mode, None
                return mode
        return None
