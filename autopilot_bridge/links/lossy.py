"""A link with faults: the standard fixture of tests over a bad radio."""

import heapq
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from typing import Generic, TypeVar

import numpy as np

from autopilot_bridge.links.link import Link, LinkCounters, PeerId

To = TypeVar("To")


@dataclass(frozen=True, slots=True, kw_only=True)
class Impairment:
    """The faults of a radio link. Probabilities are independent for each piece.

    Attributes:
        loss: probability that a piece is lost.
        duplicate: probability that it arrives twice.
        reorder: probability that it arrives after the next one.
        delay_s: transport delay.
        jitter_s: additional time, uniform from 0; keeps the order.
    """

    loss: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0

    def __post_init__(self) -> None:
        for name in ("loss", "duplicate", "reorder"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} {getattr(self, name)} is not a probability in 0..1")
        for name in ("delay_s", "jitter_s"):
            if not 0.0 <= getattr(self, name) < float("inf"):
                raise ValueError(f"{name} {getattr(self, name)} is not a time of 0 s or more")


class LossyLink:
    """A link with faults, in both directions. Pieces move when `send`, `receive` or `update` is called.

    Args:
        link: the link to impair.
        impairment: the faults.
        generator: random generator, for this link alone.
        time_us: returns the time of the delays.
    """

    def __init__(
        self,
        link: Link,
        impairment: Impairment,
        *,
        generator: np.random.Generator,
        time_us: Callable[[], int],
    ) -> None:
        self._link = link
        self.counters = LinkCounters()
        outgoing, incoming = generator.spawn(2)
        self._outgoing: _Impaired[PeerId | None] = _Impaired(impairment, outgoing, time_us)
        self._incoming: _Impaired[PeerId] = _Impaired(impairment, incoming, time_us)

    @property
    def description(self) -> str:
        """That of the link inside."""
        return f"lossy {self._link.description}"

    @property
    def peers(self) -> tuple[PeerId, ...]:
        """Those of the link inside."""
        return self._link.peers

    @property
    def congested(self) -> bool:
        """As the link inside."""
        return self._link.congested

    def send(self, data: bytes, to: PeerId | None = None) -> None:
        """Send, unless the data are lost."""
        self.counters.writes += 1
        self.counters.bytes_out += len(data)
        self._outgoing.put(to, data)
        self.update()

    def receive(self) -> list[tuple[PeerId, bytes]]:
        """The data that have arrived so far."""
        self.update()
        received = self._incoming.take_due()
        self.counters.reads += len(received)
        self.counters.bytes_in += sum(len(data) for _, data in received)
        return received

    def update(self) -> None:
        """Deliver the pieces that are due."""
        for peer, data in self._link.receive():
            self._incoming.put(peer, data)
        for to, data in self._outgoing.take_due():
            self._link.send(data, to)
        self.counters.dropped = self._outgoing.lost + self._incoming.lost

    def filenos(self) -> tuple[int, ...]:
        """Those of the link inside."""
        return self._link.filenos()

    def close(self) -> None:
        """Close the link inside; pieces in transit are lost."""
        self._link.close()


class _Impaired(Generic[To]):
    """Pieces in transit in one direction."""

    def __init__(
        self, impairment: Impairment, generator: np.random.Generator, time_us: Callable[[], int]
    ) -> None:
        self._impairment = impairment
        self._generator = generator
        self._time_us = time_us
        self._queue: list[tuple[int, int, To, bytes]] = []
        self._order = count()
        self._last_due_us = 0
        self._held: tuple[To, bytes] | None = None
        self.lost = 0

    def put(self, to: To, data: bytes) -> None:
        """Start the transport of a piece. Every piece draws the same number of random values, lost or not."""
        impairment = self._impairment
        lost, twice, swapped, jitter = self._generator.random(4)
        if lost < impairment.loss:
            self.lost += 1
            return
        due_us = self._time_us() + round((impairment.delay_s + jitter * impairment.jitter_s) * 1e6)
        self._last_due_us = max(due_us, self._last_due_us)
        if swapped < impairment.reorder and self._held is None:
            self._held = (to, data)
            return
        self._push(to, data)
        if twice < impairment.duplicate:
            self._push(to, data)
        if self._held is not None:
            self._push(*self._held)
            self._held = None

    def take_due(self) -> list[tuple[To, bytes]]:
        """The pieces that have arrived by now, in the order of arrival."""
        now_us = self._time_us()
        due: list[tuple[To, bytes]] = []
        while self._queue and self._queue[0][0] <= now_us:
            _, _, to, data = heapq.heappop(self._queue)
            due.append((to, data))
        return due

    def _push(self, to: To, data: bytes) -> None:
        heapq.heappush(self._queue, (self._last_due_us, next(self._order), to, data))
