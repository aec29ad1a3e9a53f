"""What users set of the commands that look into logs."""

from dataclasses import dataclass
from enum import StrEnum

from estimators.coverage.parameters import CoverageParameters
from estimators.user_choices import ExportFormat
from flightsim.foundation.options import option
from missions.base.options import PlanOptions
from missions.estimation.options import LogPart


@dataclass(frozen=True, slots=True, kw_only=True)
class LogSelection(LogPart):
    """The messages of a log that are used.

    Attributes:
        types: names of messages, several with commas; empty: all.
        source_system, source_component: ids of senders; empty: all.
        condition: an expression of the newest values that must hold; None: no condition.
    """

    types: tuple[str, ...] = option((), metavar="A,B", varies="all", help="Messages.")
    source_system: tuple[int, ...] = option(
        (), least=0, most=255, varies="all", help="System id of a sender; repeat."
    )
    source_component: tuple[int, ...] = option(
        (), least=0, most=255, varies="all", help="Component id of a sender; repeat."
    )
    condition: str | None = option(
        None,
        help="Condition, by the newest values, for which messages are used: 'HEARTBEAT.custom_mode == 4'.",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportOptions(PlanOptions):
    """How messages are written for other tools."""

    format: ExportFormat = option(ExportFormat.CSV, help="Format of the files.")


class TrackBy(StrEnum):
    """Whose track counts."""

    BEST = "best"
    """The truth where a log has it, else the autopilot's."""
    AUTOPILOT = "autopilot"
    TRUTH = "truth"


@dataclass(frozen=True, slots=True, kw_only=True)
class CoverageOptions(CoverageParameters):
    """What users set of the coverage of flights."""

    track_by: TrackBy = option(TrackBy.BEST, help="Source of the tracks; best: the truth where a log has it.")
    system_id: int | None = option(None, least=1, most=255, varies="all", help="System id of the vehicle.")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayOptions(PlanOptions):
    """How a log is played to a link.

    Attributes:
        speed: log seconds per wall second: a number, or "max".
    """

    speed: str = option("1", metavar="X", help="Log seconds per wall second, from 0.1; or max.")
