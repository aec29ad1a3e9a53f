"""Feeds a live viewer from a flight, in a thread, through a bounded queue.

The flight only puts what it has received into the queue, which takes some microseconds. Decoding and drawing
are done by the thread. Where the viewer is slower than the flight, what does not fit is dropped and counted;
where it has gone, the flight goes on without it.
"""

import queue
import threading
from typing import Final

from autopilot_bridge.mavlink import DEFINITIONS, Packet
from estimators.messages import read_message
from estimators.observations import Image
from estimators.scene.messages import MessageScene
from estimators.scene.placing import Assembly
from estimators.scene.shown import Shown
from estimators.scene_items import Entry
from estimators.vehicle_time import VehicleTime
from missions.errors import MissionError
from missions.view.viewer import Viewer

__all__ = ["SceneFeed"]

_MOST_WAITING: Final = 50_000
_PERIOD_S: Final = 0.1  # wall time between two drawings
_LAYOUT_EACH: Final = 20  # drawings
_ENDS_WITHIN_S: Final = 15.0
_LEAST_US: Final = 40_000  # between two samples of one sender, which are thinned further by the scene
_IDS: Final = frozenset(i for i, found in DEFINITIONS.items() if found.name in MessageScene.NAMES)
_SAMPLED: Final = frozenset(i for i in _IDS if DEFINITIONS[i].name in MessageScene.SAMPLED)
"""Messages of which a few a second are enough."""


class SceneFeed:
    """Draws on a viewer what is put into it.

    Args:
        viewer: an open viewer.
        title: of the recording.

    Attributes:
        dropped: number of packets and items that were dropped, because the viewer was slower.
        failure: why the viewer draws no more; "": it draws.
    """

    def __init__(self, viewer: Viewer, title: str) -> None:
        self.dropped = 0
        self.failure = ""
        self._viewer = viewer
        self._title = title
        self._queue: queue.Queue[Packet | Shown | Image] = queue.Queue(_MOST_WAITING)
        self._due_us: dict[tuple[tuple[int, int], tuple[int, ...]], int] = {}
        self._ended = threading.Event()
        self._scene = Assembly()
        self._time = VehicleTime()
        self._thread = threading.Thread(target=self._work, name="scene feed", daemon=True)
        self._thread.start()

    def packet(self, packet: Packet, time_us: int) -> None:
        """Put frames that were sent or received at a time into the queue."""
        wanted = _IDS.intersection(packet.message_ids)
        if not wanted:
            return
        if wanted <= _SAMPLED:
            key = packet.sender, tuple(packet.message_ids)
            due_us = self._due_us.get(key, time_us)
            if due_us - _LEAST_US <= time_us < due_us:
                return
            self._due_us[key] = time_us + _LEAST_US
        self._put(packet)

    def show(self, shown: Shown) -> None:
        """Put an item into the queue."""
        self._put(shown)

    def observe(self, image: Image) -> None:
        """Put an image into the queue."""
        self._put(image)

    def close(self) -> None:
        """Let it draw what is in the queue, for some seconds of wall time."""
        self._ended.set()
        self._thread.join(_ENDS_WITHIN_S)
        if self._thread.is_alive():
            self.failure = self.failure or "the viewer did not take the rest of the flight"

    def _put(self, item: Packet | Shown | Image) -> None:
        if self.failure:
            return
        try:
            self._queue.put_nowait(item)
        except queue.Full:
            self.dropped += 1

    def _work(self) -> None:
        """The thread. Whatever a viewer raises ends the drawing, never the flight."""
        try:
            self._viewer.begin(self._title)
            drawings = 0
            while not self._ended.wait(_PERIOD_S):
                self._draw()
                drawings += 1
                if drawings % _LAYOUT_EACH == 1:
                    self._viewer.lay_out()
            self._draw()
            self._viewer.draw(self._scene.rest())
            self._viewer.finish()
        except (
            MissionError,
            ArithmeticError,
            LookupError,
            OSError,
            RuntimeError,
            TypeError,
            ValueError,
        ) as error:
            self.failure = str(error) or type(error).__name__

    def _draw(self) -> None:
        entries: list[Entry] = []
        for _ in range(self._queue.qsize()):
            item = self._queue.get_nowait()
            if isinstance(item, Shown):
                entries += self._scene.show(item)
            elif isinstance(item, Image):
                entries += self._scene.image(item)
            else:
                for frame in item:
                    message = read_message(frame)
                    entries += self._scene.take(self._time.stamp(message), message)
        if entries:
            self._viewer.draw(entries)
