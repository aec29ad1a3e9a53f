"""An estimator for every vehicle that is heard: a runner each, or one for the team."""

from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType
from typing import Any, Final

from autopilot_bridge.mavlink import Frame
from estimators.interface import Estimator, Outcome
from estimators.messages import Message, read_message
from estimators.runner import Runner
from estimators.vehicle_time import VehicleTime, stamp_field

__all__ = ["AUTOPILOT_COMPONENT", "GROUND_SYSTEM", "MAX_VEHICLES", "Fleet"]

AUTOPILOT_COMPONENT: Final = 1
GROUND_SYSTEM: Final = 200
"""System ids from here on are ground stations and simulated targets, by custom."""
MAX_VEHICLES: Final = 64
"""Runners at most: anybody can send with any system id."""


class Fleet:
    """Gives each vehicle's messages to its runner, and makes one where a new vehicle is heard.

    Args:
        make: a fresh estimator.
        system_ids: the vehicles that count; None: all. Without effect on estimators of a team.
        single: only the first vehicle that is heard.

    Attributes:
        name, needs, parameters: of the estimators.
        team: one runner hears all vehicles.
        names: messages that the estimators are given.
        heard_names: what must be read of a log.

    Raises:
        EstimatorError: the estimator needs what it may not see.
    """

    def __init__(
        self,
        make: Callable[[], Estimator[Any]],
        *,
        system_ids: Collection[int] | None = None,
        single: bool = False,
    ) -> None:
        self._make = make
        first = make()
        self._spare: Runner | None = Runner(first)
        self.name = first.NAME
        self.team = first.TEAM
        self.needs = first.needs
        self.names = self._spare.names
        self.heard_names = self._spare.heard_names
        self.parameters = first.parameters
        self._system_ids = system_ids
        self._limit = 1 if single else MAX_VEHICLES
        self._vehicle_time = VehicleTime()
        self._read: dict[int, bool] = {}
        self._runners: dict[int, Runner] = {0: self._spare} if self.team else {}

    @property
    def runners(self) -> Mapping[int, Runner]:
        """By system id; of a team the one runner, as 0."""
        return MappingProxyType(self._runners)

    def feed(self, frame: Frame) -> tuple[Runner, Outcome] | None:
        """Take a frame of a link; every one that was heard, in order, for the time is told by all of them.

        Returns:
            The runner that took it and what became of it; None where it was left out.
        """
        heard = self._read.get(frame.message_id)
        if heard is None:
            definition = frame.definition
            tells_time = stamp_field(definition.name, definition.field_names) is not None
            heard = self._read[frame.message_id] = tells_time or definition.name in self.heard_names
        if not heard:
            return None
        message = read_message(frame)
        time_us = self._vehicle_time.stamp(message)
        return self.take(time_us, message) if message.name in self.heard_names else None

    def newest_us(self, system_id: int) -> int:
        """Newest vehicle time that a system has told in the frames fed; 0: none yet."""
        return self._vehicle_time.newest_us(system_id)

    def take(self, time_us: int, message: Message) -> tuple[Runner, Outcome] | None:
        """Take a message at its vehicle time; as `feed`.

        Raises:
            EstimatorFailure: the estimator raised an error.
        """
        runner = self._runner_of(message)
        outcome = None if runner is None else runner.take(time_us, message)
        return None if runner is None or outcome is None else (runner, outcome)

    def pass_over(self, time_us: int, message: Message) -> None:
        """Leave a message out that is not asked for; the boots of its vehicle are counted all the same.

        Raises:
            EstimatorFailure: the estimator raised an error.
        """
        runner = self._runner_of(message)
        if runner is not None:
            runner.pass_over(time_us, message)

    def _runner_of(self, message: Message) -> Runner | None:
        runner = self._runners.get(0 if self.team else message.src_system)
        return self._new_runner(message) if runner is None else runner

    def _new_runner(self, message: Message) -> Runner | None:
        system_id = message.src_system
        if (
            message.src_component != AUTOPILOT_COMPONENT
            or system_id >= GROUND_SYSTEM
            or message.name not in self.names
            or (self._system_ids is not None and system_id not in self._system_ids)
            or len(self._runners) >= self._limit
        ):
            return None
        # The first estimator was made to see what it needs.
        runner = self._spare if self._spare is not None else Runner(self._make())
        self._spare = None
        runner.system_id = system_id
        self._runners[system_id] = runner
        return runner
