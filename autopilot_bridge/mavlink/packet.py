"""Frames of one sender that are sent together: their bytes and message ids, taken apart only when needed."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from operator import itemgetter

from autopilot_bridge.mavlink.frame import OVERHEAD_V2, Frame, new_frame

_sender = itemgetter(2, 3)  # system and component id of a `Frame`


class Packet:
    """Valid frames of one component, in sequence.

    Args:
        data: one or more whole MAVLink 2 frames without signatures. `Packet.of` takes any valid frames.
        message_ids: of each frame.

    Attributes:
        data, message_ids: as passed to the constructor.
    """

    __slots__ = ("_frames", "_given", "_starts", "data", "message_ids")

    def __init__(self, data: bytes, message_ids: tuple[int, ...]) -> None:
        self.data = data
        self.message_ids = message_ids
        self._given = False  # frames that need not be of MAVLink 2, or are signed
        self._frames: list[Frame | None] = [None] * len(message_ids)  # those that were asked for
        self._starts: list[int] | None = None  # of each frame in `data`, and the end

    @classmethod
    def of(cls, frames: Sequence[Frame]) -> "Packet":
        """The packet of one or more frames of one component, of any MAVLink version, signed or not."""
        packet = cls(
            b"".join([frame.raw for frame in frames]) if len(frames) > 1 else frames[0].raw,
            tuple([frame.message_id for frame in frames]),
        )
        packet._frames = [*frames]
        packet._given = True
        return packet

    @classmethod
    def of_one(cls, raw: bytes) -> "Packet":
        """The packet of one frame that an encoder has made, or that a parser has checked before."""
        return cls.of([Frame.of(raw)])

    @classmethod
    def by_sender(cls, frames: Iterable[Frame]) -> "Iterator[Packet]":
        """The packets of frames of any components, in the same order."""
        for _, run in groupby(frames, _sender):
            yield cls.of(list(run))

    @property
    def sender(self) -> tuple[int, int]:
        """System and component id."""
        return _sender(self.frame(0)) if self._given else (self.data[5], self.data[6])

    @property
    def frames(self) -> list[Frame]:
        """The frames; always the same objects."""
        return [self.frame(index) for index in range(len(self.message_ids))]

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.message_ids)

    def __iter__(self) -> Iterator[Frame]:
        """The frames in sequence."""
        return iter(self.frames)

    def frame(self, index: int) -> Frame:
        """One of the frames; always the same object."""
        found = self._frames[index]
        if found is None:
            starts = self._starts or self._found_starts()
            raw = self.data[starts[index] : starts[index + 1]]
            found = new_frame((raw, self.message_ids[index], raw[5], raw[6], raw[4], 2, False))
            self._frames[index] = found
        return found

    def newest(self, message_id: int) -> Frame:
        """The last frame with an id that is in `message_ids`; always the same object."""
        ids = self.message_ids
        return self.frame(len(ids) - 1 - ids[::-1].index(message_id))

    def part(self, begin: int, end: int) -> "Packet":
        """The packet of some of the frames: at least one."""
        if end - begin == len(self.message_ids):
            return self
        if self._given:
            return Packet.of(self.frames[begin:end])
        starts = self._starts or self._found_starts()
        return Packet(self.data[starts[begin] : starts[end]], self.message_ids[begin:end])

    def _found_starts(self) -> list[int]:
        data, start = self.data, 0
        self._starts = starts = [0]
        for _ in self.message_ids:
            start += OVERHEAD_V2 + data[start + 1]
            starts.append(start)
        return starts
