"""Flights as trials: a mission in an embedded world, in the trial's folder, and its row."""

import math
from collections.abc import Mapping
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from typing import Any, Final, Generic, Self

from autopilot_bridge.firmware_process.build import FirmwareBuild
from missions.base.mission import Mission
from missions.base.request import RunRequest
from missions.process.ending import EndedBySignal
from missions.runs.session import COMPLETED, INTERRUPTED, RunResult, fly
from missions.studies.study import Parameters, Row, Study
from missions.studies.trial_runner import trial_folder

__all__ = ["FlightRow", "flown_by", "fly_trial"]

_OTHER: Final = frozenset({"seed", "wall_time_s", "speedup", "planned_wind_m_s"})


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightRow:
    """The result of one flight, from its `summary.json`.

    Attributes:
        completed: the mission was flown, and passed its checks.
        reason: why not; "" otherwise.
        sim_time_s: time from boot to the end.
        distance_m: distance flown by all vehicles.
        path_rms_error_m, path_max_error_m: distance from the commanded path, of the worst vehicle; None:
            there was none.
        max_attitude_error_deg: largest error of the autopilot's attitude.
        figures: the mission's own numbers; True is 1, False is 0.
    """

    completed: bool
    reason: str
    sim_time_s: float
    distance_m: float
    path_rms_error_m: float | None
    path_max_error_m: float | None
    max_attitude_error_deg: float | None
    figures: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, result: RunResult) -> Self:
        """The row of a flight."""
        summary = result.summary
        known = set(cls.__dataclass_fields__) | _OTHER
        own = {
            name: float(value)
            for name, value in summary.items()
            if name not in known and isinstance(value, bool | int | float) and math.isfinite(value)
        }
        return cls(
            completed=result.outcome == COMPLETED,
            reason=result.reason,
            sim_time_s=summary["sim_time_s"],
            distance_m=summary["distance_m"],
            path_rms_error_m=summary["path_rms_error_m"],
            path_max_error_m=summary["path_max_error_m"],
            max_attitude_error_deg=summary["max_attitude_error_deg"],
            figures=own,
        )


_firmware: ContextVar[FirmwareBuild | None] = ContextVar("firmware", default=None)


@dataclass(frozen=True, slots=True)
class _FlownBy(Generic[Parameters, Row]):
    """A trial whose flights are flown by a real firmware.

    Attributes:
        study: the study of the trial.
        firmware: the firmware.
    """

    study: Study[Parameters, Row]
    firmware: FirmwareBuild

    def __call__(self, parameters: Parameters, seed: int) -> Row:
        before = _firmware.set(self.firmware)
        try:
            return self.study.trial(parameters, seed)
        finally:
            _firmware.reset(before)


def flown_by(study: Study[Parameters, Row], firmware: FirmwareBuild | None) -> Study[Parameters, Row]:
    """A study whose flights (`fly_trial`) are flown by a real firmware; None: by the emulated autopilot."""
    if firmware is None:
        return study
    return replace(
        study, trial=_FlownBy(study, firmware), options={**study.options, "firmware": str(firmware)}
    )


def fly_trial(mission: Mission[Any] | str, request: RunRequest) -> RunResult:
    """Fly a mission as (a part of) the running trial, in the trial's folder and without a picture.

    Raises:
        KeyboardInterrupt: the flight was interrupted by a signal; the trial has no result.
        PlanError, MissionError: see `missions.fly`.
    """
    firmware = _firmware.get()
    if firmware is not None:
        world = request.embedded_world
        vehicles = tuple(replace(vehicle, autopilot=firmware.firmware) for vehicle in world.vehicles)
        request = replace(request, firmware=firmware, world=replace(world, vehicles=vehicles))
    result = fly(mission, replace(request, out=trial_folder(), picture=False))
    if result.outcome == INTERRUPTED:
        raise EndedBySignal(result.signal) if result.signal else KeyboardInterrupt
    return result
