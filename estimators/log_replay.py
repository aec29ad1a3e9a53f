"""Runs an estimator over a log. Only the messages that it needs are read: seconds for hours of flight."""

import heapq
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators import wire
from estimators.errors import EstimatorError, EstimatorFailure
from estimators.fleet import GROUND_SYSTEM, Fleet
from estimators.interface import Estimator, Need, Outcome
from estimators.library import make_estimator
from estimators.messages import Message, is_a
from estimators.needs import NOT_STREAMED, Supply, supplies
from estimators.observations import Observation, observations_beside, read_observations
from estimators.runner import Runner, why_excluded

if TYPE_CHECKING:
    from estimators.logs import Log

Received = tuple[int, Message | Observation, bool]
"""Vehicle time us, what was received, whether it is inside the replayed part."""

_LEARNT_FROM = 20
"""Number of SYSTEM_TIMEs of each vehicle that are read before several logs are put in order."""


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a log; the fields are arguments of `Log.inside`."""

    from_s: float | None = None
    to_s: float | None = None
    boot: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """The result of a replay.

    Attributes:
        logs: the replayed logs.
        fleet: runners with their estimates and counters.
        supplies: by system id: the supply of each need.
        lacking: by system id: texts about missing messages. The estimator was not run for such a vehicle, nor
            for a team with it.
        failure: message of an error that the estimator raised; the estimates end there. "" if none.
    """

    logs: Sequence["Log"]
    fleet: Fleet
    supplies: dict[int, list[Supply]]
    lacking: dict[int, list[str]]
    failure: str = ""

    @property
    def partial(self) -> bool:
        """Whether messages were missing, so that the result is incomplete."""
        return bool(self.failure or self.lacking or not self.supplies)


def replay(
    logs: "Log | Sequence[Log]",
    estimator: str | Callable[[], Estimator[Any]],
    *,
    system_id: int | None = None,
    from_s: float | None = None,
    to_s: float | None = None,
    boot: int | None = None,
    on_estimate: Callable[[Runner], None] | None = None,
) -> Replay:
    """Run an estimator over a log, with one runner for each vehicle in it, or over the logs of a team.

    Args:
        logs: open logs; several only for an estimator of a team, each with different vehicles.
        estimator: name of an estimator, path of a user's file, or a function that creates a new estimator.
        system_id: the only vehicle to use; None: all in the log.
        from_s, to_s, boot: part of each log to read, with the meaning they have in `Log.inside`.
        on_estimate: called with a runner when its estimator has a new estimate; may raise EstimatorFailure.

    Raises:
        EstimatorError: the estimator does not exist, or needs a message that it is not allowed to receive; or
            there are several logs for an estimator of one vehicle, or with the same vehicle in them.
        LogError: a log has no such part.
    """
    make = partial(make_estimator, estimator) if isinstance(estimator, str) else estimator
    opened = [logs] if not isinstance(logs, Sequence) else list(logs)
    probe = Fleet(make)
    if len(opened) > 1 and not probe.team:
        raise EstimatorError(f"{probe.name} is for one vehicle; replay {len(opened)} logs one by one")
    found = _own_vehicles(opened, probe.needs, system_id)
    served = {system: log_supplies(log, system, probe.needs) for system, log in found.items()}
    lacking = {system: missing for system, given in served.items() if (missing := missing_of(given))}
    fleet = Fleet(make, system_ids=[system for system in served if system not in lacking])
    failure = ""
    if not (fleet.team and lacking) and served:
        try:
            for time_us, received, inside in _received(opened, fleet, system_id, Part(from_s, to_s, boot)):
                processed = None
                if not isinstance(received, Message):
                    if inside:
                        processed = fleet.observe(received)
                # A parameter is logged once and is valid from then on, also when it was logged before the
                # selected part.
                elif inside or received.name in NOT_STREAMED:
                    processed = fleet.take(time_us, received)
                else:
                    fleet.pass_over(time_us, received)
                if on_estimate is not None and processed is not None and processed[1] is Outcome.UPDATED:
                    on_estimate(processed[0])
        except EstimatorFailure as error:
            failure = str(error)
    return Replay(logs=opened, fleet=fleet, supplies=served, lacking=lacking, failure=failure)


def vehicles_in(log: "Log", needs: Sequence[Need]) -> list[int]:
    """System ids of vehicles: those whose autopilot has sent a heartbeat or a needed message."""
    names = {"HEARTBEAT"} | {name for need in needs for name in need.messages}
    return sorted(
        {
            key.system_id
            for key in log.keys
            if key.component_id == AUTOPILOT_COMPONENT and key.name in names and key.system_id < GROUND_SYSTEM
        }
    )


def log_rate_hz(log: "Log", system_id: int, name: str) -> float:
    """Rate of a message in a log, from the component of a vehicle that sends most. It is 0 only if the
    message is absent; a message that came once has a positive rate.
    """
    components = [
        key.component_id
        for key in log.keys
        if key.name == name and key.system_id == system_id and why_excluded(name, key.component_id) is None
    ]
    if not components:
        return 0.0
    rate_hz = log.rate_hz(name, system_id=system_id, component_id=components)
    return rate_hz or 1.0 / max(1.0, log.duration_s)


def log_supplies(log: "Log", system_id: int, needs: Sequence[Need]) -> list[Supply]:
    """The supply of the needs from a vehicle's messages in a log."""
    return supplies(needs, lambda name: log_rate_hz(log, system_id, name))


def missing_of(given: Sequence[Supply]) -> list[str]:
    """Texts about missing inputs that are not optional."""
    return [supply.text for supply in given if not supply.met and not supply.need.optional]


def _own_vehicles(logs: Sequence["Log"], needs: Sequence[Need], system_id: int | None) -> dict[int, "Log"]:
    found: dict[int, Log] = {}
    for log in logs:
        for system in vehicles_in(log, needs):
            if system_id not in (None, system):
                continue
            if system in found:
                raise EstimatorError(
                    f"vehicle {system} is in {found[system].path} and in {log.path}; "
                    "logs of one team must have different vehicles in them"
                )
            found[system] = log
    return found


def _received(logs: Sequence["Log"], fleet: Fleet, system_id: int | None, part: Part) -> Iterator[Received]:
    """Needed messages and observations in the order of the file; of several logs, in the order of the team's
    common time.
    """
    names = sorted(fleet.read_names)
    streams = [_all_of(log, _present(log, names), system_id, part, fleet) for log in logs]
    if len(streams) == 1:
        return streams[0]
    runner = fleet.runners[0]
    for log in logs:
        runner.learn_times(_first_system_times(log))
    return heapq.merge(*streams, key=lambda item: runner.common_us(item[0], item[1].src_system))


def _all_of(
    log: "Log", names: Sequence[str], system_id: int | None, part: Part, fleet: Fleet
) -> Iterator[Received]:
    """Messages and, in the order in which they were received, the observations of the run."""
    messages = _messages_of(log, names, system_id, part)
    path = observations_beside(log.path) if fleet.observes else None
    if path is None:
        return messages
    orders = [stream.order[rows] for stream, rows in log.select(names, system_id=system_id)]
    order = np.sort(np.concatenate(orders)).tolist() if orders else []
    return _interleaved(zip(order, messages, strict=True), read_observations(path, fleet.observes))


def _interleaved(
    messages: Iterable[tuple[int, Received]], observations: Iterator[tuple[int, Observation]]
) -> Iterator[Received]:
    following = next(observations, None)
    inside = True
    for position, item in messages:
        while following is not None and following[0] <= position:
            yield following[1].time_us, following[1], inside
            following = next(observations, None)
        inside = item[2]
        yield item
    while following is not None:
        yield following[1].time_us, following[1], inside
        following = next(observations, None)


def _messages_of(
    log: "Log", names: Sequence[str], system_id: int | None, part: Part
) -> Iterator[tuple[int, Message, bool]]:
    selections = log.select(names, system_id=system_id)
    messages = log.messages(names, system_id=system_id)
    if part == Part() or not selections:
        return ((time_us, message, True) for time_us, message in messages)
    order = np.sort(np.concatenate([stream.order[rows].astype(np.int64) for stream, rows in selections]))
    inside = log.inside(order, from_s=part.from_s, to_s=part.to_s, boot=part.boot).tolist()
    return ((*item, kept) for item, kept in zip(messages, inside, strict=True))


def _present(log: "Log", names: Sequence[str]) -> list[str]:
    known = {key.name for key in log.keys}
    return [name for name in names if name in known]


def _first_system_times(log: "Log") -> Iterator[tuple[int, wire.SYSTEM_TIME]]:
    for count, (time_us, message) in enumerate(log.messages(_present(log, ["SYSTEM_TIME"]))):
        if count >= _LEARNT_FROM:
            return
        if is_a(message, wire.SYSTEM_TIME):
            yield time_us, message
