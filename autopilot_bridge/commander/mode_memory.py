"""The mode that a short loss of the radio has replaced, to be restored later (ArduPlane)."""

from collections.abc import Iterable

from autopilot_bridge.commander.events import Event, FailsafeAction, FailsafeCleared, FailsafeKind
from autopilot_bridge.commander.modes import FlightMode


class ModeMemory:
    """Stores the mode from before a failsafe of the radio until another decision replaces it.

    Args:
        active: the flavour restores the mode; else nothing is stored.
    """

    def __init__(self, *, active: bool) -> None:
        self._active = active
        self._mode: FlightMode | None = None

    def note(self, started: Iterable[tuple[FailsafeKind, FailsafeAction]], mode: FlightMode) -> None:
        """Failsafes started in a mode; only a first, short loss of the radio is reversed later."""
        for kind, action in started:
            if action > FailsafeAction.WARN:
                self._mode = mode if self._active and kind is FailsafeKind.MANUAL_LOST else None

    def forget(self) -> None:
        """A client or pilot has selected a mode."""
        self._mode = None

    def recall(self, changes: Iterable[Event]) -> FlightMode | None:
        """The mode to restore because the radio is back; None: no change."""
        for event in changes:
            if isinstance(event, FailsafeCleared) and event.kind is FailsafeKind.MANUAL_LOST:
                mode, self._mode = self._mode, None
                return mode
        return None
