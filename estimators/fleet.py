"""Runners of estimators: one for each vehicle that is received, or one for the team."""

from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType
from typing import Any, Final

from autopilot_bridge.mavlink import Frame
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators.interface import Estimator, Outcome
from estimators.messages import Message, read_message
from estimators.observations import Observation
from estimators.runner import Runner
from estimators.vehicle_time import VehicleTime, stamp_field

GROUND_SYSTEM: Final = 200
"""By convention, system ids from here on belong to ground stations and simulated targets."""
MAX_VEHICLES: Final = 64
"""Largest number of runners, because any sender can use any system id."""


class Fleet:
    """Passes each vehicle's messages to its runner, and creates a runner when a new vehicle is received.

    Args:
        make: creates a new estimator.
        system_ids: the vehicles to use; None: all. It has no effect for estimators of a team.
        single: use only the first vehicle that is received.

    Attributes:
        name, needs, parameters, observes: of the estimators.
        team: one runner receives the messages of all vehicles.
        names: names of the messages that the estimators receive.
        read_names: names of the messages that must be read from a log.

    Raises:
        EstimatorError: the estimator needs a message that it is not allowed to receive.
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
        self.read_names = self._spare.read_names
        self.parameters = first.parameters
        self.observes = first.OBSERVES
        self._system_ids = system_ids
        self._limit = 1 if single else MAX_VEHICLES
        self._vehicle_time = VehicleTime()
        self._read: dict[int, bool] = {}
        self._runners: dict[int, Runner] = {0: self._spare} if self.team else {}

    @property
    def runners(self) -> Mapping[int, Runner]:
        """Runners by system id; the runner of a team has the key 0."""
        return MappingProxyType(self._runners)

    def feed(self, frame: Frame) -> tuple[Runner, Outcome] | None:
        """Process a frame of a link. Pass every received frame, in order, because all of them define the
        vehicle time.

        Returns:
            The runner that processed it and the outcome; None if it was left out.
        """
        read = self._read.get(frame.message_id)
        if read is None:
            definition = frame.definition
            has_time = stamp_field(definition.name, definition.field_names) is not None
            read = self._read[frame.message_id] = has_time or definition.name in self.read_names
        if not read:
            return None
        message = read_message(frame)
        time_us = self._vehicle_time.stamp(message)
        return self.take(time_us, message) if message.name in self.read_names else None

    def newest_us(self, system_id: int) -> int:
        """Newest vehicle time of a system in the frames fed so far; 0: none yet."""
        return self._vehicle_time.newest_us(system_id)

    def take(self, time_us: int, message: Message) -> tuple[Runner, Outcome] | None:
        """Process a message at its vehicle time; returns the same as `feed`.

        Raises:
            EstimatorFailure: the estimator raised an error.
        """
        runner = self._runner_of(message)
        outcome = None if runner is None else runner.take(time_us, message)
        return None if runner is None or outcome is None else (runner, outcome)

    def observe(self, observation: Observation) -> tuple[Runner, Outcome] | None:
        """Process an observation; returns the same as `feed`. A vehicle has a runner from its first needed
        message on.

        Raises:
            EstimatorFailure: the estimator raised an error.
        """
        runner = self._runners.get(0 if self.team else observation.src_system)
        outcome = None if runner is None else runner.observe(observation)
        return None if runner is None or outcome is None else (runner, outcome)

    def pass_over(self, time_us: int, message: Message) -> None:
        """Skip a message that is outside the selected part; the boots of its vehicle are still counted.

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
        # The first estimator was created only to read its needs.
        runner = self._spare if self._spare is not None else Runner(self._make())
        self._spare = None
        runner.system_id = system_id
        self._runners[system_id] = runner
        return runner
