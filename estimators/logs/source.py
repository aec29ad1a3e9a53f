"""The interface that a file format must implement to be opened as a `Log`."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimators.logs.columns import Columns
from estimators.logs.dialect import Description, Dialect

Positions = NDArray[np.int32] | NDArray[np.int64]
"""Positions of messages in a log."""


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """All messages of one kind from one component.

    Attributes:
        description: description of the message.
        system_id, component_id: ids of the sender.
        order: positions of the messages in the log, ascending; int32 or int64.
    """

    description: Description
    system_id: int
    component_id: int
    order: Positions

    @property
    def name(self) -> str:
        """Name of the message."""
        return self.description.name


@dataclass(frozen=True, slots=True, kw_only=True)
class UnknownMessage:
    """Frames of a message that the dialect does not know.

    Attributes:
        message_id: its number.
        system_id, component_id: ids of the sender.
        count: number of frames.
        frame_bytes: number of bytes in them; their checksums can't be verified.
    """

    message_id: int
    system_id: int
    component_id: int
    count: int
    frame_bytes: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceLoss:
    """Received and lost frames of one component, from its sequence numbers.

    Attributes:
        system_id, component_id: the component.
        frames: number of valid frames.
        lost: frames missing from the sequence, without those that arrived late.
        late: frames that arrived after a later one, or twice.
    """

    system_id: int
    component_id: int
    frames: int
    lost: int
    late: int


class LogSource(ABC):
    """A file's messages. Messages are numbered in the order of the file; no method makes an object per
    message.

    Attributes:
        path: the file.
        size_bytes: its size.
        format: "tlog", "raw MAVLink", "bin", "ulg".
        dialect: definitions of the messages; the columns are in their wire units.
        streams: all streams with at least one message, in the order of their first message.
        count: total number of messages.
    """

    path: Path
    size_bytes: int
    format: str
    dialect: Dialect
    streams: Sequence[Stream]
    count: int

    @property
    @abstractmethod
    def time_us(self) -> NDArray[np.int64]:
        """Vehicle time of every message, (count,); see `estimators.vehicle_time`."""

    @property
    @abstractmethod
    def boot_starts(self) -> Mapping[int, NDArray[np.int64]]:
        """By system id: positions of the messages that begin its second, third, ... boot."""

    @abstractmethod
    def log_time_us(self, order: Positions) -> NDArray[np.int64]:
        """Unix microseconds at which the messages at these positions were recorded; 0 where not known."""

    @abstractmethod
    def columns(self, stream: Stream, rows: slice | NDArray[np.int64]) -> Columns:
        """Fields of some messages of a stream, in the order of the wire, in wire units.

        Args:
            stream: one of `streams`.
            rows: numbers of its messages in the stream.
        """

    @property
    @abstractmethod
    def bytes_by_kind(self) -> Mapping[str, int]:
        """The bytes of the file, by the use of each; the sum is `size_bytes`."""

    @property
    def drops(self) -> Mapping[str, int]:
        """Number of dropped items, by reason."""
        return {}

    @property
    def remarks(self) -> Mapping[str, int | str]:
        """Additional figures for the report."""
        return {}

    @property
    def losses(self) -> Sequence[SourceLoss]:
        """Losses from sequence numbers; empty for formats without sequence numbers."""
        return ()

    @property
    def unknown(self) -> Sequence[UnknownMessage]:
        """Messages that the dialect does not know."""
        return ()
