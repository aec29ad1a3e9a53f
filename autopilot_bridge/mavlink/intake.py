"""Frames from the peers of one link, with limited work for each peer: no peer can block the others.

Received data wait in an inbox for each peer. Every call of `take` serves the peers in turn, each with a
limited amount of work, so that a flood delays its sender only, not the vehicle or its other clients.
"""

from collections import deque
from collections.abc import Callable, Hashable, Iterable
from dataclasses import fields
from typing import Final, Generic, TypeVar

from autopilot_bridge.mavlink.frame import Frame
from autopilot_bridge.mavlink.parser import FrameParser, ParserCounters

MAX_PEERS: Final = 64
INBOX_BYTES: Final = 256 * 1024
"""Largest amount of data that may wait for one peer."""
SHARE: Final = 400
"""Work for one peer in one `take`, in units of about a microsecond."""
TOTAL: Final = 1000
"""Work for all peers in one `take`."""
_FRAME_WORK: Final = 20  # to decode and handle one frame
_HEAVY: Final = {23: 400}  # PARAM_SET: all values that depend on a parameter are computed again
_SIGNATURE_WORK: Final = 6  # to check whether a frame is accepted
_PIECE_WORK: Final = 2
_FAILURE_WORK: Final = 1  # to detect that bytes are no frame
_BYTES_OF_WORK: Final = 64
_SLICE_BYTES: Final = 256
_SILENT_TAKES: Final = 5000  # 20 s of polls

PeerT = TypeVar("PeerT", bound=Hashable)
Admit = Callable[[list[Frame]], list[Frame]]


class _Inbox:
    """The data that one peer has sent.

    Attributes:
        parser: finds the frames.
        pieces: waiting data; `size` bytes in total.
        understood: a frame of it was accepted at least once.
        received_at: number of the last `take` with data of it.
    """

    def __init__(self) -> None:
        self.parser = FrameParser()
        self.pieces: deque[bytes] = deque()
        self.size = 0
        self.understood = False
        self.received_at = 0


class Intake(Generic[PeerT]):
    """The inboxes of one link.

    Args:
        admit: selects the accepted frames (`LinkSigning.admit`); None: all.

    Attributes:
        overrun_bytes: bytes dropped unread, because too many bytes of a peer were waiting.
    """

    def __init__(self, admit: Admit | None = None) -> None:
        self.overrun_bytes = 0
        self._admit = admit
        self._inboxes: dict[PeerT, _Inbox] = {}
        self._waiting: deque[PeerT] = deque()
        self._retired = ParserCounters()
        self._takes = 0

    def __len__(self) -> int:
        """Number of peers."""
        return len(self._inboxes)

    @property
    def counters(self) -> ParserCounters:
        """Counters of every parsed byte, over all peers so far; `sources` is left out."""
        total = ParserCounters()
        for counters in (self._retired, *(inbox.parser.counters for inbox in self._inboxes.values())):
            add_counters(total, counters)
        return total

    @property
    def pending_bytes(self) -> int:
        """Bytes of frames that are not complete yet."""
        return sum(inbox.parser.pending_bytes for inbox in self._inboxes.values())

    @property
    def waiting(self) -> bool:
        """There are unparsed data."""
        return bool(self._waiting)

    def understood(self, peer: PeerT) -> bool:
        """A frame of this peer was accepted at least once, and the peer was not forgotten."""
        inbox = self._inboxes.get(peer)
        return inbox is not None and inbox.understood

    def parse(self, peer: PeerT, data: bytes) -> list[Frame]:
        """The frames in bytes of one peer, parsed at once without a limit: for a trusted link."""
        inbox = self._inbox(peer)
        frames = inbox.parser.feed(data)
        if self._admit is not None and frames:
            frames = self._admit(frames)
        if frames:
            inbox.understood = True
        return frames

    def take(self, arrived: Iterable[tuple[PeerT, bytes]]) -> list[tuple[PeerT, list[Frame]]]:
        """Put received data into the inboxes, and return the frames within the work limit, by peer."""
        for peer, data in arrived:
            self._put(peer, data)
        self._takes += 1
        served: list[tuple[PeerT, list[Frame]]] = []
        left = TOTAL
        for _ in range(len(self._waiting)):
            if left <= 0:
                break
            peer = self._waiting.popleft()
            inbox = self._inboxes.get(peer)
            if inbox is None:
                continue
            frames, work = self._serve(inbox, min(SHARE, left))
            left -= work
            if inbox.pieces:
                self._waiting.append(peer)
            if frames:
                served.append((peer, frames))
        return served

    def _put(self, peer: PeerT, data: bytes) -> None:
        if not data:
            return
        inbox = self._inbox(peer)
        if inbox.size + len(data) > INBOX_BYTES:
            self.overrun_bytes += len(data)
            return
        if not inbox.pieces:
            self._waiting.append(peer)
        inbox.size += len(data)
        inbox.received_at = self._takes
        if len(data) <= _SLICE_BYTES:
            inbox.pieces.append(data)
        else:
            inbox.pieces += [data[at : at + _SLICE_BYTES] for at in range(0, len(data), _SLICE_BYTES)]

    def _serve(self, inbox: _Inbox, share: int) -> tuple[list[Frame], int]:
        """Frames of one inbox, and the work that they needed."""
        frames: list[Frame] = []
        work = 0
        counters, pieces = inbox.parser.counters, inbox.pieces
        while pieces and work < share:
            piece = pieces.popleft()
            inbox.size -= len(piece)
            before = counters.bad_crc + counters.unsupported_flags + counters.unknown_message
            found = inbox.parser.feed(piece)
            failures = counters.bad_crc + counters.unsupported_flags + counters.unknown_message - before
            work += _PIECE_WORK + len(piece) // _BYTES_OF_WORK + failures * _FAILURE_WORK
            if found:
                if self._admit is not None:
                    work += len(found) * _SIGNATURE_WORK
                    found = self._admit(found)
                work += sum(_HEAVY.get(frame.message_id, _FRAME_WORK) for frame in found)
                frames += found
        if frames:
            inbox.understood = True
        return frames, work

    def _inbox(self, peer: PeerT) -> _Inbox:
        inbox = self._inboxes.get(peer)
        if inbox is None:
            if len(self._inboxes) >= MAX_PEERS:
                self._retire()
            inbox = self._inboxes[peer] = _Inbox()
        return inbox

    def _retire(self) -> None:
        """Forget a peer: one without an accepted frame, else a silent one, else the newest.

        So a large number of new peers can't replace an active peer.
        """
        inboxes = self._inboxes
        stranger = next((peer for peer, inbox in inboxes.items() if not inbox.understood), None)
        silent = min(inboxes, key=lambda peer: inboxes[peer].received_at)
        if stranger is not None:
            gone = stranger
        elif self._takes - inboxes[silent].received_at > _SILENT_TAKES:
            gone = silent
        else:
            gone = next(reversed(inboxes))
        inbox = inboxes.pop(gone)
        add_counters(self._retired, inbox.parser.counters)
        self._retired.bytes_junk += inbox.parser.pending_bytes
        self.overrun_bytes += inbox.size


def add_counters(total: ParserCounters, more: ParserCounters) -> None:
    """Add the numbers of `more`; `sources` are not changed."""
    for field in fields(ParserCounters):
        value = getattr(more, field.name)
        if isinstance(value, int):
            setattr(total, field.name, getattr(total, field.name) + value)
