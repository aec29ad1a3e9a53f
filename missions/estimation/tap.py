"""The tap passes what a flight records to its estimators, in the same order.

A log's replay reads the frames in the order in which they were recorded. The estimators of a flight therefore
receive their input from the recorder: the flight and the replay of its own log give the same estimates on any
link.
"""

import asyncio
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage, Packet
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators.errors import EstimatorFailure
from estimators.fleet import GROUND_SYSTEM, Fleet
from estimators.interface import Outcome
from estimators.observations import SUFFIX, Observation, ObservationWriter
from estimators.runner import Runner, why_excluded
from missions.vehicle.connection import Recorder

PUBLISH_RATE_HZ: Final = 10.0
"""Highest rate at which estimates are sent, Hz; a telemetry radio can carry it."""

TEAM_SYSTEM: Final = 255
"""System id that sends the estimates of a team: a process at the base station."""


class EstimatorTap:
    """A recorder that also passes the recorded frames to estimators.

    Args:
        recorder: the recorder that stores the frames.
        fleet: the estimators.
        on_estimate: called with a runner when its estimator has a new estimate.
        log: the log that the recorder writes; observations are stored beside it.

    Attributes:
        failure: message of an error that an estimator raised; it receives no more frames after that. ""
            without an error.
        received: number of frames by (system id, message id) that estimators may receive, for rates.
        autopilots: number of frames of autopilots, by system id.
        acts: estimates are sent when their inputs are recorded.
    """

    acts: Final = True

    def __init__(
        self,
        recorder: Recorder,
        fleet: Fleet,
        on_estimate: Callable[[Runner, int], None] | None = None,
        *,
        log: Path,
    ) -> None:
        self.fleet = fleet
        self.failure = ""
        self.received: Counter[tuple[int, int]] = Counter()
        self.autopilots: Counter[int] = Counter()
        self._record = recorder.record
        self._on_estimate = on_estimate
        self._frames = 0
        self._observations = ObservationWriter(log.with_suffix(SUFFIX))

    def record(self, packet: Packet, time_us: int) -> None:
        """Record valid frames, and pass them to the estimators."""
        self._record(packet, time_us)
        for frame in packet:
            self._frames += 1
            if frame.system_id < GROUND_SYSTEM and not why_excluded(
                frame.definition.name, frame.component_id
            ):
                self.received[frame.system_id, frame.message_id] += 1
                if frame.component_id == AUTOPILOT_COMPONENT:
                    self.autopilots[frame.system_id] += 1
            self._pass_on(partial(self.fleet.feed, frame), time_us)

    def observe(self, observation: Observation, time_us: int) -> None:
        """Record an observation that is not a message, and pass it to the estimators, at a vehicle time."""
        try:
            self._observations.write(observation, self._frames)
        except OSError as error:
            self.failure = self.failure or f"can't write the observations: {error.strerror}; check the disk"
        self._pass_on(lambda: self.fleet.observe(observation), time_us)

    def close(self) -> None:
        """Close the file of the observations."""
        self._observations.close()

    def _pass_on(self, process: Callable[[], tuple[Runner, Outcome] | None], time_us: int) -> None:
        if self.failure:
            return
        try:
            result = process()
            if result is not None and result[1] is Outcome.UPDATED and self._on_estimate is not None:
                self._on_estimate(result[0], time_us)
        except EstimatorFailure as failure:
            self.failure = str(failure)

    def record_truth(self, time_us: int, frame: bytes) -> None:
        """Record a frame of truth. It is not passed to estimators, but is placed in the order of the log."""
        self.record(Packet.of_one(frame), time_us)


class Publisher:
    """Sends estimates over the link of their vehicle, at a limited rate.

    Messages are sent in a later iteration of the event loop, never inside the call that delivers the message
    from which the estimate is made: on a memory link the sender has not yet returned from that call.

    Args:
        say: sends a message for a vehicle (system id; 0: of a team) from the estimator's own component.
        rate_hz: highest rate, in vehicle time.

    Attributes:
        sent: number of messages sent so far.
    """

    def __init__(
        self, say: Callable[[int, MAVLinkMessage], None], *, rate_hz: float = PUBLISH_RATE_HZ
    ) -> None:
        self._say = say
        self._period_us = round(1e6 / rate_hz)
        self._due_us: dict[int, int] = {}
        self.sent = 0

    def on_estimate(self, runner: Runner, time_us: int) -> None:
        """Send a runner's new estimate at a vehicle time, if the rate permits.

        Raises:
            EstimatorFailure: the estimator raised an error, or returned something that is not a message.
        """
        system_id = runner.system_id or 0
        due_us = self._due_us.get(system_id)
        if due_us is not None and due_us - self._period_us <= time_us < due_us:
            return
        self._due_us[system_id] = time_us + self._period_us
        messages = runner.publish()
        if messages:
            asyncio.get_running_loop().call_soon(self._publish, system_id, messages)

    def _publish(self, system_id: int, messages: Sequence[MAVLinkMessage]) -> None:
        for message in messages:
            self._say(system_id, message)
            self.sent += 1
