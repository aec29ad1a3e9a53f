"""The interface of estimators: a sans-IO class that receives messages and returns typed estimates.

The same class runs in its own process on a live link, embedded on virtual time, and over a log, with the same
results, because its only inputs are messages and their vehicle time.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from autopilot_bridge.mavlink import MAVLinkMessage
from estimators.messages import Message
from estimators.observations import Observation
from estimators.scene_items import Item
from flightsim.foundation.geodesy import GeodeticPosition

P = TypeVar("P")


class Outcome(Enum):
    """The result of processing a message."""

    # Used as dictionary keys with every message: members are singletons, and Enum's own hash is five times as
    # slow.
    __hash__ = object.__hash__

    UPDATED = "updated"
    """A new estimate is available."""
    USED = "used"
    """The message was used; the estimate comes with another message."""
    IGNORED = "ignored"
    """The estimator does not use this message."""
    WAITING = "waiting"
    """The message can't be used yet, because another input was not received."""
    LATE = "late"
    """The message is older than one that was already used."""
    REPEATED = "repeated"
    """The message repeats the previous sample."""
    NOT_FINITE = "not finite"
    """A value that is NaN or infinite."""
    IMPLAUSIBLE = "implausible"
    """A value is outside the sensor's possible range, or a statistical test rejected it."""
    TIME_JUMP = "time jump"
    """A gap was too long to bridge, or time went back: the estimator has restarted from this message. Its
    first estimate comes with the next UPDATED.
    """


@dataclass(frozen=True, slots=True, kw_only=True)
class Need:
    """An input of an estimator.

    Attributes:
        messages: names of suitable messages, best first; any one of them is enough.
        rate_hz: smallest rate that gives useful estimates; 0: any.
        purpose: purpose of the input, for the text that reports it missing: "angular rate and specific
            force".
        wanted_rate_hz: rate to request from a live autopilot; if it is smaller than `rate_hz`, `rate_hz` is
            requested.
        optional: the estimator works without it.
    """

    messages: tuple[str, ...]
    rate_hz: float
    purpose: str
    wanted_rate_hz: float = 0.0
    optional: bool = False

    def __post_init__(self) -> None:
        if not self.messages:
            raise ValueError("a need names no message; name one or more")
        if not (0.0 <= self.rate_hz <= 1000.0):
            raise ValueError(f"rate_hz {self.rate_hz:g} is not in 0..1000")


class Estimate(Protocol):
    """One estimate: a frozen dataclass of unit-suffixed values, with its uncertainty.

    Attributes:
        COLUMNS: names of the values that `row` returns, with unit suffixes.
        time_us: vehicle time of the estimate.
        subject: system id of the estimated vehicle; 0 for a target.
    """

    COLUMNS: ClassVar[tuple[str, ...]]

    @property
    def time_us(self) -> int: ...

    @property
    def subject(self) -> int: ...

    def row(self) -> tuple[float, ...]:
        """The values, for tables and files."""
        ...


class EstimateSet(Protocol):
    """One estimate of any number of targets at a time: a frozen dataclass.

    Attributes:
        COLUMNS: names of the values of each target; with `north_m` and `east_m` among them, sets are compared
            with the true targets.
        time_us: vehicle time of the estimate.
        subject: system id of the vehicle that it is about; 0 for targets.

    A class whose rows are alternatives for one thing, the most probable first, names the column with the
    number of that thing in the class attribute `ALTERNATIVES_OF`.
    """

    COLUMNS: ClassVar[tuple[str, ...]]

    @property
    def time_us(self) -> int: ...

    @property
    def subject(self) -> int: ...

    def rows(self) -> Sequence[tuple[float, ...]]:
        """The values of each target; empty: no target was found."""
        ...


class Estimator(ABC, Generic[P]):
    """Base of estimators. One instance serves one vehicle, or, with `TEAM`, all vehicles that are received.

    Args:
        parameters: of the class `PARAMETERS`; None: its defaults.

    Attributes:
        NAME: name on the command line.
        PARAMETERS: frozen dataclass of the parameters, with unit-suffixed fields and checks.
        TEAM: whether it receives the messages of all vehicles.
        OBSERVES: classes of the observations that it takes beside messages (`estimators.observations`).
        EVENTS: it makes estimates only of what it finds: a run without estimates is complete if it used
            messages.
    """

    NAME: ClassVar[str]
    PARAMETERS: ClassVar[type[Any]]
    TEAM: ClassVar[bool] = False
    OBSERVES: ClassVar[tuple[type[Any], ...]] = ()
    EVENTS: ClassVar[bool] = False

    def __init__(self, parameters: P | None = None) -> None:
        self.parameters: P = self.PARAMETERS() if parameters is None else parameters

    @property
    @abstractmethod
    def needs(self) -> tuple[Need, ...]:
        """The inputs that it needs."""

    @abstractmethod
    def handle(self, time_us: int, message: Message) -> Outcome:
        """Process one message. The content of a message never raises an error; the outcome is returned, and
        `Runner` counts outcomes.

        Args:
            time_us: vehicle time of the message; for a team, on the time base common to all.
            message: from `estimators.messages`, wire units. A message that is not among the needs is IGNORED.
        """

    def observe(self, time_us: int, observation: Observation) -> Outcome:
        """Process an observation of one of the classes in `OBSERVES`, as `handle` does a message.

        Args:
            time_us: vehicle time of the observation; for a team, on the time base common to all.
            observation: such as `estimators.observations.Image`.
        """
        return Outcome.IGNORED

    @abstractmethod
    def reset(self) -> None:
        """Discard everything except the parameters."""

    @property
    @abstractmethod
    def estimates(self) -> Sequence[Estimate] | Sequence[EstimateSet]:
        """The estimates that the newest UPDATED message has changed; most estimators have one."""

    @property
    def origin(self) -> GeodeticPosition | None:
        """The origin of `north_m` and `east_m` in its estimates; None: the vehicle's home."""
        return None

    def publish(self) -> Sequence[MAVLinkMessage]:
        """Messages with the newest estimates, to be sent from the estimator's own component id."""
        return ()

    def shown(self) -> Mapping[str, Item]:
        """What a viewer shows of the estimator's belief now, by name: "particles", "grid/probability".

        What the estimates say is shown without it, by the names of their columns. It is read once a second of
        vehicle time, and changes nothing. Positions are from `origin`.
        """
        return {}

    def files(self) -> Mapping[str, bytes]:
        """Further files of the run, made at its end: contents by name."""
        return {}

    def remarks(self) -> Mapping[str, float | str]:
        """Additional figures for the summary: innovations, biases, numbers of rejected messages.

        A text under "warning" is also shown to the user.
        """
        return {}
