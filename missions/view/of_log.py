"""Draws the scene of a log."""

from collections.abc import Sequence
from itertools import islice
from typing import Final

from estimators.logs import Log
from estimators.scene.scene import entries_of_log
from estimators.scene.shown import Shown
from estimators.scene_items import Origin
from missions.view.viewer import Viewer

__all__ = ["draw_log"]

_AT_ONCE: Final = 5000  # entries


def draw_log(log: Log, viewer: Viewer, title: str, extra: Sequence[Shown] = ()) -> bool:
    """Draw a log, and what its run has recorded beside it, as one recording.

    Args:
        log: an open log.
        viewer: an open viewer.
        title: of the recording.
        extra: what else is shown.

    Returns:
        Whether a place is known, so that there is a map.
    """
    viewer.begin(title, log)
    has_place = False
    entries = entries_of_log(log, extra)
    while some := list(islice(entries, _AT_ONCE)):
        has_place = has_place or any(isinstance(entry.item, Origin) for entry in some)
        viewer.draw(some)
    viewer.finish()
    return has_place
