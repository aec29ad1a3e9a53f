"""The newest frames of each component that a connection receives.

Components come and go, and any sender can use any ids, so only a limited number of components is kept.
"""

from collections.abc import Iterable, Mapping
from typing import Final

from autopilot_bridge.mavlink import Frame, MAVLinkMessage, decode

MAX_COMPONENTS: Final = 64

ComponentId = tuple[int, int]
"""System and component id."""


class NewestFrames:
    """The newest frame of each message of up to 64 components, decoded when requested.

    When there are too many, the component that was first received first is removed; it is added again when it
    is received again. Autopilots named with `keep` are never removed.
    """

    def __init__(self) -> None:
        self._frames: dict[ComponentId, dict[int, Frame]] = {}
        self._decoded: dict[ComponentId, dict[int, tuple[Frame, MAVLinkMessage]]] = {}
        self._kept: set[ComponentId] = set()

    def __len__(self) -> int:
        """Number of components."""
        return len(self._frames)

    @property
    def components(self) -> list[ComponentId]:
        """The components that were received and are still kept."""
        return list(self._frames)

    def of(self, component: ComponentId) -> Mapping[int, Frame]:
        """The present newest frames of a component, by message id."""
        return dict(self._frames.get(component, {}))

    def keep(self, component: ComponentId) -> None:
        """Never remove this component."""
        self._kept.add(component)

    def put(self, frames: Iterable[Frame]) -> None:
        """Store frames, each as the newest of its message."""
        system_id = component_id = -1
        newest: dict[int, Frame] = {}
        for frame in frames:
            if frame.component_id != component_id or frame.system_id != system_id:
                system_id, component_id = component = frame.system_id, frame.component_id
                known = self._frames.get(component)
                newest = self._add(component) if known is None else known
            newest[frame.message_id] = frame

    def _add(self, component: ComponentId) -> dict[int, Frame]:
        if len(self._frames) >= MAX_COMPONENTS:
            oldest = next((known for known in self._frames if known not in self._kept), None)
            if oldest is not None:
                del self._frames[oldest]
                self._decoded.pop(oldest, None)
        return self._frames.setdefault(component, {})

    def latest(self, component: ComponentId, message_id: int) -> MAVLinkMessage | None:
        """The newest message with an id from a component, or None; decoded once."""
        frame = self._frames.get(component, {}).get(message_id)
        if frame is None:
            return None
        messages = self._decoded.setdefault(component, {})
        known = messages.get(message_id)
        if known is None or known[0] is not frame:
            known = messages[message_id] = (frame, decode(frame))
        return known[1]
