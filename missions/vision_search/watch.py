"""The estimators `vision-search` of a team in a mission's own loop, and the link between them."""

import heapq
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from autopilot_bridge.mavlink import Frame, FrameEncoder, FrameParser
from autopilot_bridge.mavlink.search_likelihood import search_likelihood_message
from estimators.runner import Runner
from estimators.vision_search import AreaEstimate, VisionSearchEstimator, VisionSearchParameters
from flightsim.foundation.geodesy import GeodeticPosition
from missions.vehicle.vehicle import Vehicle
from missions.vision_search.options import LinkQuality

__all__ = ["CameraWatch"]

_ONBOARD: Final = 191
_OF_ALL: Final = frozenset({"HOME_POSITION", "GLOBAL_POSITION_INT", "SYSTEM_TIME"})
"""Messages that every vehicle's estimator receives of all vehicles."""
_REPEAT_US: Final = 1_000_000


class CameraWatch:
    """Passes each vehicle's messages to its own estimator, and the likelihoods to those of the others.

    What a vehicle receives of the others is in the log, when it is received, with the vehicle as its target.

    Args:
        vehicles: the vehicles of the team.
        parameters: of the estimators, each for its own vehicle.
        quality: of the link between the vehicles.
        on_estimate: called with the index of the vehicle and its new estimate.
        seed: of the link's losses and delays.

    Attributes:
        estimators: one per vehicle.
        counts: likelihoods "sent", "lost" and "delivered", repetitions included.
    """

    def __init__(
        self,
        vehicles: Sequence[Vehicle],
        parameters: Sequence[VisionSearchParameters],
        quality: LinkQuality,
        on_estimate: Callable[[int, AreaEstimate], None],
        *,
        seed: np.random.SeedSequence,
    ) -> None:
        self._vehicles = tuple(vehicles)
        self.estimators = [VisionSearchEstimator(own) for own in parameters]
        self._runners = [Runner(estimator) for estimator in self.estimators]
        self._quality, self._on_estimate = quality, on_estimate
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._encoders = [FrameEncoder(vehicle.system_id, _ONBOARD) for vehicle in vehicles]
        self._parsers = [FrameParser() for _ in vehicles]
        self._under_way: list[tuple[int, int, int, Frame]] = []
        self._sent = 0
        self._seen: list[AreaEstimate | None] = [None] * len(self.estimators)
        self._stops: list[Callable[[], None]] = []
        self.counts: Counter[str] = Counter()

    @property
    def origin(self) -> GeodeticPosition | None:
        """The origin of places; None before the first frame from the air."""
        return self.estimators[0].origin

    def remarks(self, index: int) -> dict[str, float | str]:
        """Figures of one vehicle's estimator."""
        return dict(self._runners[index].remarks)

    def start(self) -> None:
        """Start to process messages."""
        for index, vehicle in enumerate(self._vehicles):
            connection, system_id = vehicle.link.connection, vehicle.system_id

            for name in sorted(self._runners[index].read_names):

                def take(frame: Frame, index: int = index, own: int = system_id, name: str = name) -> None:
                    if frame.system_id == own:
                        self._take(index, name, frame)

                self._stops.append(connection.listen(name, take))

    def stop(self) -> None:
        """Stop processing messages."""
        for stop in self._stops:
            stop()
        self._stops = []

    def _take(self, index: int, name: str, frame: Frame) -> None:
        self._feed(index, frame)
        if name in _OF_ALL:
            for other in range(len(self._runners)):
                if other != index:
                    self._feed(other, frame)
        if len(self._runners) > 1:
            self._send(index)
            self._deliver(self._vehicles[0].clock.time_us)

    def _feed(self, index: int, frame: Frame) -> None:
        self._runners[index].feed(frame)
        estimates = self.estimators[index].estimates
        if estimates and estimates[0] is not self._seen[index]:
            self._seen[index] = estimates[0]
            self._on_estimate(index, estimates[0])

    def _send(self, index: int) -> None:
        """Send the new likelihoods of a vehicle, as its onboard computer would."""
        for likelihood in self.estimators[index].take_likelihoods():
            for other, vehicle in enumerate(self._vehicles):
                if other != index:
                    message = search_likelihood_message(likelihood, target_system=vehicle.system_id)
                    (frame,) = self._parsers[index].feed(self._encoders[index].encode(message))
                    self._send_to(other, frame)

    def _send_to(self, other: int, frame: Frame) -> None:
        quality, now_us = self._quality, self._vehicles[0].clock.time_us
        for k in range(quality.repeats):
            self.counts["sent"] += 1
            lost, delay_s = self._rng.random() < quality.loss, quality.delay_s * self._rng.exponential()
            if lost:
                self.counts["lost"] += 1
                continue
            self._sent += 1
            due_us = now_us + k * _REPEAT_US + round(delay_s * 1e6)
            heapq.heappush(self._under_way, (due_us, self._sent, other, frame))

    def _deliver(self, now_us: int) -> None:
        while self._under_way and self._under_way[0][0] <= now_us:
            _, _, other, frame = heapq.heappop(self._under_way)
            self.counts["delivered"] += 1
            self._vehicles[other].link.connection.keep_of_another_link(frame)
            self._feed(other, frame)
