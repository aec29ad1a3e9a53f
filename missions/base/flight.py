"""One flight of a mission. What a mission remembers of a flight is in its `MissionFlight`, so that flights of
one mission, one after another or at the same time, do not know each other.
"""

import json
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Generic, ParamSpec, TypeVar

from estimators.scene_items import Item
from missions.base.options import MissionOptions
from missions.base.report import Debriefing, Report, path_verdict_of_all
from missions.errors import MissionError
from missions.flown.run_folder import LOG_NAME, PICTURE_NAME, SUMMARY_NAME
from missions.vehicle.concurrency import run_concurrently
from missions.vehicle.vehicle import Vehicle

__all__ = ["AnyOptions", "FunctionFlight", "MissionFlight"]

AnyOptions = TypeVar("AnyOptions", bound=MissionOptions)
Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


class MissionFlight(Generic[AnyOptions]):
    """The flight of a mission's vehicles, and what is reported about it. Subclasses fly by `fly_one`, or as a
    team by `fly`.

    Args:
        vehicles: the vehicles, each ready to arm.
        options: of each, adapted to it.

    Attributes:
        together: `fly` flies the vehicles as a team; else `fly_one` flies each, and the end of one is not
            that of the others.
    """

    together = False

    def __init__(self, vehicles: Sequence[Vehicle], options: Sequence[AnyOptions]) -> None:
        self.vehicles = tuple(vehicles)
        self.options = tuple(options)

    async def fly_one(self, index: int) -> None:
        """Fly one vehicle, including takeoff and landing."""
        raise NotImplementedError

    async def fly(self) -> None:
        """Fly all vehicles."""
        await run_concurrently([self.fly_one(index) for index in range(len(self.vehicles))])

    def shown(self) -> Mapping[str, Item]:
        """What a viewer shows of the mission now, by name: its area, what it knows, what it has found.

        Vehicles, commanded paths, phases and estimators are shown without it. It is read once a second of
        vehicle time, and changes nothing. Positions are from the first vehicle's home.
        """
        return {}

    def report(self, debriefing: Debriefing) -> Report:
        """What is reported when the flight is over, whether it has come to its end or not."""
        return Report.of(debriefing)


class FunctionFlight(MissionFlight[AnyOptions]):
    """A flight by a function for one vehicle, which may return a report.

    Args:
        function: flies one vehicle with its options, including takeoff and landing.
    """

    def __init__(
        self,
        vehicles: Sequence[Vehicle],
        options: Sequence[AnyOptions],
        function: Callable[[Vehicle, AnyOptions], Awaitable[Report | None]],
    ) -> None:
        super().__init__(vehicles, options)
        self._function = function
        self._reports: dict[int, Report] = {}

    async def fly_one(self, index: int) -> None:
        vehicle = self.vehicles[index]
        returned: object = await self._function(vehicle, self.options[index])
        if isinstance(returned, Report):
            self._reports[vehicle.system_id] = _checked(returned)
        elif returned is not None:
            vehicle.notes.warn(f"the mission returned {returned!r:.60}, which is no Report, and is left out")

    def report(self, debriefing: Debriefing) -> Report:
        """What was returned: as it is for one vehicle, by system id for a team."""
        standard = path_verdict_of_all(debriefing) if debriefing.completed else ""
        if not self._reports:
            return Report(verdict=standard)
        if len(self.vehicles) == 1:
            (own,) = self._reports.values()
            return replace(own, verdict="; ".join(filter(None, (standard, own.verdict))))
        each = sorted(self._reports.items())
        verdicts = (f"vehicle {system_id}: {own.verdict}" for system_id, own in each if own.verdict)
        return Report(
            verdict="; ".join(filter(None, (standard, *verdicts))),
            figures={"reports": {str(system_id): dict(own.figures) for system_id, own in each}},
            lines=[f"vehicle {system_id}: {line}" for system_id, own in each for line in own.lines],
            title=each[0][1].title,
            files={
                f"{system_id}_{name}": data for system_id, own in each for name, data in own.files.items()
            },
            pictures=lambda: {
                f"{system_id}_{name}": data
                for system_id, own in each
                for name, data in own.pictures().items()
            },
        )


def _checked(returned: Report) -> Report:
    """A report of a user.

    Raises:
        MissionError: its figures or files can't be written.
    """
    for name in returned.files:
        if name in (LOG_NAME, SUMMARY_NAME, PICTURE_NAME) or Path(name).name != name:
            raise MissionError(f"the report's file {name!r} can't be written; give it a name of its own")
    try:
        json.dumps(dict(returned.figures))
    except (TypeError, ValueError) as error:
        raise MissionError(
            f"the report's figures can't be written: {error}; use numbers, texts, lists and dicts"
        ) from error
    return replace(
        returned,
        draw=None if returned.draw is None else _named("drawing", returned.draw),
        pictures=_named("pictures", returned.pictures),
    )


def _named(name: str, function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A function of a user's report, whose errors end the run with one line."""

    def called(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        try:
            return function(*args, **kwargs)
        except OSError:
            raise
        except Exception as error:
            raise MissionError(f"the report's {name} failed: {type(error).__name__}: {error}") from error

    return called
