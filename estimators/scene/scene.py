"""The scene of a recorded run or log, and what of it is shown at a time."""

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from estimators.observations import Image, observations_beside, read_observations
from estimators.scene.messages import ORIGIN, MessageScene
from estimators.scene.placing import placed
from estimators.scene.recording import read_scene, scene_beside
from estimators.scene.shown import Shown
from estimators.scene_items import Camera, Entry, Origin, Picture, Placed

if TYPE_CHECKING:
    from estimators.logs import Log

__all__ = ["Scene", "entries_of_image", "entries_of_log"]


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
    messages = MessageScene()
    beside = scene_beside(log.path)
    pending = sorted([*(read_scene(beside) if beside else ()), *extra], key=lambda shown: shown.time_us)
    yield from _merged(log, messages, pending)
    images = observations_beside(log.path)
    if images is not None:
        for _, image in read_observations(images, (Image,)):
            assert isinstance(image, Image)
            yield from entries_of_image(image, messages)


def _merged(log: "Log", messages: MessageScene, pending: list[Shown]) -> Iterator[Entry]:
    names = sorted({key.name for key in log.keys} & messages.NAMES)
    waiting: list[Shown] = []  # until it is known where they are
    done = 0
    for time_us, message in log.messages(names):
        yield from messages.take(time_us, message)
        while done < len(pending) and pending[done].time_us <= messages.timeline.newest_us:
            waiting.append(pending[done])
            done += 1
        if waiting:
            yield from _placed_of(waiting, messages)
    waiting += pending[done:]
    yield from _placed_of(waiting, messages)


def _placed_of(waiting: list[Shown], messages: MessageScene) -> Iterator[Entry]:
    """The entries of those whose place is known; the others remain."""
    if messages.origin is None:
        return
    for shown in waiting:
        yield from placed(shown, messages)
    waiting.clear()


def entries_of_image(image: Image, messages: MessageScene) -> list[Entry]:
    """A camera's image, and the camera where its place is known."""
    path = f"vehicles/{image.src_system}/camera"
    time_us = messages.timeline.common_us(image.time_us, image.src_system)
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


def _time_us(entry: Entry) -> int:
    return entry.time_us
