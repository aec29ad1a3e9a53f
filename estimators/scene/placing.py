"""Gives what is shown its place on the scene, by what the messages say about vehicles and origins."""

from estimators.scene.estimates import items_of
from estimators.scene.messages import MessageScene
from estimators.scene.shown import Estimates, Shown
from estimators.scene_items import Entry, Item, Placed, Relative

__all__ = ["placed"]


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
    if isinstance(item, Relative):
        place = messages.place_of_vehicle(item.system_id)
        return None if place is None else item.item.moved(place)
    if shown.origin is None:
        return item
    shift = messages.shift_of(shown.origin)
    return None if shift is None else item.moved(shift)
