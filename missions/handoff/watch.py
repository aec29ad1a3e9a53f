"""The estimators `handoff` of both aircraft in a mission's own loop, and the link between them."""

import asyncio
import heapq
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from autopilot_bridge.mavlink import Frame, FrameEncoder, FrameParser, MAVLinkMessage
from autopilot_bridge.mavlink.components import RANGE_RADIO_COMPONENT
from autopilot_bridge.mavlink.handoff_messages import TrackDesignation, designation_message
from estimators.handoff import HandoffEstimate, HandoffEstimator, HandoffSettings
from estimators.relative_pose import PoseMode
from estimators.runner import Runner
from flightsim.foundation.vectors import ImagePoint
from missions.vehicle.vehicle import Vehicle

__all__ = ["HandoffWatch", "Moment", "RadioLink"]


_ONBOARD: Final = 191
_EVERY_US: Final = 500_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """What the handoff aircraft knows at a time, for the picture.

    Attributes:
        time_us: time of the estimate.
        estimate: of the handoff aircraft.
        tracker: newest estimate of the tracker; None: it has none yet.
        modes: of the relative pose.
        scores: by track of the handoff aircraft.
    """

    time_us: int
    estimate: HandoffEstimate
    tracker: HandoffEstimate | None
    modes: tuple[PoseMode, ...]
    scores: dict[int, float]


class RadioLink:
    """Messages from one aircraft to the other, with losses and exponentially distributed delays.

    Args:
        loss: probability that a message is lost.
        delay_s: mean delay.
        rng: of both.

    Attributes:
        counts: messages "sent", "lost" and "delivered".
    """

    def __init__(self, loss: float, delay_s: float, rng: np.random.Generator) -> None:
        self._loss, self._delay_s, self._rng = loss, delay_s, rng
        self._under_way: list[tuple[int, int, int, MAVLinkMessage]] = []
        self._sent = 0
        self.counts: Counter[str] = Counter()

    def send(self, now_us: int, to: int, message: MAVLinkMessage) -> None:
        """Send a message to the aircraft with this index."""
        self.counts["sent"] += 1
        lost, delay_s = self._rng.random() < self._loss, self._delay_s * self._rng.exponential()
        if lost:
            self.counts["lost"] += 1
            return
        self._sent += 1
        heapq.heappush(self._under_way, (now_us + round(delay_s * 1e6), self._sent, to, message))

    def due(self, now_us: int) -> list[tuple[int, MAVLinkMessage]]:
        """The messages that arrive by now, with the index of their receiver."""
        found = []
        while self._under_way and self._under_way[0][0] <= now_us:
            _, _, to, message = heapq.heappop(self._under_way)
            self.counts["delivered"] += 1
            found.append((to, message))
        return found


class HandoffWatch:
    """Passes the messages of both aircraft to the estimators, and theirs over the link.

    Each estimator receives the messages of its own aircraft. What it publishes goes over the link to the
    other one. Before the aircraft are in contact, nothing is passed between them, and there are no ranges.

    Args:
        vehicles: the handoff aircraft and the tracker.
        settings: of the estimators, in this order.
        link: between the aircraft.

    Attributes:
        estimators: in this order.
        link: as given.
        contact: whether the aircraft are in radio contact.
        moments: of the handoff aircraft while there is contact, every half second.
        seen: of each aircraft while there is contact, image points of its tracks by time of the scan.
    """

    def __init__(
        self, vehicles: Sequence[Vehicle], settings: Sequence[HandoffSettings], link: RadioLink
    ) -> None:
        self._vehicles = tuple(vehicles)
        self.estimators = [HandoffEstimator(own) for own in settings]
        self._runners = [Runner(estimator) for estimator in self.estimators]
        self.link = link
        self.contact = False
        self.moments: list[Moment] = []
        self.seen: tuple[dict[int, dict[int, ImagePoint]], ...] = tuple({} for _ in vehicles)
        self._encoders = [FrameEncoder(vehicle.system_id, _ONBOARD) for vehicle in vehicles]
        self._parsers = [FrameParser() for _ in vehicles]
        self._stops: list[Callable[[], None]] = []

    def remarks(self, index: int) -> dict[str, float | str]:
        """Figures of one aircraft's estimator."""
        return dict(self._runners[index].remarks)

    def start(self) -> None:
        """Start to process messages."""
        names = sorted(self._runners[0].read_names | self._runners[1].read_names)
        for index, vehicle in enumerate(self._vehicles):
            connection, system_id = vehicle.link.connection, vehicle.system_id

            def take(frame: Frame, index: int = index, own: int = system_id) -> None:
                if frame.system_id == own:
                    self._take(index, frame)

            self._stops += [connection.listen(name, take) for name in names]

    def stop(self) -> None:
        """Stop processing messages."""
        for stop in self._stops:
            stop()
        self._stops = []

    def designate(self, number: int) -> None:
        """The tracker's operator designates one of its tracks; the message arrives without loss."""
        message = designation_message(TrackDesignation(system=self._vehicles[1].system_id, track=number))
        asyncio.get_running_loop().call_soon(self._arrive, 1, message)

    def _take(self, index: int, frame: Frame) -> None:
        now_us = self._vehicles[0].clock.time_us
        for to, message in self.link.due(now_us):
            # not inside this call: on a memory link the sender of the frame has not yet returned from it
            asyncio.get_running_loop().call_soon(self._arrive, to, message)
        if self.contact or frame.component_id != RANGE_RADIO_COMPONENT:
            self._feed(index, frame)

    def _feed(self, index: int, frame: Frame) -> None:
        runner = self._runners[index]
        runner.feed(frame)
        now_us = self._vehicles[0].clock.time_us
        for message in self.estimators[index].publish():
            if self.contact:
                self.link.send(now_us, 1 - index, message)
        if self.contact:
            sight = self.estimators[index].sight
            self.seen[index][sight.tracks.time_us] = sight.seen
            if index == 0:
                self._note()

    def _arrive(self, to: int, message: MAVLinkMessage) -> None:
        """A message arrives at an aircraft: it goes to its estimator, and over its link into the log."""
        (frame,) = self._parsers[to].feed(self._encoders[to].encode(message))
        self._vehicles[to].link.send(message)
        self._feed(to, frame)

    def _note(self) -> None:
        estimates = self.estimators[0].estimates
        if not estimates:
            return
        (estimate,) = estimates
        if self.moments and estimate.time_us - self.moments[-1].time_us < _EVERY_US:
            return
        process = self.estimators[0].process
        self.moments.append(
            Moment(
                time_us=estimate.time_us,
                estimate=estimate,
                tracker=next(iter(self.estimators[1].estimates), None),
                modes=tuple(process.pose.modes),
                scores=dict(process.comparison.scores),
            )
        )
