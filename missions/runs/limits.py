"""What a log or a run is checked against: a file of limits."""

import tomllib
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Final

from flightsim.foundation.checks import NotNegative
from flightsim.foundation.conversion import Conversion, Refused
from flightsim.foundation.file_content import TEXT_BYTES, FileError, read_text
from flightsim.foundation.options import Options
from missions.errors import PlanError

__all__ = ["Limit", "Limits", "Statistic", "read_limits"]


class Statistic(StrEnum):
    """A number that is made of the values of a field over time."""

    LARGEST = "largest"
    LEAST = "least"
    MOST = "most"
    MEAN = "mean"
    RMS = "rms"
    LAST = "last"
    COUNT = "count"
    RATE_HZ = "rate_hz"
    LONGEST_GAP_S = "longest_gap_s"


OF_MESSAGES: Final = (Statistic.COUNT, Statistic.RATE_HZ, Statistic.LONGEST_GAP_S)
"""Statistics of messages, which need no field."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit(Options):
    """One quantity and its bounds. One of the first five says which quantity.

    Attributes:
        summary: figure of `summary.json`: "path_rms_error_m", or "vehicles.0.not_received_s".
        log: figure of `flightstack log info --json`: "duration_s".
        message: name of a message of which `field` or a statistic is taken: "ATTITUDE".
        estimator: estimator that is run over the log, of whose results `figure` is taken.
        track: statistic of the distance from the path of the golden track, m: "largest", "mean" or "rms".
        field: field of the message, in SI units and radians.
        statistic: what is made of the field's values; "largest" is of magnitudes.
        figure: figure of the estimator's summary: "roll_rms_deg".
        system_id, component_id, instance: of the message, where several are in the log.
        from_s, to_s: vehicle time of the messages, s.
        least, most: bounds of the value.
        equals: the value.
        within: largest difference from the golden value.
        within_share: largest difference as a share of the golden value.
        name: of the check in reports; "": made of the quantity.
    """

    summary: str | None = None
    log: str | None = None
    message: str | None = None
    estimator: str | None = None
    track: Statistic | None = None
    field: str | None = None
    statistic: Statistic = Statistic.LARGEST
    figure: str | None = None
    system_id: int | None = None
    component_id: int | None = None
    instance: int | str | None = None
    from_s: float | None = None
    to_s: float | None = None
    least: float | None = None
    most: float | None = None
    equals: bool | int | float | str | None = None
    within: NotNegative | None = None
    within_share: NotNegative | None = None
    name: str = ""

    def check_together(self) -> None:
        subjects = (self.summary, self.log, self.message, self.estimator, self.track)
        if sum(subject is not None for subject in subjects) != 1:
            raise ValueError("give one of summary, log, message, estimator and track")
        bounds = (self.least, self.most, self.equals, self.within, self.within_share)
        if all(bound is None for bound in bounds):
            raise ValueError("give least, most, equals, within or within_share")
        if self.message is not None and self.field is None and self.statistic not in OF_MESSAGES:
            raise ValueError(
                f"statistic {self.statistic} needs a field; without one: {', '.join(OF_MESSAGES)}"
            )
        if (self.estimator is None) != (self.figure is None):
            raise ValueError("estimator and figure belong together")
        if self.track is not None and self.track in (*OF_MESSAGES, Statistic.LAST):
            raise ValueError("track is largest, least, most, mean or rms")

    @property
    def compares(self) -> bool:
        """Whether it needs another run."""
        return not (self.within is None and self.within_share is None and self.track is None)

    @property
    def title(self) -> str:
        """Its name in reports."""
        if self.name:
            return self.name
        if self.message is not None:
            of = self.message if self.field is None else f"{self.message}.{self.field}"
            return f"{of} {self.statistic}"
        if self.estimator is not None:
            return f"{self.estimator} {self.figure}"
        return self.summary or self.log or f"{self.track} distance from the golden track"


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits(Options):
    """The content of a file of limits."""

    check: tuple[Limit, ...]

    def check_together(self) -> None:
        if not self.check:
            raise ValueError("it has no [[check]]")


def read_limits(path: Path) -> Limits:
    """The limits in a TOML file.

    Raises:
        PlanError: it can't be read, or a key or value is not accepted.
    """
    try:
        table = tomllib.loads(read_text(path, max_bytes=TEXT_BYTES))
        limits: Limits = Conversion().called(Limits, table)
    except FileError as error:
        raise PlanError(str(error)) from error
    except tomllib.TOMLDecodeError as error:
        raise PlanError(f"{path} is not TOML: {error}") from error
    except Refused as error:
        text = str(error) if str(error).startswith(" ") else f": {str(error).removeprefix(': ')}"
        raise PlanError(f"{path}: {error.where}{text}" if error.where else f"{path}{text}") from None
    return limits
