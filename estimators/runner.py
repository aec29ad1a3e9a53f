"""The common loop of all ways to run an estimator: its input is messages, its output is columns of estimates.

Live and embedded flights feed it frames, and a log feeds it messages. All further processing is the same, so
that the same messages in the same order give the same estimates, bit for bit.
"""

import math
from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import DEFINITIONS, Frame, FrameEncoder, MAVLinkMessage
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT, SIMULATOR_COMPONENT
from estimators import wire
from estimators.errors import EstimatorError, EstimatorFailure, described
from estimators.input_guard import NEW_BOOT_US
from estimators.interface import Estimate, EstimateSet, Estimator, Need, Outcome
from estimators.messages import Message, is_a, read_message
from estimators.needs import message_names
from estimators.observations import Observation
from estimators.user_choices import ESTIMATOR_COMPONENTS
from estimators.vehicle_time import TeamTime, VehicleTime

ReceivedT = TypeVar("ReceivedT")

TRUTH_MESSAGES: Final = frozenset({"SIMSTATE", "SIM_STATE", "HIL_STATE", "HIL_STATE_QUATERNION"})
"""Onboard computers. Estimators run there, as do programs that use their own cameras and other sensors."""
ESTIMATE_MESSAGES: Final = frozenset(
    {
        "ATTITUDE",
        "ATTITUDE_QUATERNION",
        "ATTITUDE_QUATERNION_COV",
        "FOLLOW_TARGET",
        "GLOBAL_POSITION_INT",
        "GLOBAL_POSITION_INT_COV",
        "HEARTBEAT",
        "LOCAL_POSITION_NED",
        "LOCAL_POSITION_NED_COV",
        "ODOMETRY",
        "WIND_COV",
    }
)
"""Messages that estimators publish. No estimator receives these from an onboard computer, in flight or from a
log, so that no estimator receives its own output. Other messages from there are measurements, for example
LANDING_TARGET.
"""

_SYSTEM_TIME: Final = "SYSTEM_TIME"


def why_excluded(name: str, component_id: int) -> str | None:
    """The reason why estimators don't receive a component's message; None when they do."""
    if component_id == SIMULATOR_COMPONENT:
        return "truth"
    if component_id in ESTIMATOR_COMPONENTS and name in ESTIMATE_MESSAGES:
        return "from an estimator"
    return None


class EstimateTable:
    """Estimates of one kind in growing columns.

    Estimates of sets (`EstimateSet`) have a row for each target, numbered by `target_index`. An empty set has
    one row with index -1 and NaN as values.

    Args:
        kind: class of the estimates.

    Attributes:
        name: name of that class.
        columns: names of the values, with unit suffixes.
        of_sets: whether the estimates are sets.
        alternatives_of: column with the number of the thing that the rows of an estimate are alternatives
            for; "": they are things of their own.
    """

    def __init__(self, kind: type[Estimate] | type[EstimateSet]) -> None:
        self.name = kind.__name__
        self.columns: tuple[str, ...] = tuple(kind.COLUMNS)
        self.of_sets = hasattr(kind, "rows")
        self.alternatives_of: str = getattr(kind, "ALTERNATIVES_OF", "")
        self._keys = array("q")  # time, subject and boot of each
        self._indices = array("q")  # of the targets in sets
        self._values = array("d")

    def append(self, estimate: Any, boot: int) -> None:
        """Append one estimate of the boot with this number. After an error nothing is appended.

        Raises:
            TypeError, ValueError: a row is not as long as `columns`, or a value is not a number.
        """
        if not self.of_sets:
            values = self._checked(estimate.row(), "row() gives")
            self._keys.extend(array("q", (estimate.time_us, estimate.subject, boot)))
            self._values.extend(values)
            return
        values = array("d")
        rows = estimate.rows()
        for row in rows:
            values.extend(self._checked(row, "rows() gives a row of"))
        key = array("q", (estimate.time_us, estimate.subject, boot))
        self._keys.extend(key * max(1, len(rows)))
        self._indices.extend(range(len(rows)) if len(rows) else (-1,))
        self._values.extend(values or array("d", (math.nan,)) * len(self.columns))

    def _checked(self, row: Any, gives: str) -> "array[float]":
        values = array("d", row)
        if len(values) != len(self.columns):
            raise ValueError(
                f"{self.name}.{gives} {len(values)} values, and COLUMNS names {len(self.columns)}"
            )
        return values

    def __len__(self) -> int:
        return len(self._keys) // 3

    def _key(self, number: int) -> NDArray[np.int64]:
        return np.array(self._keys, dtype=np.int64).reshape(-1, 3)[:, number].copy()

    @property
    def time_us(self) -> NDArray[np.int64]:
        """Vehicle time of each estimate; for a team, the time common to it."""
        return self._key(0)

    @property
    def subject(self) -> NDArray[np.int64]:
        """System id that each estimate is about; 0 for a target."""
        return self._key(1)

    @property
    def boot(self) -> NDArray[np.int64]:
        """Number of the vehicle's boot of each estimate; 0 is the first that was received."""
        return self._key(2)

    @property
    def target_index(self) -> NDArray[np.int64]:
        """Number of each row's target in its set, from 0; -1: the set is empty. Only for estimates of
        sets.
        """
        return np.array(self._indices, dtype=np.int64)

    @property
    def values(self) -> NDArray[np.float64]:
        """One row per estimate, with the values named in `columns`."""
        return np.array(self._values, dtype=np.float64).reshape(len(self), len(self.columns))

    def __getitem__(self, column: str) -> NDArray[np.float64]:
        if column not in self.columns:
            raise KeyError(f"{self.name} has no column {column!r}; there are {', '.join(self.columns)}")
        return self.values[:, self.columns.index(column)]


class Runner:
    """Passes the permitted messages to an estimator, and stores its estimates.

    Not passed on are the truth, messages that estimators publish, messages that are not needed, and, unless
    the estimator serves a team, other vehicles. When the vehicle reboots, an estimator of one vehicle is
    reset.

    Args:
        estimator: a new estimator.
        system_id: the vehicle to use; None: the one whose autopilot sends the first needed message. For a
            team it must be None.

    Attributes:
        estimator: the estimator that was given.
        system_id: the vehicle; None until one was received, and for a team.
        names: names of the messages that are passed to the estimator.
        outcomes: number of messages by outcome.
        left_out: number of messages not passed on, by reason.
        boot: number of the vehicle's boot, from 0.
        tables: estimates by the name of their class.

    Raises:
        EstimatorError: the estimator needs a message that it is not allowed to receive, or a system id was
            given for a team.
    """

    def __init__(self, estimator: Estimator[Any], *, system_id: int | None = None) -> None:
        self.estimator = estimator
        self.names = message_names(_needs_of(estimator))
        forbidden = sorted(self.names & TRUTH_MESSAGES)
        if forbidden:
            raise EstimatorError(
                f"{estimator.NAME} needs {', '.join(forbidden)}: truth is for comparison, not for estimators"
            )
        unknown = sorted(self.names - {found.name for found in DEFINITIONS.values()})
        if unknown:
            raise EstimatorError(f"{estimator.NAME} needs {', '.join(unknown)}: no such message in MAVLink")
        if estimator.TEAM and system_id is not None:
            raise EstimatorError(f"{estimator.NAME} takes all vehicles; system id {system_id} has no effect")
        self.system_id = system_id
        self.outcomes: Counter[Outcome] = Counter()
        self.left_out: Counter[str] = Counter()
        self.boot = 0
        self.tables: dict[str, EstimateTable] = {}
        self._kinds: dict[type[Any], EstimateTable] = {}
        self._vehicle_time = VehicleTime()
        self._trial = FrameEncoder(1, 1)  # a message that can't be packed is a failure of the estimator
        self._team_time = TeamTime() if estimator.TEAM else None
        self._newest_us: int | None = None

    @property
    def read_names(self) -> frozenset[str]:
        """Names of the messages to read from a log: those that the estimator needs and, for a team, those
        that its common time needs.
        """
        return self.names | {_SYSTEM_TIME} if self._team_time is not None else self.names

    @property
    def remarks(self) -> Mapping[str, float | str]:
        """Additional figures of the estimator."""
        try:
            return dict(self.estimator.remarks())
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            return {"remarks_failed": described(error)}

    @property
    def files(self) -> Mapping[str, bytes]:
        """The estimator's own files; none when it fails to make them, which `remarks` report."""
        try:
            return dict(self.estimator.files())
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
            return {}

    def publish(self) -> tuple[MAVLinkMessage, ...]:
        """Messages with the newest estimates.

        Raises:
            EstimatorFailure: the estimator raised an error, or its message can't be packed.
        """
        estimator = self.estimator
        try:
            messages = tuple(estimator.publish())
            for message in messages:
                self._trial.encode(message)
        except Exception as error:
            raise EstimatorFailure(f"{estimator.NAME}.publish() failed: {described(error)}") from error
        return messages

    def feed(self, frame: Frame) -> Outcome | None:
        """Process a frame of a link. Pass every received frame, in order, because all of them define the
        vehicle time.

        Returns:
            The outcome; None for a frame that was left out.
        """
        message = read_message(frame)
        return self.take(self._vehicle_time.stamp(message), message)

    def take(self, time_us: int, message: Message) -> Outcome | None:
        """Process a message at its vehicle time.

        Returns:
            The outcome; None for a message that was left out.

        Raises:
            EstimatorFailure: the estimator raised an error.
        """
        name = message.name
        team_time = self._team_time
        if (
            team_time is not None
            and is_a(message, wire.SYSTEM_TIME)
            and message.src_component == AUTOPILOT_COMPONENT
        ):
            team_time.learn(time_us, message)
        if name not in self.names:
            return None
        component = message.src_component
        if component != AUTOPILOT_COMPONENT and (reason := why_excluded(name, component)):
            self.left_out[reason] += 1
            return None
        if team_time is not None:
            time_us = team_time.common_us(time_us, message.src_system)
        elif self._is_own(message):
            self._watch_boots(time_us)
        else:
            self.left_out["of another vehicle"] += 1
            return None
        return self._processed(time_us, name, self.estimator.handle, message)

    def observe(self, observation: Observation) -> Outcome | None:
        """Process an observation beside messages.

        Returns:
            The outcome; None for one that the estimator does not take, or of another vehicle.

        Raises:
            EstimatorFailure: the estimator raised an error.
        """
        if not isinstance(observation, self.estimator.OBSERVES):
            return None
        time_us = observation.time_us
        if self._team_time is not None:
            time_us = self._team_time.common_us(time_us, observation.src_system)
        elif observation.src_system != self.system_id:
            self.left_out["of another vehicle"] += 1
            return None
        name = type(observation).__name__
        return self._processed(time_us, name, self.estimator.observe, observation)

    def pass_over(self, time_us: int, message: Message) -> None:
        """Skip a message that is outside the selected part; the boots of its vehicle are still counted.

        Raises:
            EstimatorFailure: the estimator raised an error.
        """
        if self._team_time is None and message.name in self.names and self._is_own(message):
            self._watch_boots(time_us)

    def _is_own(self, message: Message) -> bool:
        """Whether a message is of the selected vehicle or, if none was specified, of the first autopilot
        received.
        """
        if self.system_id is None and message.src_component == AUTOPILOT_COMPONENT:
            self.system_id = message.src_system
        return bool(message.src_system == self.system_id)

    def learn_times(self, system_times: Iterable[tuple[int, wire.SYSTEM_TIME]]) -> None:
        """Learn when the vehicles of a team booted, before their messages are processed.

        Args:
            system_times: vehicle times and SYSTEM_TIMEs.
        """
        assert self._team_time is not None, "for teams"
        for time_us, message in system_times:
            if message.src_component == AUTOPILOT_COMPONENT:
                self._team_time.learn(time_us, message)

    def common_us(self, time_us: int, system_id: int) -> int:
        """The team's common time for a vehicle's time; for a single vehicle its own time."""
        return time_us if self._team_time is None else self._team_time.common_us(time_us, system_id)

    def _watch_boots(self, time_us: int) -> None:
        newest_us = self._newest_us
        if newest_us is None or time_us > newest_us:
            self._newest_us = time_us
        elif time_us < newest_us - NEW_BOOT_US:
            self.start_boot()
            self._newest_us = time_us

    def start_boot(self) -> None:
        """Process a reboot of the vehicle: the estimator's state is no longer valid.

        Raises:
            EstimatorFailure: the estimator raised an error.
        """
        self.boot += 1
        try:
            self.estimator.reset()
        except Exception as error:
            raise EstimatorFailure(f"{self.estimator.NAME}.reset() failed: {described(error)}") from error

    def _processed(
        self, time_us: int, name: str, process: Callable[[int, ReceivedT], Outcome], received: ReceivedT
    ) -> Outcome:
        estimator = self.estimator
        try:
            outcome = process(time_us, received)
            if outcome is Outcome.UPDATED:
                kinds, boot = self._kinds, self.boot
                for estimate in estimator.estimates:
                    kind = type(estimate)
                    table = kinds[kind] if kind in kinds else self._new_table(kind)
                    table.append(estimate, boot)
            elif outcome.__class__ is not Outcome:
                method = "handle" if process == estimator.handle else "observe"
                raise TypeError(f"{method} gave {outcome!r}, which is no Outcome")
        except Exception as error:
            raise EstimatorFailure(
                f"{estimator.NAME} failed at {name} of {time_us * 1e-6:.3f} s: {described(error)}"
            ) from error
        self.outcomes[outcome] += 1
        return outcome

    def _new_table(self, kind: type[Any]) -> EstimateTable:
        if not hasattr(kind, "COLUMNS"):
            raise TypeError(f"estimates holds {kind.__name__}, which has no COLUMNS")
        table = self._kinds[kind] = EstimateTable(kind)
        self.tables[table.name] = table
        return table


def _needs_of(estimator: Estimator[Any]) -> Sequence[Need]:
    needs: object = estimator.needs
    if isinstance(needs, Sequence) and needs and all(isinstance(need, Need) for need in needs):
        return needs
    raise EstimatorError(
        f"needs of {estimator.NAME} is {needs!r}; give one or more of estimators.interface.Need"
    )
