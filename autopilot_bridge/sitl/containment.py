"""A vehicle that fails ends alone: it is stopped, reported, and started again, while the others fly on.

For servers, whose clients may send anything. In an embedded simulation nothing is contained: there an error
ends the run with its reason.

A vehicle that fails again soon after its start has stored what makes it fail: its stored parameters are then
set aside. If it fails even without them, it is left stopped.
"""

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from pathlib import PurePath
from typing import Final

from autopilot_bridge.errors import BridgeError
from flightsim.vehicle import VehicleDivergedError

_PROBATION_US: Final = 60_000_000
"""A failure so soon after the start of the vehicle counts as one of the same cause as the failure before."""


class Aftermath(Enum):
    """What follows the failure of a vehicle; the value is a text for users.

    Attributes:
        short: the same for a text message of the vehicle.
    """

    STARTS_AGAIN = "it starts again"
    STARTS_WITHOUT_STORED = "it starts again without its stored parameters, which are set aside"
    LEFT_STOPPED = "it stays stopped"

    @property
    def short(self) -> str:
        return _SHORT[self]


_SHORT: Final = {
    Aftermath.STARTS_AGAIN: "starts again",
    Aftermath.STARTS_WITHOUT_STORED: "starts without stored values",
    Aftermath.LEFT_STOPPED: "stays stopped",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleFailure:
    """One vehicle could not be simulated on.

    Attributes:
        system_id: of the vehicle.
        time_us: vehicle time.
        reason: what happened.
        aftermath: what follows.
    """

    system_id: int
    time_us: int
    reason: str
    aftermath: Aftermath

    def __str__(self) -> str:
        return (
            f"vehicle {self.system_id} failed at {self.time_us * 1e-6:.1f} s: {self.reason}; "
            f"{self.aftermath.value}, the others are not affected"
        )


FailureReport = Callable[[VehicleFailure], None]


class Probation:
    """Decides what follows the failures of one vehicle."""

    def __init__(self) -> None:
        self._until_us = 0
        self._last: Aftermath | None = None

    def judge(self, time_us: int) -> Aftermath:
        """What follows a failure at this vehicle time."""
        again = self._last is not None and time_us < self._until_us
        if not again:
            self._last = Aftermath.STARTS_AGAIN
        elif self._last is Aftermath.STARTS_AGAIN:
            self._last = Aftermath.STARTS_WITHOUT_STORED
        else:
            self._last = Aftermath.LEFT_STOPPED
        self._until_us = time_us + _PROBATION_US
        return self._last


def reason_of(error: Exception) -> str:
    """A failure in words: of the simulation, of a firmware, or the exception and where it was raised."""
    if isinstance(error, VehicleDivergedError | BridgeError):
        return str(error)
    place = traceback.extract_tb(error.__traceback__)[-1]
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return f"{what} ({PurePath(place.filename).name}, line {place.lineno})"
