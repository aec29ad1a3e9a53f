"""What an estimator is: a sans-IO class that takes messages and gives typed estimates.

The same class runs in a process of its own on a live link, embedded on virtual time, and over a log, with the
same numbers: it sees nothing but messages and the vehicle time that they carry.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from autopilot_bridge.geodesy import GeodeticPosition
from autopilot_bridge.mavlink import MAVLinkMessage
from estimators.messages import Message

__all__ = ["Estimate", "Estimator", "Need", "Outcome"]

P = TypeVar("P")


class Outcome(Enum):
    """What became of a message."""

    # Counted with every message: members are singletons, and Enum's own hash is five times as slow.
    __hash__ = object.__hash__

    UPDATED = "updated"
    """A new estimate is there."""
    USED = "used"
    """Taken in; the estimate comes with another message."""
    IGNORED = "ignored"
    """Of no concern."""
    WAITING = "waiting"
    """Can't be used yet: something that it needs has not been heard."""
    LATE = "late"
    """Older than what was used already."""
    REPEATED = "repeated"
    """The same sample once more."""
    NOT_FINITE = "not finite"
    """A value that is NaN or infinite."""
    IMPLAUSIBLE = "implausible"
    """Outside what the sensor can give, or rejected by a statistical test."""
    TIME_JUMP = "time jump"
    """After a gap too long to bridge, or time went back: the estimator has started anew from this message.
    Its first estimate comes with the next UPDATED.
    """


@dataclass(frozen=True, slots=True, kw_only=True)
class Need:
    """An input of an estimator.

    Attributes:
        messages: names of messages that serve, best first; any one of them is enough.
        rate_hz: smallest rate that gives sensible numbers; 0: any.
        purpose: what for, for the text that tells that it is missing: "angular rate and specific force".
        wanted_rate_hz: what to ask a live autopilot for; `rate_hz` if less.
        optional: works without.
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
        COLUMNS: names of what `row` gives, unit-suffixed.
        time_us: vehicle time it is for.
        subject: system id of the vehicle it is about; 0 for a target.
    """

    COLUMNS: ClassVar[tuple[str, ...]]

    @property
    def time_us(self) -> int: ...

    @property
    def subject(self) -> int: ...

    def row(self) -> tuple[float, ...]:
        """The values, for tables and files."""
        ...


class Estimator(ABC, Generic[P]):
    """Base of estimators. One instance serves one vehicle, or with `team` all that are heard.

    Args:
        parameters: of the class `PARAMETERS`; None: its defaults.

    Attributes:
        NAME: as on the command line.
        PARAMETERS: frozen dataclass of the parameters, with unit-suffixed fields and checks.
        TEAM: takes the messages of all vehicles.
    """

    NAME: ClassVar[str]
    PARAMETERS: ClassVar[type[Any]]
    TEAM: ClassVar[bool] = False

    def __init__(self, parameters: P | None = None) -> None:
        self.parameters: P = self.PARAMETERS() if parameters is None else parameters

    @property
    @abstractmethod
    def needs(self) -> tuple[Need, ...]:
        """What it must hear."""

    @abstractmethod
    def handle(self, time_us: int, message: Message) -> Outcome:
        """Take one message. Never raises for what a message says; the outcome tells, and `Runner` counts.

        Args:
            time_us: vehicle time of the message; for a team, on the time base common to all.
            message: from `estimators.messages`, wire units. One that is none of the needs is IGNORED.
        """

    @abstractmethod
    def reset(self) -> None:
        """Forget everything but the parameters."""

    @property
    @abstractmethod
    def estimates(self) -> Sequence[Estimate]:
        """What the newest UPDATED message has changed; most have one."""

    @property
    def origin(self) -> GeodeticPosition | None:
        """Where `north_m` and `east_m` of its estimates are counted from; None: the vehicle's home."""
        return None

    def publish(self) -> Sequence[MAVLinkMessage]:
        """Messages that tell the newest estimates, to be sent from a component id of the estimator's own."""
        return ()

    def remarks(self) -> Mapping[str, float | str]:
        """Further figures for the summary: innovations, biases, what was rejected.

        A text under "warning" is said to the user as well.
        """
        return {}
