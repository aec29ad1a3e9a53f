"""What a mission records about its flight while it flies: phases, progress, and the commanded path."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.geodesy import GeodeticPosition
from missions.how_left import HowLeft, SafetyCommand

PATTERN = "pattern"
"""Name of the phase that is scored against the commanded path."""
FLIGHT = "flight"
"""Name of the phase until a mission begins its own; a script begins none."""


class CutShort(StrEnum):
    """Why a mission ended before all was flown."""

    TIME = "time limit"
    FOUND = "target found"


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandedPath:
    """The path that the vehicle was commanded to fly.

    Attributes:
        origin: geodetic origin of the local frame: the vehicle's home.
        points_ned_m: the commanded curve, finely sampled (n, 3).
        waypoints_ned_m: the waypoints (m, 3); empty when flown by setpoints.
        acceptance_m: radius within which a waypoint counts as reached.
    """

    origin: GeodeticPosition
    points_ned_m: NDArray[np.float64]
    waypoints_ned_m: NDArray[np.float64]
    acceptance_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Phase:
    """A named stretch of the flight, in vehicle time."""

    name: str
    start_us: int
    end_us: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkLoss:
    """A time in which the link was lost, in vehicle time; `end_us` None: it was never regained."""

    start_us: int
    end_us: int | None = None


@dataclass(slots=True)
class FlightNotes:
    """Notes of one vehicle's flight; a mission writes them, the run reads them.

    Attributes:
        phases: finished phases in order.
        commanded: the commanded path.
        progress: flown share of the pattern, 0..1.
        system_id, autopilot, kind: properties of the vehicle.
        aloft: where and how the vehicle stays in the air after its return, by its parameters; "": it does
            not.
        left_out_parameters: parameters that were to be set, and that the vehicle does not have.
        safety_commands: what was commanded to leave the vehicle safe, because the flight failed or was
            interrupted, and the answers.
        withheld: why nothing (more) was commanded then; "": it was, or it was not necessary.
        left: how the vehicle was left; None: the flight has not ended, or no vehicle was received.
        warnings: warnings for the user, without repetitions.
        link_losses: times at which the link was lost and regained.
        lost_link: the autopilot's reaction to the loss of its ground station, as text; "": not known.
        reached: items of a mission file (index from 0) and the times at which they were reached, in order.
        cut_short: why the mission ended before all was flown, as it may; None: all was to be flown.
        marks: named times and figures that the mission stores for its own score.
    """

    phases: list[Phase] = field(default_factory=list)
    commanded: CommandedPath | None = None
    progress: float = 0.0
    system_id: int = 0
    autopilot: str = ""
    kind: str = ""
    aloft: str = ""
    left_out_parameters: tuple[str, ...] = ()
    safety_commands: list[SafetyCommand] = field(default_factory=list)
    withheld: str = ""
    left: HowLeft | None = None
    warnings: list[str] = field(default_factory=list)
    link_losses: list[LinkLoss] = field(default_factory=list)
    lost_link: str = ""
    reached: list[tuple[int, int]] = field(default_factory=list)
    cut_short: CutShort | None = None
    marks: dict[str, float] = field(default_factory=dict)
    _open: tuple[str, int] | None = None

    def warn(self, text: str) -> None:
        """Add a warning that is shown to the user after the flight; the same text is shown once."""
        if text not in self.warnings:
            self.warnings.append(text)

    @property
    def current(self) -> str:
        """Name of the present phase, or ""."""
        return self._open[0] if self._open else ""

    def begin(self, name: str, time_us: int) -> None:
        """Begin a phase and end the previous one."""
        self.end(time_us)
        self._open = (name, time_us)

    def end(self, time_us: int) -> None:
        """End the present phase."""
        if self._open is not None:
            if time_us > self._open[1]:
                self.phases.append(Phase(name=self._open[0], start_us=self._open[1], end_us=time_us))
            self._open = None

    def phase(self, name: str) -> Phase | None:
        """The first finished phase with a name."""
        return next((p for p in self.phases if p.name == name), None)
