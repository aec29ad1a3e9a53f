"""The scene of a recorded run or log, and what of it is shown at a time."""

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from estimators.logs.iterate import Selection, messages_in_order
from estimators.observations import Image, observations_beside, read_observations
from estimators.scene.messages import ORIGIN, MessageScene
from estimators.scene.placing import Assembly
from estimators.scene.recording import read_scene, scene_beside
from estimators.scene.shown import Shown
from estimators.scene_items import Entry, Origin, Placed

if TYPE_CHECKING:
    from estimators.logs import Log

__all__ = ["Scene", "entries_of_log"]


class Scene:
    """Entries by path, each in the order of time.

    Args:
        entries: in any order of paths.

    Attributes:
        paths: sorted.
    """

    def __init__(self, entries: Iterable[Entry]) -> None:
        by_path: dict[str, list[Entry]] = {}
        for entry in entries:
            by_path.setdefault(entry.path, []).append(entry)
        self._by_path = {path: sorted(by_path[path], key=_time_us) for path in sorted(by_path)}
        self.paths = tuple(self._by_path)

    @classmethod
    def of_log(cls, log: "Log") -> "Scene":
        """The scene of a log, with what its run has recorded beside it."""
        return cls(entries_of_log(log))

    @property
    def origin(self) -> Origin | None:
        """The origin of its positions; None: no place is known."""
        found = self._by_path.get(ORIGIN, ())
        return next((entry.item for entry in found if isinstance(entry.item, Origin)), None)

    @property
    def span_us(self) -> tuple[int, int]:
        """First and last time of its entries; 0, 0 without entries."""
        ends = [(own[0].time_us, own[-1].time_us) for own in self._by_path.values()]
        return (min(a for a, _ in ends), max(b for _, b in ends)) if ends else (0, 0)

    def __getitem__(self, path: str) -> tuple[Entry, ...]:
        """All entries of a path, in the order of time."""
        return tuple(self._by_path[path])

    def __iter__(self) -> Iterator[Entry]:
        """All entries in the order of time."""
        return iter(sorted((entry for own in self._by_path.values() for entry in own), key=_time_us))

    def at(self, time_us: int) -> Mapping[str, Placed]:
        """What is shown at a time: the newest item of each path."""
        found = {}
        for path, own in self._by_path.items():
            number = bisect_right(own, time_us, key=_time_us)
            if number:
                found[path] = own[number - 1].item
        return found


def entries_of_log(log: "Log", extra: Iterable[Shown] = ()) -> Iterator[Entry]:
    """The entries of a log in its order: of its messages, and of what was recorded beside it.

    Args:
        log: an open log: .tlog, .bin or .ulg.
        extra: what else is shown, in the order of time, such as by estimators that are run over it.
    """
    scene = Assembly()
    beside = scene_beside(log.path)
    pending = sorted([*(read_scene(beside) if beside else ()), *extra], key=lambda shown: shown.time_us)
    names = sorted({key.name for key in log.keys} & MessageScene.NAMES)
    done = 0
    for time_us, message in messages_in_order(log.source, _thinned(log, log.select(names))):
        yield from scene.take(time_us, message)
        while done < len(pending) and pending[done].time_us <= scene.newest_us:
            yield from scene.show(pending[done])
            done += 1
    for shown in pending[done:]:
        yield from scene.show(shown)
    yield from scene.rest()
    images = observations_beside(log.path)
    if images is not None:
        for _, image in read_observations(images, (Image,)):
            assert isinstance(image, Image)
            yield from scene.image(image)


def _thinned(log: "Log", selections: Sequence[Selection]) -> list[Selection]:
    """The rows that the scene uses of messages that come often, chosen before they are decoded."""
    found = []
    for stream, rows in selections:
        period_us = MessageScene.SAMPLED.get(stream.name)
        if period_us is not None:
            slots = log.source.time_us[stream.order[rows]] // period_us
            rows = rows[np.append(True, slots[1:] != slots[:-1])]
        found.append((stream, rows))
    return found


def _time_us(entry: Entry) -> int:
    return entry.time_us
