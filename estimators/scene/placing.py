"""Gives what is shown its place on the scene, by what the messages say about vehicles and origins."""

from typing import Final

import numpy as np

from estimators.messages import Message
from estimators.observations import Image
from estimators.scene.estimates import items_of
from estimators.scene.messages import PERIOD_US, MessageScene
from estimators.scene.shown import Estimates, Shown
from estimators.scene_items import Camera, Cleared, Entry, Item, Picture, Placed, Relative, Text, Value

__all__ = ["Assembly", "placed"]

_TRUTH_WITHIN_US: Final = 2 * PERIOD_US
_WITHOUT_PLACE: Final = (Value, Text, Picture, Cleared)


class Assembly:
    """Assembles a scene of messages and of what is shown, in the order in which they come.

    What is shown before the scene has an origin waits for it, and estimates wait for the truth of their time.
    """

    def __init__(self) -> None:
        self._messages = MessageScene()
        self._waiting: list[Shown] = []

    @property
    def newest_us(self) -> int:
        """Newest time of a message, on the timeline."""
        return self._messages.timeline.newest_us

    def take(self, time_us: int, message: Message) -> list[Entry]:
        """The entries of a message at a vehicle time, and of what has waited for it."""
        entries = self._messages.take(time_us, message)
        return entries + self._ready() if self._waiting else entries

    def show(self, shown: Shown) -> list[Entry]:
        """The entries of what is shown."""
        self._waiting.append(shown)
        return self._ready()

    def rest(self) -> list[Entry]:
        """The entries of what still waits, when nothing more comes."""
        waiting, self._waiting = self._waiting, []
        return [entry for shown in waiting for entry in placed(shown, self._messages)]

    def _ready(self) -> list[Entry]:
        """The entries of what need not wait any more."""
        ready = [shown for shown in self._waiting if self._is_ready(shown)]
        if not ready:
            return []
        self._waiting = [shown for shown in self._waiting if not self._is_ready(shown)]
        return [entry for shown in ready for entry in placed(shown, self._messages)]

    def _is_ready(self, shown: Shown) -> bool:
        """Estimates wait for the truth of their time, and what has a place for the origin."""
        if not isinstance(shown.item, Estimates):
            return self._messages.origin is not None or isinstance(shown.item, _WITHOUT_PLACE)
        timeline, time_us = self._messages.timeline, shown.time_us
        if shown.subject.system_id:
            time_us = timeline.common_us(time_us, shown.subject.system_id)
        return timeline.newest_us >= time_us + _TRUTH_WITHIN_US

    def image(self, image: Image) -> list[Entry]:
        """The entries of a camera's image: the picture, and the camera where its place is known."""
        path = f"vehicles/{image.src_system}/camera"
        time_us = self._messages.timeline.common_us(image.time_us, image.src_system)
        found = [Entry(f"{path}/picture", time_us, Picture(pixels=image.pixels))]
        if np.isfinite([*image.pos_ned_m, *image.q_ned_from_camera]).all():
            height_px, width_px = image.pixels.shape[:2]
            camera = Camera(
                pos_ned_m=image.pos_ned_m,
                q_ned_from_camera=image.q_ned_from_camera,
                width_px=width_px,
                height_px=height_px,
                focal_px=image.focal_px,
                centre_px=image.centre_px,
                distortion=image.distortion,
            )
            found.insert(0, Entry(path, time_us, camera))
        return found


def placed(shown: Shown, messages: MessageScene) -> list[Entry]:
    """The entries of what is shown; none: where it is is not known (yet).

    Args:
        shown: the item, with its subject's time and origin.
        messages: the scene of the messages until then.
    """
    subject, item = shown.subject, shown.item
    time_us = shown.time_us
    if subject.system_id:
        time_us = messages.timeline.common_us(time_us, subject.system_id)
    if isinstance(item, Estimates):
        truth = messages.true_columns(item.system_id, time_us, shown.origin)
        items = items_of(item, truth)
    else:
        items = {shown.name: item}
    entries = []
    for name, own in items.items():
        found = _placed(own, shown, messages)
        if found is not None:
            entries.append(Entry(f"{subject.base}/{name}", time_us, found))
    return entries


def _placed(item: Item, shown: Shown, messages: MessageScene) -> Placed | None:
    if isinstance(item, _WITHOUT_PLACE):
        return item
    if messages.origin is None:
        return None
    if isinstance(item, Relative):
        place = messages.place_of_vehicle(item.system_id)
        return None if place is None else item.item.moved(place)
    if shown.origin is None:
        return item
    shift = messages.shift_of(shown.origin)
    return None if shift is None else item.moved(shift)
